#include "apps/simulator/speed_change.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "core/parallel.h"
#include "core/triangle_tree.h"
#include "flux/rays/spatial_order.h"

namespace scarp {

namespace {

// The surface moved by less in a time step. Spacings.
constexpr double reach = 3;

// Between the normals then and now: speeds on slopes that differ by more say nothing of each other.
constexpr double least_cosine = 0.95;

// The place then that is closest to the middle of each facet now.
std::vector<ClosestPoint> places_then(const TriMesh& before, const TriangleTree& tree,
                                      const TriMesh& now, double spacing) {
  const std::vector<Vec3f> normals_then = facet_normals(before);
  const std::vector<Vec3f> normals = facet_normals(now);
  std::vector<ClosestPoint> places(normals.size());
  parallel_for(places.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const auto [a, b, c] = corners(now, f);
      const ClosestPoint place =
          tree.closest_facing((a + b + c) / 3.0, Vec3d(normals[f]), reach * spacing);
      if (place.found() &&
          dot(Vec3d(normals_then[place.triangle]), Vec3d(normals[f])) > least_cosine)
        places[f] = place;
    }
  });
  return places;
}

// Means over the facets of one main direction around the nodes of a coarse grid, each facet shared
// out between the eight nodes of its cell, and taken back to facets in the same way.
class PatchMeans {
 public:
  PatchMeans(const TriMesh& facets, double width);

  /// Of something per area.
  std::vector<double> sums(std::span<const double> on_facets) const;
  double at_facet(std::size_t f, std::span<const double> of_patches) const {
    double value = 0;
    for (const auto& [patch, share] : shares_[f]) value += share * of_patches[patch];
    return value;
  }
  std::size_t count() const { return areas_.size(); }
  double area(std::size_t patch) const { return areas_[patch]; }

 private:
  struct Share {
    std::size_t patch = 0;
    double share = 0;
  };
  std::vector<std::array<Share, 8>> shares_;  // of each facet
  std::vector<double> facet_areas_;
  std::vector<double> areas_;
};

PatchMeans::PatchMeans(const TriMesh& facets, double width)
    : shares_(facets.triangles.size()), facet_areas_(facet_areas(facets)) {
  constexpr int node_bits = 20;  // of an index; grids have fewer patches along an axis
  std::unordered_map<std::uint64_t, std::size_t> numbers;  // of nodes with a direction
  for (std::size_t f = 0; f < shares_.size(); ++f) {
    const auto [a, b, c] = corners(facets, f);
    const Vec3d middle = (a + b + c) / (3 * width);
    const int direction = main_direction(area_vector(facets, f));
    for (unsigned corner = 0; corner < 8; ++corner) {
      auto key = static_cast<std::uint64_t>(direction);
      double share = 1;
      for (int axis = 0; axis < 3; ++axis) {
        const double lower = std::floor(middle[axis]);
        const bool is_upper = ((corner >> axis) & 1U) != 0;
        key = key << node_bits |
              static_cast<std::uint32_t>(static_cast<int>(lower) + (is_upper ? 1 : 0) +
                                         (1 << (node_bits - 1)));
        share *= is_upper ? middle[axis] - lower : 1 - (middle[axis] - lower);
      }
      const auto number = numbers.try_emplace(key, numbers.size());
      shares_[f][corner] = {number.first->second, share};
    }
  }
  areas_ = std::vector<double>(numbers.size());
  areas_ = sums(std::vector<double>(shares_.size(), 1.0));
}

std::vector<double> PatchMeans::sums(std::span<const double> on_facets) const {
  std::vector<double> sums(areas_.size());
  for (std::size_t f = 0; f < shares_.size(); ++f)
    for (const auto& [patch, share] : shares_[f])
      sums[patch] += share * facet_areas_[f] * on_facets[f];
  return sums;
}

// Speeds, or one part of them, of one layer on the facets, and how they changed.
struct OnFacets {
  std::vector<double> rate;   // nm/s^2
  std::vector<double> speed;  // nm/s
};

OnFacets on_facets(const CornerSpeeds& then, const CornerSpeeds& now,
                   std::span<const ClosestPoint> places, double dt) {
  OnFacets result{std::vector<double>(now.size()), std::vector<double>(now.size())};
  for (std::size_t f = 0; f < now.size(); ++f) {
    if (!places[f].found()) continue;
    double speed = 0;
    double earlier = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      speed += static_cast<double>(now[f][c]) / 3;
      earlier += places[f].barycentric[c] * static_cast<double>(then[places[f].triangle][c]);
    }
    result.rate[f] = (speed - earlier) / dt;
    result.speed[f] = speed;
  }
  return result;
}

// A whole speed of its parts, at the normals of now.
OnFacets at_normals(const TriMesh& facets, std::span<const OnFacets> parts,
                    std::span<const AngularFactor> factors) {
  OnFacets whole = parts.front();
  const std::vector<Vec3f> normals = facet_normals(facets);
  for (std::size_t k = 0; k < factors.size(); ++k) {
    for (std::size_t f = 0; f < normals.size(); ++f) {
      const double factor = factors[k].value(normals[f]);
      whole.rate[f] += factor * parts[1 + k].rate[f];
      whole.speed[f] += factor * parts[1 + k].speed[f];
    }
  }
  return whole;
}

std::vector<float> relative_change(const PatchMeans& patches, const OnFacets& speeds) {
  const std::vector<double> rates = patches.sums(speeds.rate);
  std::vector<double> sizes = speeds.speed;
  for (double& size : sizes) size = std::abs(size);
  sizes = patches.sums(sizes);
  std::vector<float> change(speeds.rate.size());
  for (std::size_t f = 0; f < change.size(); ++f) {
    const double size = patches.at_facet(f, sizes);
    if (size > 0) change[f] = static_cast<float>(patches.at_facet(f, rates) / size);
  }
  return change;
}

double typical_change(const PatchMeans& patches, std::span<const double> rates) {
  const std::vector<double> sums = patches.sums(rates);
  double squares = 0;
  double fourth_powers = 0;
  for (std::size_t patch = 0; patch < sums.size(); ++patch) {
    const double area = patches.area(patch);
    if (area == 0) continue;
    const double square = std::pow(sums[patch] / area, 2);
    squares += area * square;
    fourth_powers += area * square * square;
  }
  return squares > 0 ? std::sqrt(fourth_powers / squares) : 0;
}

void change_by(CornerSpeeds& speeds, std::span<const float> change, double time) {
  for (std::size_t f = 0; f < speeds.size(); ++f) {
    const float part = std::clamp(static_cast<float>(time) * change[f], -1.0F, 1.0F);
    for (float& speed : speeds[f]) speed += part * std::abs(speed);
  }
}

}  // namespace

SpeedChange speed_change(const SurfaceSpeeds& before, const TriangleTree& tree_before,
                         const SurfaceSpeeds& now, std::span<const std::size_t> layer_of_facet,
                         std::span<const AngularFactor> factors, double dt, double spacing) {
  constexpr double patch_width = 4;  // spacings
  const std::vector<ClosestPoint> places =
      places_then(before.facets, tree_before, now.facets, spacing);
  const PatchMeans patches(now.facets, patch_width * spacing);
  SpeedChange change;
  std::vector<double> seen(places.size());
  for (std::size_t k = 0; k < now.of_layers.size(); ++k) {
    const LayerSpeeds& then = before.of_layers[k];
    const LayerSpeeds& speeds = now.of_layers[k];
    LayerChange& of_layer = change.of_layers.emplace_back();
    std::vector<OnFacets> parts;
    for (std::size_t v = 0; v < speeds.parts.size(); ++v) {
      parts.push_back(on_facets(then.parts[v], speeds.parts[v], places, dt));
      of_layer.of_parts.push_back(relative_change(patches, parts.back()));
    }
    const OnFacets whole = parts.empty() ? on_facets(then.speed, speeds.speed, places, dt)
                                         : at_normals(now.facets, parts, factors);
    of_layer.of_speed = relative_change(patches, whole);
    for (std::size_t f = 0; f < seen.size(); ++f)
      if (layer_of_facet[f] == k) seen[f] = whole.rate[f];
  }
  change.typical = typical_change(patches, seen);
  return change;
}

std::vector<LayerSpeeds> changed_speeds(std::span<const LayerSpeeds> speeds,
                                        const SpeedChange& change, double time) {
  std::vector<LayerSpeeds> changed(speeds.begin(), speeds.end());
  for (std::size_t k = 0; k < change.of_layers.size(); ++k) {
    change_by(changed[k].speed, change.of_layers[k].of_speed, time);
    for (std::size_t v = 0; v < changed[k].parts.size(); ++v)
      change_by(changed[k].parts[v], change.of_layers[k].of_parts[v], time);
  }
  return changed;
}

}  // namespace scarp

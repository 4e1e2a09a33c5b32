#include "levelset/motion/extend.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/grid/exposure.h"
#include "levelset/motion/contact_line.h"
#include "levelset/motion/inert_layers.h"
#include "levelset/motion/overgrowth.h"

namespace scarp {

namespace {

float speed_on(std::span<const std::array<float, 3>> speeds, std::span<const FacetShare> facets) {
  double speed = 0;
  for (const FacetShare& each : facets) {
    const std::array<float, 3>& corners = speeds[each.point.triangle];
    double on_facet = 0;
    for (std::size_t c = 0; c < 3; ++c) on_facet += each.point.barycentric[c] * corners[c];
    speed += each.share * on_facet;
  }
  return static_cast<float>(speed);
}

/// The side of an edge that the surface follows there, as a share of all.
std::optional<FacetShare> leading_share(const TriMesh& facets, std::span<const FacetShare> sides,
                                        std::span<const std::array<float, 3>> speeds) {
  if (sides.size() == 1) return std::nullopt;
  std::vector<float> of_sides;
  for (const FacetShare& side : sides) {
    const FacetShare alone{.point = side.point};
    of_sides.push_back(speed_on(speeds, {&alone, 1}));
  }
  const auto leading = leading_side(facets, sides, of_sides);
  if (!leading) return std::nullopt;
  return FacetShare{.point = sides[*leading].point};
}

/// The speed that a layer has at a node next to the surface: with factors of the normal at that of
/// phi, which does not depend on how facets lie there.
class SpeedAt {
 public:
  SpeedAt(const NearNode& at, std::span<const FacetShare> facets,
          std::span<const AngularFactor> factors)
      : facets_(facets), factors_(factors) {
    if (factors.empty()) return;
    const Vec3d gradient = central_gradient(at.phi);
    normal_ = Vec3f(length(gradient) > 0 ? normalized(gradient) : Vec3d{0, 0, 1});
  }

  float of(const LayerSpeeds& layer) const { return of(layer, normal_); }

  float of(const LayerSpeeds& layer, const Vec3f& normal) const {
    if (factors_.empty()) return speed_on(layer.speed, facets_);
    float speed = part(layer, 0, normal);
    for (std::size_t k = 1; k <= factors_.size(); ++k) speed += part(layer, k, normal);
    return speed;
  }

  /// Whether the parts of a speed that of() gave take each other away, but for a tenth.
  bool cancels(const LayerSpeeds& layer, float speed) const {
    float gross = 0;
    for (std::size_t k = 0; k <= factors_.size(); ++k) gross += std::abs(part(layer, k, normal_));
    return std::abs(speed) < 0.1F * gross;
  }

 private:
  // The isotropic one, and then that of each factor.
  float part(const LayerSpeeds& layer, std::size_t k, const Vec3f& normal) const {
    const float amplitude = speed_on(layer.parts[k], facets_);
    return k == 0 ? amplitude : factors_[k - 1].value(normal) * amplitude;
  }

  std::span<const FacetShare> facets_;
  std::span<const AngularFactor> factors_;
  Vec3f normal_;
};

/// The mean over dt of the speed at a node, from layer to layer.
float mean_speed(const Layers& layers, std::span<const LayerSpeeds> speeds_of_layers,
                 const NearNode& at, std::size_t seen, float speed, const SpeedAt& speed_at,
                 double dt) {
  if (speed >= 0 || seen == 0) return speed;
  std::vector<float> speeds;
  for (std::size_t layer = 0; layer <= seen; ++layer)
    speeds.push_back(speed_at.of(speeds_of_layers[layer]));
  std::vector<float> depth;
  find_depths(layers, surface_point(layers, at.leaf, at.node), depth);
  return speed_through_layers(speeds, depth, seen, static_cast<float>(dt));
}

/// Whether no part of a speed takes anything away.
bool only_grow(std::span<const LayerSpeeds> speeds_of_layers) {
  const auto grows = [](const CornerSpeeds& speeds) {
    return std::all_of(speeds.begin(), speeds.end(), [](const std::array<float, 3>& corners) {
      return *std::min_element(corners.begin(), corners.end()) >= 0;
    });
  };
  return std::all_of(speeds_of_layers.begin(), speeds_of_layers.end(), [&](const LayerSpeeds& of) {
    return std::all_of(of.parts.begin(), of.parts.end(), grows);
  });
}

/// A node belongs to what grows or to what does not move, by the last field, never to both.
void part_from_standing(std::vector<std::vector<float>>& fields) {
  constexpr std::size_t grain = 8 * leaf_size;
  constexpr float half = 0.5F;
  const std::vector<float>& grows = fields.back();
  parallel_for(grows.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end; ++at) {
      const float scale = grows[at] < half ? 0 : 1 / grows[at];
      for (std::size_t v = 0; v + 1 < fields.size(); ++v) fields[v][at] *= scale;
    }
  });
}

/// Lets what grows by its normal pass over what does not move: a speed without a normal, where it
/// has none of its own.
void pass_inert(const Layers& layers, const std::vector<bool>& is_inert, double dt,
                const std::vector<float>& whole, std::vector<float>& speed) {
  std::vector<float> passing = whole;
  overgrow(layers, is_inert, dt, passing);
  for (std::size_t at = 0; at < passing.size(); ++at) {
    if (passing[at] != whole[at]) speed[at] = passing[at];
  }
}

/// No facet recedes faster, whatever its normal.
float fastest_etch_of(const LayerSpeeds& speeds, const LimitingSpeed& limiting_speed) {
  const bool has_factors = !speeds.parts.empty();
  const CornerSpeeds& isotropic = has_factors ? speeds.parts.front() : speeds.speed;
  return parallel_reduce(
      isotropic.size(), 1024, 0.0F,
      [&](std::size_t begin, std::size_t end) {
        float fastest = 0;
        for (std::size_t f = begin; f < end; ++f) {
          for (std::size_t c = 0; c < 3; ++c) {
            const auto amplitude = [&](std::size_t k) { return speeds.parts[1 + k][f][c]; };
            const float speed =
                has_factors ? -limiting_speed(isotropic[f][c], amplitude) : isotropic[f][c];
            fastest = std::max(fastest, fastest_etch(speed));
          }
        }
        return fastest;
      },
      [](float a, float b) { return std::max(a, b); });
}

bool is_zero(const CornerSpeeds& speeds) {
  return std::all_of(speeds.begin(), speeds.end(), [](const std::array<float, 3>& corners) {
    return corners == std::array<float, 3>{0, 0, 0};
  });
}

/// Which layers move, and how fast each recedes at most.
void find_moving_layers(std::span<const LayerSpeeds> speeds_of_layers,
                        std::span<const AngularFactor> factors, std::size_t facet_count,
                        SpeedField& field) {
  const LimitingSpeed limiting_speed(factors);
  for (const LayerSpeeds& layer : speeds_of_layers) {
    SCARP_ASSERT(facet_count, ==, layer.speed.size());
    SCARP_ASSERT(layer.parts.size(), ==, factors.empty() ? 0 : 1 + factors.size());
    field.is_inert.push_back(is_zero(layer.speed) &&
                             std::all_of(layer.parts.begin(), layer.parts.end(), is_zero));
    field.fastest_etch.push_back(fastest_etch_of(layer, limiting_speed));
  }
  field.grows_beside_inert =
      !factors.empty() && has_standing_layers(field) && only_grow(speeds_of_layers);
}

}  // namespace

SpeedField extend_speeds(const Layers& layers, const OpenGas& gas, FacetTree& facets,
                         std::span<const LayerSpeeds> speeds_of_layers,
                         std::span<const AngularFactor> factors, double dt, double distance) {
  SCARP_ASSERT(speeds_of_layers.size(), ==, layers.stack.size());
  SpeedField field;
  field.closed = closed_nodes(layers, gas);
  std::atomic<std::size_t> nodes = 0;
  std::atomic<std::size_t> newly_seen = 0;
  const auto values_at = [&](const NearNode& at, std::span<const FacetShare> shares,
                             std::span<float> values) {
    std::size_t seen = exposed_layer_next_to(layers, at.index, at.phi);
    // A film that meets a wall is seen from within, even if the wall is as near.
    if (field.grows_beside_inert && field.is_inert[seen] && *at.phi < 0) {
      seen = layer_at(layers, at.index);
    }
    nodes.fetch_add(1, std::memory_order_relaxed);
    const std::uint32_t facet = shares.front().point.triangle;
    if (!facets.facets.materials.empty() &&
        layers.stack[seen].material != facets.facets.materials[facet])
      newly_seen.fetch_add(1, std::memory_order_relaxed);
    const LayerSpeeds& of_seen = speeds_of_layers[seen];
    const std::optional<FacetShare> leading = leading_share(facets.facets, shares, of_seen.speed);
    if (leading) shares = {&*leading, 1};
    const SpeedAt speed_at(at, shares, factors);
    const float speed = speed_at.of(of_seen);
    const float mean = mean_speed(layers, speeds_of_layers, at, seen, speed, speed_at, dt);
    if (factors.empty()) {
      values[0] = mean;
      return;
    }
    if (!field.grows_beside_inert) {
      // The normal of phi at the node knows of the wall.
      const Vec3d normal = normalized(area_vector(facets.facets, facet));
      const auto at_line = speed_at_contact_line(
          layers, at.index, seen, normal, [&](std::size_t layer, const Vec3d& n) {
            return speed_at.of(speeds_of_layers[layer], Vec3f(n));
          });
      if (at_line) {
        values[0] = *at_line;
        return;
      }
    }
    // With parts that nearly cancel the least error of the normal would be scaled, too.
    const bool adds = mean != speed && speed_at.cancels(of_seen, speed);
    const float scale = adds || speed == 0 ? 1.0F : mean / speed;
    for (std::size_t v = 0; v <= factors.size(); ++v) {
      values[v] = scale * speed_on(of_seen.parts[v], shares);
    }
    if (adds) values[0] += mean - speed;
    if (field.grows_beside_inert) {
      values[1 + factors.size()] = mean;
      values[2 + factors.size()] = field.is_inert[seen] ? 0 : 1;
    }
  };
  find_moving_layers(speeds_of_layers, factors, facets.facets.triangles.size(), field);
  // Then the last ones are the whole speed, and how much of it is that of what grows.
  const std::size_t count = 1 + factors.size() + (field.grows_beside_inert ? 2 : 0);
  auto fields = Extension(layers, gas, facets, distance, values_at)
                    .run(count, field.is_inert, field.grows_beside_inert);
  field.newly_seen = nodes == 0 ? 0 : static_cast<double>(newly_seen) / static_cast<double>(nodes);
  if (field.grows_beside_inert) {
    part_from_standing(fields);
    pass_inert(layers, field.is_inert, dt, fields[1 + factors.size()], fields[0]);
  }
  field.speed = std::move(fields[0]);
  const bool grows =
      std::any_of(field.speed.begin(), field.speed.end(), [](float speed) { return speed > 0; });
  if (factors.empty() && grows && has_standing_layers(field)) {
    overgrow(layers, field.is_inert, dt, field.speed);
  }
  for (std::size_t part = 0; part < factors.size(); ++part) {
    field.angular.push_back({factors[part], std::move(fields[1 + part])});
  }
  return field;
}

double stable_time_step(const Layers& layers, std::span<const LayerSpeeds> speeds_of_layers,
                        std::span<const AngularFactor> factors, double cfl) {
  const std::vector<bool> in_reach = layers_within(layers, 2);
  const LimitingSpeed limiting_speed(factors);
  float fastest = 0;
  for (std::size_t layer = 0; layer < speeds_of_layers.size(); ++layer) {
    if (!in_reach[layer]) {
      continue;
    }
    const LayerSpeeds& speeds = speeds_of_layers[layer];
    const CornerSpeeds& isotropic = factors.empty() ? speeds.speed : speeds.parts.front();
    for (std::size_t f = 0; f < isotropic.size(); ++f) {
      for (std::size_t c = 0; c < 3; ++c) {
        const auto amplitude = [&](std::size_t k) { return speeds.parts[1 + k][f][c]; };
        fastest = std::max(fastest, limiting_speed(isotropic[f][c], amplitude));
      }
    }
  }
  return fastest > 0 ? cfl * layers.frame.spacing / static_cast<double>(fastest)
                     : std::numeric_limits<double>::infinity();
}

}  // namespace scarp

#include "levelset/operations/fill.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "levelset/grid/band.h"
#include "levelset/grid/exposure.h"
#include "levelset/operations/layer_sets.h"

namespace scarp {

namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();

/// Numbers on the nodes of a level plane, those beyond the sides folded.
class Plane {
 public:
  explicit Plane(const Band& band, float value = 0)
      : band_(band),
        count_{band.node_count(0), band.node_count(1)},
        values_(static_cast<std::size_t>(count_[0]) * static_cast<std::size_t>(count_[1]), value) {}

  int count(int axis) const { return count_[static_cast<std::size_t>(axis)]; }
  float& at(int i, int j) { return values_[index(i, j)]; }
  float at(int i, int j) const { return values_[index(i, j)]; }
  float folded(int i, int j) const { return at(band_.fold(0, i), band_.fold(1, j)); }
  float along(int axis, int place, int other) const {
    return axis == 0 ? folded(place, other) : folded(other, place);
  }

 private:
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(count_[1]) +
           static_cast<std::size_t>(j);
  }

  const Band& band_;
  std::array<int, 2> count_;
  std::vector<float> values_;
};

/// How far along an axis it is from every node to where a value crosses zero on that axis, within
/// some nodes. Units: spacings.
Plane distances_along(const Band& band, const Plane& values, int axis, int reach) {
  Plane found(band, infinite);
  for (int i = 0; i < values.count(0); ++i)
    for (int j = 0; j < values.count(1); ++j) {
      const int place = axis == 0 ? i : j;
      const int other = axis == 0 ? j : i;
      float& nearest = found.at(i, j);
      for (const int step : {-1, 1})
        for (int n = 0; n <= reach && static_cast<float>(n) < nearest; ++n) {
          const float here = values.along(axis, place + step * n, other);
          const float next = values.along(axis, place + step * (n + 1), other);
          if ((here < 0) == (next < 0)) continue;
          nearest = std::min(nearest, static_cast<float>(n) + crossing(here, next));
          break;
        }
    }
  return found;
}

/// The distance in the plane from nodes at or above zero to where the value crosses zero on an edge
/// between nodes; 0 at those below it. As far as reach; infinite beyond it.
Plane distances_to_negative(const Band& band, const Plane& values, int axes, int reach) {
  Plane result(band, infinite);
  for (int i = 0; i < values.count(0); ++i)
    for (int j = 0; j < values.count(1); ++j)
      if (values.at(i, j) < 0) result.at(i, j) = 0;
  for (int axis = 0; axis < axes; ++axis) {
    const Plane along = distances_along(band, values, axis, reach);
    for (int i = 0; i < values.count(0); ++i)
      for (int j = 0; j < values.count(1); ++j) {
        float& nearest = result.at(i, j);
        if (nearest == 0) continue;
        const int other = axis == 0 ? j : i;
        for (int across = axes == 2 ? -reach : 0; across <= (axes == 2 ? reach : 0); ++across) {
          if (static_cast<float>(std::abs(across)) >= nearest) continue;
          const float there = along.along(axis, axis == 0 ? i : j, other + across);
          nearest = std::min(nearest, std::hypot(there, static_cast<float>(across)));
        }
      }
  }
  return result;
}

/// By how much an opening is wider than a disc there, in the plane of some nodes: below 0 where no
/// disc of the radius that lies in the gas covers them. Units: spacings.
Plane width_in_plane(const Band& band, int k, float radius) {
  const int axes = band.frame().lateral_axes();
  const int reach = static_cast<int>(std::ceil(radius)) + 1;
  Plane phi(band);
  for (int i = 0; i < phi.count(0); ++i)
    for (int j = 0; j < phi.count(1); ++j) phi.at(i, j) = band.node(i, j, k);
  // Centres of such discs are below 0.
  Plane centres = distances_to_negative(band, phi, axes, reach);
  for (int i = 0; i < phi.count(0); ++i)
    for (int j = 0; j < phi.count(1); ++j)
      centres.at(i, j) = radius - std::min(centres.at(i, j), static_cast<float>(reach + 1));
  Plane width = distances_to_negative(band, centres, axes, reach);
  for (int i = 0; i < phi.count(0); ++i)
    for (int j = 0; j < phi.count(1); ++j)
      width.at(i, j) = radius - std::min(width.at(i, j), static_cast<float>(reach + 1));
  return width;
}

/// What of the nodes below a height is to be filled: a value below 0.
class Wanted {
 public:
  Wanted(const Layers& layers, double height, const FillPlaces& places)
      : layers_(layers),
        band_(layers.top().band()),
        spacing_(layers.frame.spacing),
        lowest_(static_cast<int>(std::floor(layers.top().lower() / spacing_)) - 1),
        highest_(static_cast<int>(std::ceil(height / spacing_)) + 1) {
    planes_.resize(static_cast<std::size_t>(std::max(highest_ - lowest_ + 1, 0)), Plane(band_, -1));
    if (places.narrower_than)
      find_narrow(static_cast<float>(0.5 * *places.narrower_than / spacing_));
    if (!places.on.empty()) find_floors(places.on);
  }

  double at(Vec3d r) const {
    const auto index = [&](int axis) {
      return static_cast<int>(std::lround(r[axis] / spacing_ + layers_.frame.middle(axis)));
    };
    const int k = std::clamp(index(2), lowest_, highest_);
    return spacing_ * static_cast<double>(planes_[static_cast<std::size_t>(k - lowest_)].folded(
                          index(0), index(1)));
  }

 private:
  void find_narrow(float radius) {
    parallel_for(planes_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        planes_[n] = width_in_plane(band_, lowest_ + static_cast<int>(n), radius);
    });
  }

  // Between two columns, of which one is filled, the side lies halfway.
  void find_floors(std::span<const MaterialId> on) {
    constexpr float halfway = 0.5F;
    const int rows = band_.node_count(1);
    const auto columns =
        static_cast<std::size_t>(band_.node_count(0)) * static_cast<std::size_t>(rows);
    parallel_for(columns, 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t column = begin; column < end; ++column) {
        const int i = static_cast<int>(column) / rows;
        const int j = static_cast<int>(column) % rows;
        bool is_wanted = false;
        for (int k = lowest_; k <= highest_; ++k) {
          const bool is_floor = band_.node(i, j, k - 1) < 0 && !(band_.node(i, j, k) < 0);
          if (is_floor) {
            const std::uint16_t seen = exposed_layer(layers_, {i, j, k - 1}, 2);
            is_wanted = std::ranges::find(on, layers_.stack[seen].material) != on.end();
          }
          float& value = planes_[static_cast<std::size_t>(k - lowest_)].at(i, j);
          value = std::max(value, is_wanted ? -halfway : halfway);
        }
      }
    });
  }

  const Layers& layers_;
  const Band& band_;
  double spacing_;
  int lowest_;
  int highest_;
  std::vector<Plane> planes_;  ///< from the lowest up
};

}  // namespace

void fill(Layers& layers, double height, const FillPlaces& places) {
  const Frame& frame = layers.frame;
  const double margin = LevelSet::half_width * frame.spacing;
  const double lower = std::min(layers.top().lower(), height);
  if (!places.narrower_than && places.on.empty()) {
    const LevelSet below(
        frame, [&](Vec3d r) { return r.z - height; }, height - margin, height + margin);
    return fill_gas(layers, below);
  }
  const Wanted wanted(layers, height, places);
  // What is wanted is known on nodes alone, so no leaf is left out.
  const double everywhere = std::numeric_limits<double>::max();
  const LevelSet solid(
      frame, [&](Vec3d r) { return std::max(r.z - height, wanted.at(r)); }, lower - margin,
      height + margin, everywhere);
  fill_gas(layers, solid);
}

}  // namespace scarp

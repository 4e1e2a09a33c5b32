#include "levelset/operations/fill.h"

#include <algorithm>
#include <array>
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
      : band_(&band),
        count_{band.node_count(0), band.node_count(1)},
        values_(static_cast<std::size_t>(count_[0]) * static_cast<std::size_t>(count_[1]), value) {}

  int count(int axis) const { return count_[static_cast<std::size_t>(axis)]; }
  float& at(int i, int j) { return values_[index(i, j)]; }
  float at(int i, int j) const { return values_[index(i, j)]; }
  float folded(int i, int j) const { return at(band_->fold(0, i), band_->fold(1, j)); }
  float along(int axis, int place, int other) const {
    return axis == 0 ? folded(place, other) : folded(other, place);
  }

 private:
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(count_[1]) +
           static_cast<std::size_t>(j);
  }

  const Band* band_;
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
    planes_.resize(static_cast<std::size_t>(std::max(highest_ - lowest_ + 1, 0)),
                   Plane(band_, -LevelSet::half_width));
    if (places.narrower_than)
      find_narrow(static_cast<float>(0.5 * *places.narrower_than / spacing_));
    if (!places.on.empty()) find_floors(places.on);
  }

  /// At a node.
  double at(Vec3d r) const {
    const auto index = [&](int axis) {
      return static_cast<int>(std::lround(r[axis] / spacing_ + layers_.frame.middle(axis)));
    };
    const int i = index(0);
    const int j = index(1);
    const int k = std::clamp(index(2), lowest_, highest_);
    // Solid stays as far from its surface as it is.
    if (band_.node(i, j, k) < 0) return spacing_;
    const float below = k > lowest_ ? plane(k - 1).folded(i, j) : 0;
    const float here = plane(k).folded(i, j);
    // Over a rim the distance to it.
    if (here > 0 && below < 0 && !(band_.node(i, j, k - 1) < 0))
      return spacing_ * static_cast<double>(std::max(1 + below, smallest_phi));
    return spacing_ * static_cast<double>(here);
  }

 private:
  Plane& plane(int k) { return planes_[static_cast<std::size_t>(k - lowest_)]; }
  const Plane& plane(int k) const { return planes_[static_cast<std::size_t>(k - lowest_)]; }

  void find_narrow(float radius) {
    parallel_for(planes_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        planes_[n] = width_in_plane(band_, lowest_ + static_cast<int>(n), radius);
    });
    parallel_for(planes_.size() - 1, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        find_rims(lowest_ + static_cast<int>(n), static_cast<int>(std::ceil(radius)) + 1);
    });
  }

  // The fill of an opening ends level with its rim, which lies between this plane and the next.
  void find_rims(int k, int reach) {
    for (int i = 0; i < band_.node_count(0); ++i)
      for (int j = 0; j < band_.node_count(1); ++j) {
        const bool is_top = band_.node(i, j, k) > 0 && plane(k).at(i, j) < 0 &&
                            band_.node(i, j, k + 1) > 0 && plane(k + 1).at(i, j) > 0;
        if (is_top) plane(k).at(i, j) = -rim_above({i, j, k}, reach);
      }
  }

  // How far above a node the nearest solid in its plane ends. Units: spacings. In (0, 1].
  float rim_above(const Node& node, int reach) const {
    const int across = layers_.frame.lateral_axes() == 2 ? reach : 0;
    int nearest = 2 * reach * reach + 1;
    float rim = 1;
    for (int x = -reach; x <= reach; ++x)
      for (int y = -across; y <= across; ++y) {
        const int square = x * x + y * y;
        if (square > nearest) continue;
        const float here = band_.node(node[0] + x, node[1] + y, node[2]);
        const float above = band_.node(node[0] + x, node[1] + y, node[2] + 1);
        if (!(here < 0) || above < 0) continue;
        const float end = crossing(here, above);
        rim = square < nearest ? end : std::min(rim, end);
        nearest = square;
      }
    return std::max(rim, smallest_phi);
  }

  void find_floors(std::span<const MaterialId> on) {
    const int rows = band_.node_count(1);
    const auto columns =
        static_cast<std::size_t>(band_.node_count(0)) * static_cast<std::size_t>(rows);
    std::vector<Plane> over(planes_.size(), Plane(band_, 1));  // below 0 over what is wanted
    const auto of = [&](int k) -> Plane& { return over[static_cast<std::size_t>(k - lowest_)]; };
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
          if (is_wanted) of(k).at(i, j) = -1;
        }
      }
    });
    parallel_for(planes_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        for (int i = 0; i < over[n].count(0); ++i)
          for (int j = 0; j < over[n].count(1); ++j) {
            float& value = planes_[n].at(i, j);
            value = std::max(value, side_of(over[n], i, j, lowest_ + static_cast<int>(n)));
          }
    });
  }

  // Between two columns of gas, of which one is filled, the side lies halfway.
  float side_of(const Plane& over, int i, int j, int k) const {
    constexpr float halfway = 0.5F;
    const float here = over.at(i, j);
    const auto parts = [&](int x, int y) {
      return over.folded(x, y) * here < 0 && !(band_.node(x, y, k) < 0);
    };
    const bool is_at_side =
        parts(i - 1, j) || parts(i + 1, j) || parts(i, j - 1) || parts(i, j + 1);
    return here * (is_at_side ? halfway : LevelSet::half_width);
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
  if (height <= layers.top().lower()) return;  // all below is solid
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

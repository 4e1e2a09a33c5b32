#include "levelset/operations/fill.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "levelset/grid/band.h"
#include "levelset/grid/exposure.h"
#include "levelset/operations/clearance.h"
#include "levelset/operations/layer_sets.h"

namespace scarp {

namespace {

using Plane = LevelPlane<float>;

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
    if (places.narrower_than) find_narrow(0.5 * *places.narrower_than / spacing_);
    if (!places.on.empty()) find_floors(places.on);
    has_tops_ = places.on.empty();
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
    if (band_.node(i, j, k) < 0) return spacing_ * static_cast<double>(beside_tops({i, j, k}));
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

  // At a wall that leans away above it, solid ends where the fill around it does; else it stays.
  float beside_tops(const Node& node) const {
    constexpr float stays = 1;
    const auto [i, j, k] = node;
    if (!has_tops_ || band_.node(i, j, k + 1) < 0) return stays;
    float top = -std::numeric_limits<float>::infinity();
    for (const int axis : {0, 1})
      for (const int step : {-1, 1}) {
        const int x = axis == 0 ? i + step : i;
        const int y = axis == 1 ? j + step : j;
        if (band_.node(x, y, k) < 0) continue;
        const float there = plane(k).folded(x, y);
        if (there < -1 || there > 0) return stays;
        top = std::max(top, there);
      }
    return std::isinf(top) ? stays : top;
  }

  void find_narrow(double radius) {
    std::vector<Plane> spare(planes_.size(), Plane(band_));
    parallel_for(planes_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        Clearance found = clearance(band_, lowest_ + static_cast<int>(n), radius);
        planes_[n] = std::move(found.covered);
        spare[n] = std::move(found.spare);
      }
    });
    const int reach = static_cast<int>(std::min(
        std::ceil(radius), 2.0 * std::max(band_.frame().cells[0], band_.frame().cells[1])));
    parallel_for(static_cast<std::size_t>(band_.node_count(0)), 1,
                 [&](std::size_t begin, std::size_t end) {
                   for (std::size_t i = begin; i < end; ++i)
                     find_tops(static_cast<int>(i), reach + 1, spare);
                 });
  }

  // Where the fill ends between a plane and the next.
  void find_tops(int i, int reach, const std::vector<Plane>& spare) {
    for (int j = 0; j < band_.node_count(1); ++j)
      for (int k = lowest_; k < highest_; ++k) {
        const bool is_top = band_.node(i, j, k) > 0 && plane(k).at(i, j) < 0 &&
                            band_.node(i, j, k + 1) > 0 && plane(k + 1).at(i, j) > 0;
        if (!is_top) continue;
        const auto n = static_cast<std::size_t>(k - lowest_);
        plane(k).at(i, j) = -top_above({i, j, k}, reach, spare[n].at(i, j), spare[n + 1].at(i, j));
      }
  }

  // How far above a node. here: by how much the opening is wider than wanted in its plane; next: in
  // the plane above. Units: spacings. In (0, 1].
  float top_above(const Node& node, int reach, float here, float next) const {
    // An opening that becomes wider step by step has walls that lean, and no rim.
    constexpr float leaning = 1;
    const bool leans = here < 0 && next - here < leaning;
    const float top = leans ? -here / std::max(next - here, smallest_phi) : rim_above(node, reach);
    return std::clamp(top, smallest_phi, 1.0F);
  }

  // How far above a node the nearest solid in its plane ends; halfway where none does.
  float rim_above(const Node& node, int reach) const {
    const int across = layers_.frame.lateral_axes() == 2 ? reach : 0;
    int nearest = 2 * reach * reach + 1;
    float rim = 0.5F;
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
    return rim;
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
  bool has_tops_ = false;      ///< below 0 they tell how far above nodes the fill ends, to 1
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

#include "levelset/grid/slope.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "levelset/grid/band.h"
#include "levelset/grid/carry.h"
#include "levelset/grid/stencil.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 64;

constexpr float largest_factor = 2;

// What some nodes have in common; of the worst one the square of the slope, as a factor.
struct Slopes {
  std::size_t nodes = 0;
  std::size_t off = 0;
  float worst_factor = 1;
  float worst_square = 1;
  Node worst_at{};
};

// Not a number is worse than any other.
bool is_worse(float a, float b) { return !(a <= b) && !std::isnan(b); }

Slopes joined(Slopes all, const Slopes& some) {
  all.nodes += some.nodes;
  all.off += some.off;
  if (!is_worse(some.worst_factor, all.worst_factor)) return all;
  all.worst_factor = some.worst_factor;
  all.worst_square = some.worst_square;
  all.worst_at = some.worst_at;
  return all;
}

float slope_square(const float* p) {
  float square = 0;
  for (const std::ptrdiff_t stride : axis_strides) {
    const float before = p[0] - p[-stride];
    const float after = p[stride] - p[0];
    // Either may be not a number, and then the sum is.
    square += std::max(before * before, after * after) + 0 * (before + after);
  }
  return square;
}

// Other leaves have no node next to the surface, unless something is far off.
bool comes_near(const float* phi) {
  int found = 0;
  for (int node = 0; node < leaf_size; ++node) {
    const float distance = std::abs(phi[node]);
    found |=
        static_cast<int>(distance < 1.5F) | static_cast<int>(!(distance <= LevelSet::half_width));
  }
  return found != 0;
}

Slopes slopes_of(const Leaf& leaf, const Block& block) {
  Slopes slopes;
  for_each_node(next_to_surface(leaf, block), [&](int offset) {
    const float square = slope_square(block.row(offset >> 6, (offset >> 3) & 7) + (offset & 7));
    const float factor = square < 1 ? 1 / square : square;
    const bool is_off = !(factor <= largest_factor * largest_factor);
    slopes = joined(slopes, {1, is_off ? 1U : 0U, factor, square, node_at(leaf, offset)});
  });
  return slopes;
}

}  // namespace

SurfaceSlopes surface_slopes(const LevelSet& phi) {
  const Band& band = phi.band();
  const auto values = [&](std::size_t leaf) -> const float* { return band.leaves()[leaf].phi; };
  const Slopes slopes = parallel_reduce(
      band.leaves().size(), grain, Slopes{},
      [&](std::size_t begin, std::size_t end) {
        Slopes some;
        Block block;
        for (std::size_t n = begin; n < end; ++n) {
          if (!comes_near(values(n))) continue;
          gather<1>(band, n, values, block);
          some = joined(some, slopes_of(band.leaves()[n], block));
        }
        return some;
      },
      joined);
  return {.nodes = slopes.nodes,
          .off = slopes.off,
          .worst = std::sqrt(slopes.worst_square),
          .worst_at = band.frame().node_position(slopes.worst_at)};
}

}  // namespace scarp

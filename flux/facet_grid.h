#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/huge_pages.h"
#include "core/vec3.h"
#include "flux/ray.h"

namespace scarp {

/// Three components side by side, for operations on all at once.
using Lanes [[gnu::vector_size(4 * sizeof(double))]] = double;
using FloatLanes [[gnu::vector_size(4 * sizeof(float))]] = float;

/// Facets by the cells of a uniform grid that they reach into, for flights through mostly empty
/// space.
///
/// Each cell without facets knows, for each of the eight octants of direction, how far the cube of
/// such cells reaches that begins with it: a flight crosses it in one step. The facets of one
/// surface have similar sizes, so that cells of that size hold few of them, and a flight meets only
/// those where it starts and ends. A mesh whose facets differ by orders of magnitude is slow.
/// Source: Cohen and Sheffer 1994, "Proximity clouds", here with a distance for each octant.
///
/// Memory: 150 to 230 bytes per facet of simplified surfaces, and as much again while it is built.
class FacetGrid {
 public:
  static constexpr std::size_t block_size = 8;

  /// Up to eight facets of a cell that have up to eight vertices together. Two lines of memory.
  struct alignas(64) Block {
    /// By axis, in whole steps from the grid's lower corner; those behind the last repeat it.
    std::array<std::array<std::uint16_t, block_size>, 3> vertices;
    std::array<std::uint32_t, block_size> corners;  ///< of each the number of its vertex, in bytes
    std::array<std::uint32_t, block_size> facets;   ///< Ray::no_facet where there are fewer
    bool is_last;                                   ///< of its cell
  };

  FacetGrid() = default;

  /// One line of memory.
  struct alignas(64) Facet {
    std::array<Vec3f, 3> corners;
    Vec3d normal;  ///< of length 1
  };

  /// Facets are in every cell that comes within padding of them, and a little more for what walks
  /// are off by.
  ///
  /// lower, upper: hold all facets and flights.
  FacetGrid(std::span<const Facet> facets, Vec3d lower, Vec3d upper, double padding);

  double padding() const { return padding_; }
  Vec3d lower() const { return lower_; }
  /// One over the lengths, along each axis, in which the vertices of blocks are counted: they are
  /// rounded to whole steps.
  Vec3d per_step() const { return per_step_; }

  class Walks;

 private:
  using Index3 = std::array<int, 3>;

  // The length in cells of an empty cube of a kind below 16: 1, 2, 3, 4, 6, 8, 12 and so on to 192.
  // Kind 0 is the cell itself.
  static constexpr std::uint32_t cube_length(std::uint32_t kind) {
    return ((2U + (kind & 1U)) << (kind >> 1)) >> 1;
  }

  // Bricks of cells, so that neighbours share lines and pages of memory.
  static constexpr int brick_bits = 3;
  static constexpr int brick = 1 << brick_bits;

  std::int32_t index(int x, int y, int z) const {
    constexpr int inner = brick - 1;
    const int of_brick =
        (x >> brick_bits) + bricks_[0] * ((y >> brick_bits) + bricks_[1] * (z >> brick_bits));
    return (of_brick << (3 * brick_bits)) | (z & inner) << (2 * brick_bits) |
           (y & inner) << brick_bits | (x & inner);
  }

  // A plane that none of a cell's facets reaches over: n r <= height in all of them. In cells, from
  // the grid's lower corner.
  struct Ceiling {
    Vec3f n;
    float height = 0;
  };

  class EmptyCubes;
  class BlocksOfCells;

  // Corners in whole steps, and the area vector that they make, in cells.
  struct Rounded {
    std::array<std::array<std::uint16_t, 3>, 3> corners;  // by corner and axis
    Vec3f area;
  };
  // Of steps.
  Vec3d cells_per_step() const {
    return {per_cell_ / per_step_.x, per_cell_ / per_step_.y, per_cell_ / per_step_.z};
  }

  template <class Use>
  void for_each_cell(const Facet& facet, const Use& use) const;
  void sort_in(std::span<const Facet> facets);
  Rounded rounded(const Facet& facet) const;
  void measure_empty_cubes();

  Vec3d lower_;
  double padding_ = 0;
  Vec3d per_step_;
  double cell_size_ = 0;
  double per_cell_ = 0;
  float walk_error_ = 0;  // in cells
  double room_ = 0;       // cells hold what comes so close
  Index3 size_{};
  Index3 bricks_{};
  // A cell without facets: half a byte per octant, the kind of its cube. Otherwise
  // the lowest half byte is 0 and the others hold the first block.
  LargeVector<std::uint32_t> cells_;
  LargeVector<Block> blocks_;
  LargeVector<Ceiling> ceilings_;  // at the first block of each cell
};

/// Many walks along straight flights at once, from cell to cell: each step takes all of them one
/// cell, or one cube of empty cells, further. That fills the lanes of the processor, and they wait
/// for memory together.
class FacetGrid::Walks {
 public:
  static constexpr std::size_t capacity = 128;

  /// The flight r + t u, from t = 0 to t_end.
  void start(const FacetGrid& grid, std::size_t walk, Vec3d r, Vec3d u, double t_end);

  /// Looks at the cells where the first count walks are.
  void look(const FacetGrid& grid, std::size_t count);
  bool has_facets(std::size_t walk) const { return (cell_[walk] & 15U) == 0; }
  /// Asks the memory for what may_meet() needs.
  void prefetch_ceiling(const FacetGrid& grid, std::size_t walk) const {
    __builtin_prefetch(&grid.ceilings_[cell_[walk] >> 4]);
  }
  /// False where a flight stays above all facets of its cell, which has some.
  bool may_meet(const FacetGrid& grid, std::size_t walk) const;
  /// The first block of a cell that has facets.
  const Block* blocks(const FacetGrid& grid, std::size_t walk) const {
    return grid.blocks_.data() + (cell_[walk] >> 4);
  }

  /// Nothing further away than t is of interest.
  void shorten(const FacetGrid& grid, std::size_t walk, double t) {
    t_end_[walk] = in_cells(grid, t);
  }

  /// To the next cells. Fills ended with the walks whose end lies in the cell just left, and
  /// returns their number.
  std::size_t go_on(std::size_t count, std::array<std::uint32_t, capacity>& ended);

  void move(std::size_t from, std::size_t to);

 private:
  template <class T>
  using PerWalk = std::array<T, capacity>;

  static float in_cells(const FacetGrid& grid, double t) {
    return static_cast<float>(t * grid.per_cell_) + grid.walk_error_;
  }

  // In cells. A walk is ahead of its flight, along each axis, by as much as single precision may
  // leave it behind: so each step brings it to another cell.
  std::array<PerWalk<float>, 3> start_;
  std::array<PerWalk<float>, 3> u_;
  std::array<PerWalk<float>, 3> inverse_;  // of u
  // From where to the side of its cell or cube is the way on which a flight itself leaves it.
  std::array<PerWalk<float>, 3> behind_;
  PerWalk<float> t_;
  PerWalk<float> t_exit_;
  PerWalk<float> t_end_;
  PerWalk<std::uint32_t> shift_;  // of the octant's half byte
  PerWalk<std::uint32_t> cell_;
};

// All axes at once, since divisions take long.
inline void FacetGrid::Walks::start(const FacetGrid& grid, std::size_t walk, Vec3d r, Vec3d u,
                                    double t_end) {
  constexpr float least_speed = 1e-12F;
  const Vec3d from_lower = r - grid.lower_;
  const Lanes place = grid.per_cell_ * Lanes{from_lower.x, from_lower.y, from_lower.z, 0};
  const FloatLanes from = __builtin_convertvector(place, FloatLanes);
  const FloatLanes along = __builtin_convertvector(Lanes{u.x, u.y, u.z, 1}, FloatLanes);
  const auto is_up = along >= 0;
  const FloatLanes at_least = along > least_speed ? along : FloatLanes{} + least_speed;
  const FloatLanes at_most = along < -least_speed ? along : FloatLanes{} - least_speed;
  const FloatLanes speed = is_up ? at_least : at_most;
  const FloatLanes inverse = 1 / speed;
  const FloatLanes start = is_up ? from + grid.walk_error_ : from - grid.walk_error_;
  const FloatLanes behind = is_up ? from : from - 1;
  shift_[walk] = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    start_[axis][walk] = start[axis];
    u_[axis][walk] = speed[axis];
    inverse_[axis][walk] = inverse[axis];
    behind_[axis][walk] = behind[axis];
    shift_[walk] |= is_up[axis] != 0 ? 0U : 4U << axis;
  }
  t_[walk] = 0;
  t_end_[walk] = in_cells(grid, t_end);
}

// Loops without branches, so that some become vectors and the others read far ahead.
inline void FacetGrid::Walks::look(const FacetGrid& grid, std::size_t count) {
  const std::uint32_t* const cells = grid.cells_.data();
  std::array<PerWalk<std::int32_t>, 3> at;
  PerWalk<std::int32_t> index;
  for (std::size_t w = 0; w < count; ++w) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      at[axis][w] = static_cast<std::int32_t>(start_[axis][w] + t_[w] * u_[axis][w]);
  }
  for (std::size_t w = 0; w < count; ++w) {
    index[w] = grid.index(at[0][w], at[1][w], at[2][w]);
    __builtin_prefetch(cells + index[w]);
  }
  for (std::size_t w = 0; w < count; ++w) cell_[w] = cells[index[w]];
  for (std::size_t w = 0; w < count; ++w) {
    // A cell with facets is left, whatever the other half bytes hold.
    const std::uint32_t is_empty = (cell_[w] & 15U) != 0 ? 15U : 0U;
    const auto reach = static_cast<float>(
        static_cast<std::int32_t>(cube_length((cell_[w] >> shift_[w]) & is_empty)));
    t_exit_[w] = std::numeric_limits<float>::infinity();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float inverse = inverse_[axis][w];
      const float side = static_cast<float>(at[axis][w]) + std::copysign(reach, inverse);
      const float t = (side - behind_[axis][w]) * inverse;
      t_exit_[w] = t < t_exit_[w] ? t : t_exit_[w];
    }
  }
}

inline bool FacetGrid::Walks::may_meet(const FacetGrid& grid, std::size_t walk) const {
  const auto& [n, height] = grid.ceilings_[cell_[walk] >> 4];
  const std::array<float, 3> normal{n.x, n.y, n.z};
  float above_at_start = -height;
  float climb = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    above_at_start += normal[axis] * start_[axis][walk];
    climb += normal[axis] * u_[axis][walk];
  }
  const float t_out = t_exit_[walk] < t_end_[walk] ? t_exit_[walk] : t_end_[walk];
  return (above_at_start + climb * t_[walk] <= 0) | (above_at_start + climb * t_out <= 0);
}

inline std::size_t FacetGrid::Walks::go_on(std::size_t count,
                                           std::array<std::uint32_t, capacity>& ended) {
  for (std::size_t w = 0; w < count; ++w) t_[w] = t_[w] < t_exit_[w] ? t_exit_[w] : t_[w];
  std::size_t ended_count = 0;
  for (std::size_t w = 0; w < count; ++w) {
    ended[ended_count] = static_cast<std::uint32_t>(w);
    ended_count += t_[w] >= t_end_[w] ? 1 : 0;
  }
  return ended_count;
}

inline void FacetGrid::Walks::move(std::size_t from, std::size_t to) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (PerWalk<float>* values : {&start_[axis], &u_[axis], &inverse_[axis], &behind_[axis]})
      (*values)[to] = (*values)[from];
  t_[to] = t_[from];
  t_exit_[to] = t_exit_[from];
  t_end_[to] = t_end_[from];
  shift_[to] = shift_[from];
  cell_[to] = cell_[from];
}

}  // namespace scarp

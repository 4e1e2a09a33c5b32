#include "flux/facet_grid.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"

namespace scarp {

namespace {

constexpr std::size_t octant_count = 8;
constexpr std::uint32_t no_facets = ~std::uint32_t{0};
constexpr std::uint64_t most_blocks = std::uint64_t{1} << 28;

// In cells. Longer cubes are not told apart.
constexpr std::uint8_t longest_cube = 192;

InputError too_many(std::size_t facets) {
  return InputError("flux: " + std::to_string(facets) +
                    " facets are too many, or differ too much in size; simplify the mesh");
}

// The edge of a cell over the mean edge of squares of the facets' areas. Smaller cells hold fewer
// facets, but a flight passes more of them: 1 to 2 are equally fast.
constexpr double cell_per_facet_edge = 1.5;
constexpr double most_cells_per_facet = 16;
constexpr double least_most_cells = 4096;

// Most facets count most: a few large ones only fill more cells.
double mean_edge(std::span<const FacetGrid::Facet> facets) {
  double sum = 0;
  for (const FacetGrid::Facet& facet : facets) {
    const auto& [a, b, c] = facet.corners;
    sum += std::sqrt(0.5 * length(cross(Vec3d(b) - Vec3d(a), Vec3d(c) - Vec3d(a))));
  }
  return sum / static_cast<double>(facets.size());
}

// Whether a facet reaches into a cell whose box overlaps its own, told by the cell's middle: it
// does if they overlap as seen along each axis, and if its plane cuts the cell. Source: Schwarz and
// Seidel 2010.
class Overlap {
 public:
  Overlap(const std::array<Vec3f, 3>& corners, double half_cell) {
    const std::array<Vec3d, 3> r{Vec3d(corners[0]), Vec3d(corners[1]), Vec3d(corners[2])};
    const auto reach = [&](auto... n) { return half_cell * (std::abs(n) + ...); };
    n_ = cross(r[1] - r[0], r[2] - r[0]);
    const double height = dot(n_, r[0]);
    const double room = reach(n_.x, n_.y, n_.z);
    lower_ = height - room;
    upper_ = height + room;
    for (int axis = 0; axis < 3; ++axis) {
      const int a = (axis + 1) % 3;
      const int b = (axis + 2) % 3;
      const double turn = n_[axis] < 0 ? -1 : 1;  // corners in the order of the clock or against it
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d along = r[(k + 1) % 3] - r[k];
        const double n_a = -turn * along[b];
        const double n_b = turn * along[a];
        edges_[static_cast<std::size_t>(axis)][k] = {
            n_a, n_b, n_a * r[k][a] + n_b * r[k][b] - reach(n_a, n_b)};
      }
    }
  }

  /// Along an axis; a and b: where the middle is on the next two.
  bool is_seen(std::size_t axis, double a, double b) const {
    bool is_inside = true;
    for (const Edge& edge : edges_[axis]) is_inside &= edge.n_a * a + edge.n_b * b >= edge.least;
    return is_inside;
  }
  bool is_cut(Vec3d middle) const {
    const double height = dot(n_, middle);
    return height >= lower_ && height <= upper_;
  }

 private:
  // What lies on the facet's side of it, or not further than a cell reaches.
  struct Edge {
    double n_a;
    double n_b;
    double least;
  };

  Vec3d n_;
  double lower_ = 0;
  double upper_ = 0;
  std::array<std::array<Edge, 3>, 3> edges_;  // by axis that they are seen along
};

}  // namespace

FacetGrid::FacetGrid(std::span<const Facet> facets, Vec3d lower, Vec3d upper, double padding)
    : padding_(padding) {
  const Vec3d within = upper - lower;
  const double most_cells =
      most_cells_per_facet * static_cast<double>(facets.size()) + least_most_cells;
  cell_size_ = std::max(cell_per_facet_edge * mean_edge(facets),
                        std::cbrt(within.x * within.y * within.z / most_cells));
  per_cell_ = 1 / cell_size_;
  // What rounding makes of a place, a time, a direction and what follows from them: up to seven
  // halves of the last digit of single precision at the far end; ten are given.
  constexpr double some = 5 * std::numeric_limits<float>::epsilon();
  const double walk_error = some * length(within);
  walk_error_ = static_cast<float>(walk_error * per_cell_);
  room_ = padding + 3 * walk_error;
  lower_ = lower - Vec3d{room_, room_, room_};
  const Vec3d extent = upper - lower_ + Vec3d{room_, room_, room_};
  constexpr double steps = std::numeric_limits<std::uint16_t>::max();
  per_step_ = {steps / extent.x, steps / extent.y, steps / extent.z};
  for (int axis = 0; axis < 3; ++axis)
    bricks_[static_cast<std::size_t>(axis)] =
        static_cast<int>(extent[axis] / cell_size_) / brick + 1;
  for (std::size_t axis = 0; axis < 3; ++axis) size_[axis] = bricks_[axis] * brick;
  cells_.assign(static_cast<std::size_t>(index(0, 0, size_[2])), no_facets);
  sort_in(facets);
  measure_empty_cubes();
}

template <class Use>
void FacetGrid::for_each_cell(const Facet& facet, const Use& use) const {
  const auto& [a, b, c] = facet.corners;
  Index3 first;
  Index3 last;
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell_of = [&](double r) {
      const int most = size_[static_cast<std::size_t>(axis)] - 1;
      return std::clamp(static_cast<int>((r - lower_[axis]) / cell_size_), 0, most);
    };
    first[static_cast<std::size_t>(axis)] = cell_of(std::min({a[axis], b[axis], c[axis]}) - room_);
    last[static_cast<std::size_t>(axis)] = cell_of(std::max({a[axis], b[axis], c[axis]}) + room_);
  }
  const Overlap overlap(facet.corners, 0.5 * cell_size_ + room_);
  for (int z = first[2]; z <= last[2]; ++z) {
    for (int y = first[1]; y <= last[1]; ++y) {
      Vec3d middle = lower_ + cell_size_ * Vec3d{0, y + 0.5, z + 0.5};
      if (!overlap.is_seen(0, middle.y, middle.z)) continue;
      for (int x = first[0]; x <= last[0]; ++x) {
        middle.x = lower_.x + cell_size_ * (x + 0.5);
        if (overlap.is_cut(middle) && overlap.is_seen(1, middle.z, middle.x) &&
            overlap.is_seen(2, middle.x, middle.y))
          use(static_cast<std::uint32_t>(index(x, y, z)));
      }
    }
  }
}

FacetGrid::Rounded FacetGrid::rounded(const Facet& facet) const {
  Rounded result;
  std::array<Vec3f, 3> r;
  const Vec3f cells = Vec3f(cells_per_step());
  for (std::size_t corner = 0; corner < 3; ++corner) {
    const Vec3d from_lower = Vec3d(facet.corners[corner]) - lower_;
    for (int axis = 0; axis < 3; ++axis) {  // none is below zero
      const auto step = static_cast<std::uint16_t>(per_step_[axis] * from_lower[axis] + 0.5);
      result.corners[corner][static_cast<std::size_t>(axis)] = step;
      r[corner][axis] = cells[axis] * step;
    }
  }
  result.area = cross(r[1] - r[0], r[2] - r[0]);
  return result;
}

// The blocks and ceilings of some cells, one cell after the other.
class FacetGrid::BlocksOfCells {
 public:
  explicit BlocksOfCells(const FacetGrid& grid)
      : step_(grid.cells_per_step()),
        // Vertices are rounded by up to half a step along each axis, .87 together; walks are ahead
        // of their flights.
        room_(static_cast<float>(std::max({step_.x, step_.y, step_.z}) +
                                 grid.room_ * grid.per_cell_)) {}

  /// Returns the number of its first block. facets: of the cell, at least one.
  std::size_t add(std::span<const std::uint32_t> facets, std::span<const Rounded> rounded) {
    const std::size_t first = blocks_.size();
    Vec3f area;
    open_.clear();
    for (const std::uint32_t f : facets) {
      area += rounded[f].area;
      const auto takes = [&](Open& open) { return open.put(f, rounded[f]); };
      if (std::ranges::none_of(open_, takes)) takes(open_.emplace_back());
    }
    for (Open& open : open_) blocks_.push_back(open.closed());
    blocks_.back().is_last = true;
    ceilings_.resize(blocks_.size());
    ceilings_[first] = ceiling_over(std::span(blocks_).subspan(first), normalized(area));
    return first;
  }

  const std::vector<Block>& blocks() const { return blocks_; }
  const std::vector<Ceiling>& ceilings() const { return ceilings_; }

 private:
  // A block of the present cell.
  struct Open {
    using Corner = std::array<std::uint16_t, 3>;

    Block block{};
    std::array<Corner, block_size + 3> vertices{};
    std::size_t vertex_count = 0;
    std::size_t facet_count = 0;

    // False if there is no room for it.
    bool put(std::uint32_t f, const Rounded& rounded) {
      if (facet_count == block_size) return false;
      std::size_t count = vertex_count;
      std::uint32_t numbers = 0;
      for (std::size_t corner = 0; corner < 3; ++corner) {
        std::size_t number = 0;
        while (number < count && vertices[number] != rounded.corners[corner]) ++number;
        if (number == count) vertices[count++] = rounded.corners[corner];
        numbers |= static_cast<std::uint32_t>(number) << (8 * corner);
      }
      if (count > block_size) return false;
      vertex_count = count;
      block.corners[facet_count] = numbers;
      block.facets[facet_count++] = f;
      return true;
    }

    const Block& closed() {
      std::fill(block.facets.begin() + static_cast<std::ptrdiff_t>(facet_count), block.facets.end(),
                Ray::no_facet);
      for (std::size_t k = 0; k < block_size; ++k)
        for (std::size_t axis = 0; axis < 3; ++axis)
          block.vertices[axis][k] = vertices[std::min(k, vertex_count - 1)][axis];
      return block;
    }
  };

  // Across a unit vector, at the highest vertex.
  Ceiling ceiling_over(std::span<const Block> blocks, Vec3f n) const {
    const Vec3f across{n.x * step_.x, n.y * step_.y, n.z * step_.z};
    float height = std::numeric_limits<float>::lowest();
    for (const Block& block : blocks) {
      for (std::size_t k = 0; k < block_size; ++k) {
        const auto& [x, y, z] = block.vertices;
        const float its = across.x * static_cast<float>(x[k]) +
                          across.y * static_cast<float>(y[k]) + across.z * static_cast<float>(z[k]);
        height = its > height ? its : height;
      }
    }
    return {n, height + room_};
  }

  Vec3f step_;  // in cells
  float room_;  // in cells, over the highest vertex
  std::vector<Block> blocks_;
  std::vector<Ceiling> ceilings_;  // at the first block of each cell
  std::vector<Open> open_;
};

void FacetGrid::sort_in(std::span<const Facet> facets) {
  std::vector<std::uint32_t> count(cells_.size());
  std::vector<std::uint32_t> reached;  // cells, facet by facet
  std::vector<std::size_t> reached_by(facets.size() + 1);
  std::vector<Rounded> rounded_facets(facets.size());
  reached.reserve(4 * facets.size());
  for (std::uint32_t f = 0; f < facets.size(); ++f) {
    rounded_facets[f] = rounded(facets[f]);
    for_each_cell(facets[f], [&](std::uint32_t cell) {
      ++count[cell];
      reached.push_back(cell);
    });
    reached_by[f + 1] = reached.size();
  }
  // Before memory is asked for that no machine has.
  if (reached.size() / block_size >= most_blocks) throw too_many(facets.size());
  // The same, cell by cell.
  struct Filled {
    std::uint32_t cell;
    std::uint32_t end;  // of its facets
  };
  std::vector<Filled> filled;
  std::uint32_t sum = 0;
  for (std::uint32_t cell = 0; cell < count.size(); ++cell) {
    if (count[cell] == 0) continue;
    sum += count[cell];
    filled.push_back({cell, sum});
    count[cell] = sum - count[cell];  // where the next goes
  }
  std::vector<std::uint32_t> of_cell(reached.size());
  for (std::uint32_t f = 0; f < facets.size(); ++f)
    for (std::size_t k = reached_by[f]; k < reached_by[f + 1]; ++k)
      of_cell[count[reached[k]]++] = f;

  constexpr std::size_t cells_at_once = 4096;
  const std::size_t part_count = (filled.size() + cells_at_once - 1) / cells_at_once;
  std::vector<BlocksOfCells> parts(part_count, BlocksOfCells(*this));
  parallel_for(part_count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part) {
      const std::size_t last = std::min((part + 1) * cells_at_once, filled.size());
      for (std::size_t k = part * cells_at_once; k < last; ++k) {
        const std::uint32_t first = k == 0 ? 0 : filled[k - 1].end;
        const auto own = std::span(of_cell).subspan(first, filled[k].end - first);
        cells_[filled[k].cell] = static_cast<std::uint32_t>(parts[part].add(own, rounded_facets));
      }
    }
  });
  std::vector<std::size_t> first_of(part_count + 1);
  for (std::size_t part = 0; part < part_count; ++part)
    first_of[part + 1] = first_of[part] + parts[part].blocks().size();
  if (first_of.back() >= most_blocks) throw too_many(facets.size());
  blocks_.resize(first_of.back());
  ceilings_.resize(first_of.back());
  parallel_for(part_count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part) {
      std::ranges::copy(parts[part].blocks(), &blocks_[first_of[part]]);
      std::ranges::copy(parts[part].ceilings(), &ceilings_[first_of[part]]);
      const std::size_t last = std::min((part + 1) * cells_at_once, filled.size());
      for (std::size_t k = part * cells_at_once; k < last; ++k) {
        std::uint32_t& cell = cells_[filled[k].cell];
        cell = (cell + static_cast<std::uint32_t>(first_of[part])) << 4;
      }
    }
  });
}

// Compilers make vectors of it, not of std::min, which takes references.
std::uint8_t shorter(std::uint8_t a, std::uint8_t b) { return a < b ? a : b; }

// Cells in rows along the longest axis, slices of rows: rows are then long enough to be worked on
// as vectors.
class FacetGrid::EmptyCubes {
 public:
  explicit EmptyCubes(const FacetGrid& grid)
      : grid_(grid),
        along_(static_cast<std::size_t>(std::ranges::max_element(grid.size_) - grid.size_.begin())),
        across_((along_ + 1) % 3),
        over_((along_ + 2) % 3),
        longest_(grid.cells_.size()) {
    for (std::size_t place = 0; place < size(along_); ++place)
      along_row_.push_back(index_of(along_, place));
    for_each([&](std::size_t cell, std::size_t k) {
      longest_[k] = (grid.cells_[cell] & 15U) != 0 ? longest_cube : 0;
    });
    parallel_for(4, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t quarter = begin; quarter < end; ++quarter)
        sweep((quarter & 1U) != 0, (quarter & 2U) != 0);
    });
  }

  /// Calls use(cell, lengths), with a length for each octant, for all without facets.
  template <class Use>
  void for_each_empty(const Use& use) const {
    for_each([&](std::size_t cell, std::size_t k) {
      if (longest_[k] == 0) return;
      std::array<std::uint8_t, octant_count> lengths;
      for (std::size_t octant = 0; octant < octant_count; ++octant)
        lengths[octant] = cubes_[octant][k];
      use(cell, lengths);
    });
  }

 private:
  std::size_t size(std::size_t axis) const { return static_cast<std::size_t>(grid_.size_[axis]); }

  // An axis' part of the index of a cell, which is a sum of three.
  std::size_t index_of(std::size_t axis, std::size_t place) const {
    Index3 r{};
    r[axis] = static_cast<int>(place);
    return static_cast<std::size_t>(grid_.index(r[0], r[1], r[2]));
  }

  // Calls use(cell, its place in rows).
  template <class Use>
  void for_each(const Use& use) const {
    parallel_for(size(over_), 1, [&](std::size_t begin, std::size_t end) {
      std::size_t k = begin * size(across_) * size(along_);
      for (std::size_t slice = begin; slice < end; ++slice) {
        for (std::size_t row = 0; row < size(across_); ++row) {
          const std::size_t first = index_of(over_, slice) + index_of(across_, row);
          for (const std::size_t along : along_row_) use(first + along, k++);
        }
      }
    });
  }

  // Of the two octants that lie so, from their far end backwards: a cube is one longer than the
  // shortest of the seven that begin one further. Outside of the grid it is empty.
  void sweep(bool down_across, bool down_over) {
    const std::size_t row = size(along_);
    const std::size_t first_octant = std::size_t{down_across} << across_ | std::size_t{down_over}
                                                                               << over_;
    std::vector<std::uint8_t>& up = cubes_[first_octant];
    std::vector<std::uint8_t>& down = cubes_[first_octant | std::size_t{1} << along_];
    up.resize(longest_.size());
    down.resize(longest_.size());
    const std::vector<std::uint8_t> outside(row, longest_cube);
    // Of the three rows that are further, with a place more at each end; then of six cells.
    std::vector<std::uint8_t> shortest(row + 2, longest_cube);
    std::vector<std::uint8_t> least_up(row);
    std::vector<std::uint8_t> least_down(row);
    const std::size_t slices = size(over_);
    const std::size_t rows = size(across_);
    for (std::size_t n = 0; n < slices; ++n) {
      for (std::size_t m = 0; m < rows; ++m) {
        // Rows that are further by so many, in steps against the octant.
        const auto begin_of = [&](std::size_t steps_over, std::size_t steps_across) {
          const std::size_t slice = n - steps_over;
          const std::size_t in_slice = m - steps_across;
          return row * ((down_over ? slice : slices - 1 - slice) * rows +
                        (down_across ? in_slice : rows - 1 - in_slice));
        };
        const std::size_t begin = begin_of(0, 0);
        const auto find_least = [&](const std::vector<std::uint8_t>& cubes, bool is_down,
                                    std::vector<std::uint8_t>& least) {
          const auto further = [&](std::size_t steps_over, std::size_t steps_across) {
            const bool is_outside = n < steps_over || m < steps_across;
            return is_outside ? outside.data() : cubes.data() + begin_of(steps_over, steps_across);
          };
          const std::uint8_t* const a = further(0, 1);
          const std::uint8_t* const b = further(1, 0);
          const std::uint8_t* const c = further(1, 1);
          std::uint8_t* const __restrict beside = shortest.data() + 1;
          for (std::size_t x = 0; x < row; ++x) beside[x] = shorter(shorter(a[x], b[x]), c[x]);
          const std::uint8_t* const next = shortest.data() + (is_down ? 0 : 2);
          std::uint8_t* const __restrict to = least.data();
          for (std::size_t x = 0; x < row; ++x) to[x] = shorter(beside[x], next[x]);
        };
        find_least(up, false, least_up);
        find_least(down, true, least_down);
        // Each cube waits for the one before it: of two octants side by side.
        const std::uint8_t* const most = &longest_[begin];
        std::uint8_t* const to_up = &up[begin];
        std::uint8_t* const to_down = &down[begin];
        unsigned cube_up = longest_cube;
        unsigned cube_down = longest_cube;
        for (std::size_t x = 0, y = row; y-- > 0; ++x) {
          cube_up = std::min<unsigned>(std::min<unsigned>(cube_up, least_up[y]) + 1, most[y]);
          cube_down = std::min<unsigned>(std::min<unsigned>(cube_down, least_down[x]) + 1, most[x]);
          to_up[y] = static_cast<std::uint8_t>(cube_up);
          to_down[x] = static_cast<std::uint8_t>(cube_down);
        }
      }
    }
  }

  const FacetGrid& grid_;
  std::size_t along_;
  std::size_t across_;
  std::size_t over_;
  std::vector<std::size_t> along_row_;  // each cell's part of the index
  std::vector<std::uint8_t> longest_;   // 0 where there are facets
  std::array<std::vector<std::uint8_t>, octant_count> cubes_;
};

void FacetGrid::measure_empty_cubes() {
  std::array<std::uint8_t, longest_cube + 1> kinds{};  // the longest that fit
  for (std::size_t length = 1; length < kinds.size(); ++length) {
    kinds[length] = kinds[length - 1];
    if (cube_length(kinds[length] + 1U) == length) ++kinds[length];
  }
  EmptyCubes(*this).for_each_empty([&](std::size_t cell, const auto& lengths) {
    std::uint32_t content = 0;
    for (std::size_t octant = 0; octant < octant_count; ++octant)
      content |= std::uint32_t{kinds[lengths[octant]]} << (4 * octant);
    cells_[cell] = content;
  });
}

}  // namespace scarp

#include "levelset/grid/band.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/vector_kernel.h"
#include "levelset/grid/vdb.h"

namespace scarp {

namespace {

constexpr float half_width = LevelSet::half_width;
constexpr std::size_t grain = 16;

std::array<float, leaf_size> filled(float value) {
  std::array<float, leaf_size> values;
  values.fill(value);
  return values;
}

bool comes_before(const Leaf& a, const Leaf& b) { return a.origin < b.origin; }

}  // namespace

const float* missing_values(int index) {
  static const std::array<float, leaf_size> gas = filled(half_width);
  static const std::array<float, leaf_size> solid = filled(-half_width);
  return index == Band::missing_solid ? solid.data() : gas.data();
}

Band::Band(const Frame& frame) : Band(frame, std::make_shared<VdbGrid>()) {}

Band::Band(const Frame& frame, std::shared_ptr<VdbGrid> grid)
    : frame_(frame), grid_(std::move(grid)) {
  for (int axis = 0; axis < 2; ++axis) {
    SCARP_ASSERT(frame.cells[axis], >, 0);
    const bool periodic = frame.boundary[axis] == Boundary::periodic;
    node_count_[axis] = frame.cells[axis] + (periodic ? 0 : 1);
    column_count_[axis] = (node_count_[axis] + leaf_edge - 1) / leaf_edge;
  }
  leaves_ = grid_->leaves();
  std::sort(leaves_.begin(), leaves_.end(), comes_before);
  link_leaves();
}

Band::~Band() = default;

std::unique_ptr<Band> Band::copy() const { return std::make_unique<Band>(frame_, grid_->copy()); }

/// What find gives in the column c. From the top down: a missing leaf has the sign of the lowest
/// nodes of the next leaf above it.
void Band::fill_column(std::size_t c) {
  int between = missing_gas;
  std::size_t slot = columns_[c + 1].first_slot;
  for (std::size_t n = columns_[c + 1].first_leaf; n-- > columns_[c].first_leaf;) {
    const int height = (leaves_[n].origin[2] >> 3) - columns_[c].lowest;
    while (slot > columns_[c].first_slot + static_cast<std::size_t>(height) + 1) {
      slots_[--slot] = between;
    }
    slots_[--slot] = static_cast<int>(n);
    between = leaves_[n].phi[0] < 0 ? missing_solid : missing_gas;
  }
  below_[c] = between;
}

void Band::link_leaves() {
  const std::size_t column_count = column_index(column_count_[0], 0);
  columns_.assign(column_count + 1, {});
  std::size_t n = 0;
  std::size_t slot = 0;
  for (std::size_t c = 0; c < column_count; ++c) {
    columns_[c] = {.first_leaf = n, .first_slot = slot};
    const std::size_t first = n;
    while (n < leaves_.size() &&
           column_index(leaves_[n].origin[0] / leaf_edge, leaves_[n].origin[1] / leaf_edge) == c) {
      ++n;
    }
    if (n > first) {
      columns_[c].lowest = leaves_[first].origin[2] >> 3;
      slot += static_cast<std::size_t>((leaves_[n - 1].origin[2] >> 3) - columns_[c].lowest + 1);
    }
  }
  columns_.back() = {.first_leaf = n, .first_slot = slot};

  slots_.resize(slot);
  below_.resize(column_count);
  parallel_for(column_count, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      fill_column(c);
    }
  });
  neighbours_.resize(leaves_.size());
  parallel_for(leaves_.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) {
      const auto [i, j, k] = leaves_[m].origin;
      const int x = i / leaf_edge;
      const int y = j / leaf_edge;
      const int z = k >> 3;
      neighbours_[m] = {find(x - 1, y, z), find(x + 1, y, z), find(x, y - 1, z),
                        find(x, y + 1, z), find(x, y, z - 1), find(x, y, z + 1)};
    }
  });
}

void Band::change_leaves(std::span<const NewLeaf> added, std::span<const std::size_t> dropped) {
  if (added.empty() && dropped.empty()) {
    return;
  }
  for (const std::size_t leaf : dropped) {
    grid_->drop_leaf(leaves_[leaf].origin);
    leaves_[leaf].phi = nullptr;
  }
  std::erase_if(leaves_, [](const Leaf& leaf) { return leaf.phi == nullptr; });
  const auto kept = static_cast<std::ptrdiff_t>(leaves_.size());
  for (const NewLeaf& leaf : added) {
    leaves_.push_back(grid_->add_leaf(leaf));
  }
  std::sort(leaves_.begin() + kept, leaves_.end(), comes_before);
  std::inplace_merge(leaves_.begin(), leaves_.begin() + kept, leaves_.end(), comes_before);
  link_leaves();
}

namespace {

/// Brings values into the band, sets what lies outside the domain, and tells which are active.
SCARP_VECTOR_KERNEL bool trim_leaf(Leaf& leaf, const float* values, int i_count, int j_count) {
  bool any = false;
  for (int i = 0; i < leaf_edge; ++i) {
    std::uint64_t word = 0;
    for (int j = 0; j < leaf_edge; ++j) {
      float* row = leaf.phi + leaf_offset(i, j, 0);
      const float* from = values + leaf_offset(i, j, 0);
      if (i >= i_count || j >= j_count) {
        std::fill(row, row + leaf_edge, half_width);
        continue;
      }
      std::uint32_t bits = 0;
      for (int k = 0; k < leaf_edge; ++k) {
        const float phi = std::min(std::max(from[k], -half_width), half_width);
        row[k] = phi;
        bits += std::abs(phi) < half_width ? 1U << k : 0U;
      }
      word |= std::uint64_t{bits} << (leaf_edge * j);
    }
    leaf.active[i] = word;
    any = any || word != 0;
  }
  return any;
}

}  // namespace

/// values(n) are those of leaf n.
template <class Values>
void Band::trim_leaves(const Values& values) {
  std::vector<std::uint8_t> used(leaves_.size());
  parallel_for(leaves_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      Leaf& leaf = leaves_[n];
      used[n] = trim_leaf(leaf, values(n), node_count_[0] - leaf.origin[0],
                          node_count_[1] - leaf.origin[1]);
    }
  });
  std::vector<std::size_t> unused;
  for (std::size_t n = 0; n < used.size(); ++n) {
    if (!used[n]) {
      unused.push_back(n);
    }
  }
  if (unused.empty()) {
    // Values may have been written into new leaves: what lies beyond them may be another side.
    link_leaves();
  }
  change_leaves({}, unused);
}

void Band::trim() {
  trim_leaves([&](std::size_t n) -> const float* { return leaves_[n].phi; });
}

void Band::trim(const LeafValues& phi) {
  trim_leaves([&](std::size_t n) { return phi[n]; });
}

LeafValues& Band::scratch(int which) {
  scratch_[static_cast<std::size_t>(which)].resize(leaves_.size());
  return scratch_[static_cast<std::size_t>(which)];
}

std::size_t Band::memory_bytes() const {
  return grid_->memory_bytes() + leaves_.size() * (sizeof(Leaf) + sizeof(neighbours_[0])) +
         columns_.size() * (sizeof(columns_[0]) + sizeof(below_[0])) +
         slots_.size() * sizeof(slots_[0]);
}

}  // namespace scarp

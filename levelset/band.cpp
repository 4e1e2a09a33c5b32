#include "levelset/band.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/vdb.h"

namespace scarp {

namespace {

constexpr float half_width = LevelSet::half_width;
constexpr std::size_t grain = 16;

std::array<float, leaf_size> filled(float value) {
  std::array<float, leaf_size> values;
  values.fill(value);
  return values;
}

openvdb::Coord coord(const std::array<int, 3>& node) { return {node[0], node[1], node[2]}; }

}  // namespace

const float* missing_values(int index) {
  static const std::array<float, leaf_size> gas = filled(half_width);
  static const std::array<float, leaf_size> solid = filled(-half_width);
  return index == Band::missing_solid ? solid.data() : gas.data();
}

Band::Band(const Frame& frame) : Band(frame, std::make_unique<Storage>()) {}

Band::Band(const Frame& frame, std::unique_ptr<Storage> storage)
    : frame_(frame), storage_(std::move(storage)) {
  for (int axis = 0; axis < 2; ++axis) {
    SCARP_ASSERT(frame.cells[axis], >, 0);
    const bool periodic = frame.boundary[axis] == Boundary::periodic;
    node_count_[axis] = frame.cells[axis] + (periodic ? 0 : 1);
    column_count_[axis] = (node_count_[axis] + leaf_edge - 1) / leaf_edge;
  }
  rebuild_index();
}

Band::~Band() = default;

std::unique_ptr<Band> Band::copy() const {
  return std::make_unique<Band>(frame_, std::make_unique<Storage>(storage_->grid->deepCopy()));
}

int Band::find(int x, int y, int z) const {
  if (x < 0 || y < 0 || x >= column_count_[0] || y >= column_count_[1]) {
    return missing_gas;
  }
  const auto [begin, end] = column(x, y);
  const int height = z * leaf_edge;
  const auto first = leaves_.begin() + static_cast<std::ptrdiff_t>(begin);
  const auto last = leaves_.begin() + static_cast<std::ptrdiff_t>(end);
  const auto found = std::lower_bound(first, last, height,
                                      [](const Leaf& leaf, int k) { return leaf.origin[2] < k; });
  if (found == last) {
    return missing_gas;
  }
  if (found->origin[2] == height) {
    return static_cast<int>(found - leaves_.begin());
  }
  return found->phi[0] < 0 ? missing_solid : missing_gas;
}

float Band::node(int i, int j, int k) const {
  i = fold(0, i);
  j = fold(1, j);
  const int leaf = find(i >> 3, j >> 3, k >> 3);
  const float* values = leaf >= 0 ? leaves_[leaf].phi : missing_values(leaf);
  return values[leaf_offset(i, j, k)];
}

void Band::rebuild_index() {
  leaves_.clear();
  for (auto leaf = storage_->grid->tree().beginLeaf(); leaf; ++leaf) {
    const openvdb::Coord origin = leaf->origin();
    leaves_.push_back({.origin = {origin.x(), origin.y(), origin.z()},
                       .phi = leaf->buffer().data(),
                       .active = &leaf->getValueMask().getWord<std::uint64_t>(0)});
  }
  std::sort(leaves_.begin(), leaves_.end(),
            [](const Leaf& a, const Leaf& b) { return a.origin < b.origin; });

  columns_.assign(static_cast<std::size_t>(column_count_[0]) * column_count_[1] + 1, 0);
  for (const Leaf& leaf : leaves_) {
    ++columns_[static_cast<std::size_t>(leaf.origin[0] / leaf_edge) * column_count_[1] +
               leaf.origin[1] / leaf_edge + 1];
  }
  for (std::size_t c = 1; c < columns_.size(); ++c) {
    columns_[c] += columns_[c - 1];
  }

  neighbours_.resize(leaves_.size());
  parallel_for(leaves_.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const auto [i, j, k] = leaves_[n].origin;
      const int x = i / leaf_edge;
      const int y = j / leaf_edge;
      const int z = k >> 3;
      neighbours_[n] = {find(x - 1, y, z), find(x + 1, y, z), find(x, y - 1, z),
                        find(x, y + 1, z), find(x, y, z - 1), find(x, y, z + 1)};
    }
  });
}

void Band::change_leaves(std::span<const NewLeaf> added, std::span<const std::size_t> dropped) {
  if (added.empty() && dropped.empty()) {
    return;
  }
  PhiTree& tree = storage_->grid->tree();
  for (const std::size_t leaf : dropped) {
    tree.addTile(1, coord(leaves_[leaf].origin), half_width, false);
  }
  for (const NewLeaf& leaf : added) {
    tree.touchLeaf(coord(leaf.origin))->fill(leaf.solid ? -half_width : half_width, false);
  }
  rebuild_index();
}

namespace {

/// Makes values, mask and domain of one leaf agree; tells whether anything is active.
bool trim_leaf(const Leaf& leaf, int i_count, int j_count) {
  bool any = false;
  for (int i = 0; i < leaf_edge; ++i) {
    std::uint64_t word = 0;
    for (int jk = 0; jk < leaf_edge * leaf_edge; ++jk) {
      float& phi = leaf.phi[i * 64 + jk];
      const bool inside = i < i_count && (jk >> 3) < j_count;
      phi = inside ? std::clamp(phi, -half_width, half_width) : half_width;
      word |= std::uint64_t{std::abs(phi) < half_width} << jk;
    }
    leaf.active[i] = word;
    any = any || word != 0;
  }
  return any;
}

}  // namespace

void Band::trim() {
  std::vector<std::uint8_t> used(leaves_.size());
  parallel_for(leaves_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const Leaf& leaf = leaves_[n];
      used[n] = trim_leaf(leaf, node_count_[0] - leaf.origin[0], node_count_[1] - leaf.origin[1]);
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
    rebuild_index();
  }
  change_leaves({}, unused);
}

std::size_t Band::memory_bytes() const {
  return storage_->grid->memUsage() + leaves_.size() * (sizeof(Leaf) + sizeof(neighbours_[0])) +
         columns_.size() * sizeof(columns_[0]);
}

}  // namespace scarp

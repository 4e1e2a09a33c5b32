#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/frame.h"
#include "core/vector_kernel.h"
#include "levelset/grid/level_set.h"

namespace scarp {

class VdbGrid;

inline constexpr int leaf_edge = 8;
inline constexpr int leaf_size = leaf_edge * leaf_edge * leaf_edge;

/// No node lies exactly on the surface: what comes nearer than this, in spacings, is moved off it.
inline constexpr float smallest_phi = 1e-6F;

/// phi, or that of a node moved off the surface to the side it is on.
SCARP_KERNEL_PART float off_surface(float phi, float smallest = smallest_phi) {
  const float nudged = std::copysign(smallest, phi);
  return std::abs(phi) < smallest ? nudged : phi;
}

/// Offset of a node in its leaf; z runs fastest, as in OpenVDB.
inline constexpr int leaf_offset(int i, int j, int k) {
  return ((i & 7) << 6) | ((j & 7) << 3) | (k & 7);
}

/// Nodes of a leaf: a word per i, bit 8 j + k of it.
using LeafMask = std::array<std::uint64_t, leaf_edge>;

/// Indices of a node along x, y and z.
using Node = std::array<int, 3>;

struct Leaf;

/// A pointer that is as constant as what it is a member of: who only reads a band cannot write to
/// its nodes.
template <class T>
class MemberPointer {
 public:
  MemberPointer(T* at = nullptr) : at_(at) {}  // NOLINT(google-explicit-constructor)
  MemberPointer& operator=(T* at) {
    at_ = at;
    return *this;
  }
  operator T*() { return at_; }              // NOLINT(google-explicit-constructor)
  operator const T*() const { return at_; }  // NOLINT(google-explicit-constructor)

 private:
  // Copies are those of a leaf: one alone would no longer be constant.
  friend struct Leaf;
  MemberPointer(const MemberPointer&) = default;
  MemberPointer& operator=(const MemberPointer&) = default;

  T* at_;
};

/// One 8x8x8 block of nodes; values and mask live in OpenVDB.
struct Leaf {
  Node origin{};  ///< the lowest one
  MemberPointer<float> phi{};
  MemberPointer<std::uint64_t> active{};  ///< one bit per node, a word per i
};

/// The node at an offset of a leaf.
inline Node node_at(const Leaf& leaf, int offset) {
  return {leaf.origin[0] + (offset >> 6), leaf.origin[1] + ((offset >> 3) & 7),
          leaf.origin[2] + (offset & 7)};
}

/// Where a node is stored.
struct NodePlace {
  int leaf = 0;  ///< as Band::find gives it
  int offset = 0;

  bool is_there() const { return leaf >= 0; }
  /// In arrays of leaf_size values per leaf, where it is there.
  std::size_t index() const {
    return static_cast<std::size_t>(leaf) * leaf_size + static_cast<std::size_t>(offset);
  }
};

/// A leaf that is to be made, filled with +-half_width.
struct NewLeaf {
  std::array<int, 3> origin{};
  bool solid = false;

  friend bool operator==(const NewLeaf&, const NewLeaf&) = default;
  friend bool operator<(const NewLeaf& a, const NewLeaf& b) { return a.origin < b.origin; }
};

/// The values of every leaf in one array, beside those in the tree. Not initialised.
class LeafValues {
 public:
  LeafValues() = default;
  explicit LeafValues(std::size_t leaf_count) { resize(leaf_count); }

  /// Values are lost. Memory is kept, and some more taken than is needed: bands grow slowly.
  void resize(std::size_t leaf_count) {
    if (leaf_count <= capacity_) return;
    capacity_ = leaf_count + leaf_count / 8;
    values_ = std::make_unique_for_overwrite<float[]>(capacity_ * leaf_size);
  }

  float* operator[](std::size_t leaf) { return values_.get() + leaf * leaf_size; }
  const float* operator[](std::size_t leaf) const { return values_.get() + leaf * leaf_size; }

 private:
  std::unique_ptr<float[]> values_;
  std::size_t capacity_ = 0;
};

/// 512 times +half_width or -half_width, for what is read in a missing leaf.
const float* missing_values(int index);

/// The leaves of a narrow band in a fixed order, over an OpenVDB tree that no header shows.
///
/// Missing leaves lie wholly in the solid or wholly in the gas. Which of the two needs no storage:
/// the band is wide enough that a missing leaf has the sign of the lowest nodes of the next leaf
/// above it, and lies in the gas if there is none.
class Band {
 public:
  static constexpr int missing_gas = -1;
  static constexpr int missing_solid = -2;

  explicit Band(const Frame& frame);
  Band(const Frame& frame, std::shared_ptr<VdbGrid> grid);
  ~Band();
  Band(const Band&) = delete;
  Band& operator=(const Band&) = delete;

  std::unique_ptr<Band> copy() const;

  const Frame& frame() const { return frame_; }

  /// Ordered by column (x, then y), then upwards.
  std::span<const Leaf> leaves() const { return leaves_; }
  std::span<Leaf> leaves() { return leaves_; }

  /// Nodes that are stored along a lateral axis: one less than 0..cells if it is periodic.
  int node_count(int axis) const { return node_count_[axis]; }

  /// Leaf columns along a lateral axis.
  int column_count(int axis) const { return column_count_[axis]; }

  /// Range of the leaves of a column.
  std::array<std::size_t, 2> column(int x, int y) const {
    const std::size_t c = column_index(x, y);
    return {columns_[c].first_leaf, columns_[c + 1].first_leaf};
  }

  /// The stored node that a lateral index stands for: mirrored or wrapped at the sides.
  int fold(int axis, int index) const {
    if (index >= 0 && index < node_count_[axis]) {
      return index;
    }
    const int cells = frame_.cells[axis];
    if (frame_.boundary[axis] == Boundary::periodic) {
      const int wrapped = index % cells;
      return wrapped < 0 ? wrapped + cells : wrapped;
    }
    const int period = 2 * cells;
    int wrapped = index % period;
    wrapped = wrapped < 0 ? wrapped + period : wrapped;
    return wrapped > cells ? period - wrapped : wrapped;
  }

  /// Leaf that holds the stored nodes from 8 (x, y, z); or missing_gas or missing_solid.
  int find(int x, int y, int z) const {
    if (x < 0 || y < 0 || x >= column_count_[0] || y >= column_count_[1]) {
      return missing_gas;
    }
    const std::size_t c = column_index(x, y);
    const Column& column = columns_[c];
    const std::size_t count = columns_[c + 1].first_slot - column.first_slot;
    if (z < column.lowest) {
      return count == 0 ? missing_gas : below_[c];
    }
    const auto height = static_cast<std::size_t>(z - column.lowest);
    return height < count ? slots_[column.first_slot + height] : missing_gas;
  }

  /// Leaves across the six faces (-x, +x, -y, +y, -z, +z) as find gives them, without mirror or
  /// wrap: beyond the stored nodes missing_gas.
  const std::array<int, 6>& neighbours(std::size_t leaf) const { return neighbours_[leaf]; }

  /// Where a node is stored; lateral indices are folded.
  NodePlace place(const Node& node) const {
    const int i = fold(0, node[0]);
    const int j = fold(1, node[1]);
    return {find(i >> 3, j >> 3, node[2] >> 3), leaf_offset(i, j, node[2])};
  }

  /// phi at a node; lateral indices are folded.
  float node(int i, int j, int k) const {
    const NodePlace at = place({i, j, k});
    if (at.leaf < 0) {
      return at.leaf == missing_solid ? -LevelSet::half_width : LevelSet::half_width;
    }
    return leaves_[static_cast<std::size_t>(at.leaf)].phi[at.offset];
  }

  /// Makes leaves that are missing and drops leaves that exist. Pointers into leaves() change.
  void change_leaves(std::span<const NewLeaf> added, std::span<const std::size_t> dropped);

  /// Sets inactive what is not in the band or not in the domain, so that |phi| < half_width and
  /// the mask agree. Drops leaves without active nodes.
  void trim();

  /// The same after taking over phi of all nodes in the domain.
  void trim(const LeafValues& phi);

  /// Room for values of all leaves beside phi in the tree, for one stage of a time step after the
  /// other; memory is kept, what is in it is not part of the band, nor copied with it. There are
  /// two.
  LeafValues& scratch(int which);
  void release_scratch() { scratch_ = {}; }

  /// Of the state: without scratch.
  std::size_t memory_bytes() const;

  /// Where the leaves live.
  const std::shared_ptr<VdbGrid>& grid() const { return grid_; }

 private:
  /// Where the leaves of a column, and its places, begin. A place for every leaf between the lowest
  /// and the highest one of the column.
  struct Column {
    std::size_t first_leaf = 0;
    std::size_t first_slot = 0;
    int lowest = 0;
  };

  std::size_t column_index(int x, int y) const {
    return static_cast<std::size_t>(x) * column_count_[1] + y;
  }
  template <class Values>
  void trim_leaves(const Values& values);
  void link_leaves();
  void fill_column(std::size_t c);

  Frame frame_;
  std::array<int, 2> node_count_{};
  std::array<int, 2> column_count_{};
  std::shared_ptr<VdbGrid> grid_;
  std::vector<Leaf> leaves_;
  std::vector<Column> columns_;  ///< one more than there are columns
  std::vector<int> slots_;       ///< what find gives within a column
  std::vector<int> below_;       ///< and below its lowest leaf
  std::vector<std::array<int, 6>> neighbours_;
  std::array<LeafValues, 2> scratch_;
};

/// One of the values of all leaves, as Band::node gives phi.
inline float value_at(const Band& band, const LeafValues& values, const Node& node) {
  const NodePlace at = band.place(node);
  const float* of_leaf =
      at.is_there() ? values[static_cast<std::size_t>(at.leaf)] : missing_values(at.leaf);
  return of_leaf[at.offset];
}

}  // namespace scarp

#pragma once

// Facets of a mesh that pass through each other, found independently of mesh/.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/tri_mesh.h"

namespace scarp {

namespace self_intersections_detail {

/// Sign of the volume that three vectors span; 0 where rounding could have made it.
inline int orientation(Vec3d a, Vec3d b, Vec3d c) {
  const double volume = dot(a, cross(b, c));
  const double scale = std::sqrt(dot(a, a) * dot(b, b) * dot(c, c));
  return std::abs(volume) <= 1e-14 * scale ? 0 : volume > 0 ? 1 : -1;
}

/// Whether the line through p and q passes through the inside of a triangle.
inline bool passes_through(Vec3d p, Vec3d q, const std::array<Vec3d, 3>& t) {
  const std::array<Vec3d, 3> d{t[0] - p, t[1] - p, t[2] - p};
  const int side = orientation(q - p, d[0], d[1]);
  return side != 0 && side == orientation(q - p, d[1], d[2]) &&
         side == orientation(q - p, d[2], d[0]);
}

/// Whether an edge of facet f passes through facet g; edges that share a vertex with it do not.
inline bool edge_pierces(const TriMesh& mesh, std::uint32_t f, std::uint32_t g) {
  const Triangle& b = mesh.triangles[g];
  const std::array<Vec3d, 3> p = corners(mesh, f);
  const std::array<Vec3d, 3> t = corners(mesh, g);
  std::array<int, 3> side;  // of the plane of g; 0 on it
  for (int i = 0; i < 3; ++i) {
    const bool shared = std::find(b.begin(), b.end(), mesh.triangles[f][i]) != b.end();
    side[i] = shared ? 0 : orientation(p[i] - t[0], t[1] - t[0], t[2] - t[0]);
  }
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    if (side[i] * side[j] < 0 && passes_through(p[i], p[j], t)) return true;
  }
  return false;
}

/// Halves the facets by their middles until few are left, and compares the halves whose boxes meet.
class PairSearch {
 public:
  explicit PairSearch(const TriMesh& mesh) : mesh_(mesh), boxes_(mesh.triangles.size()) {
    order_.resize(boxes_.size());
    for (std::uint32_t f = 0; f < order_.size(); ++f) {
      order_[f] = f;
      for (const Vec3d r : corners(mesh, f)) boxes_[f].add(r);
    }
  }

  std::size_t count() { return order_.empty() ? 0 : within(build(0, order_.size())); }

 private:
  static constexpr std::size_t leaf_size = 8;

  struct Node {
    Box box;
    std::size_t first = 0;
    std::size_t last = 0;
    std::array<std::size_t, 2> child{};  ///< both 0 in a leaf
  };

  static bool meet(const Box& a, const Box& b) {
    for (int axis = 0; axis < 3; ++axis) {
      if (a.upper[axis] < b.lower[axis] || b.upper[axis] < a.lower[axis]) return false;
    }
    return true;
  }

  std::size_t build(std::size_t first, std::size_t last) {
    Node node{.box = {}, .first = first, .last = last};
    for (std::size_t i = first; i < last; ++i) {
      node.box.add(boxes_[order_[i]].lower);
      node.box.add(boxes_[order_[i]].upper);
    }
    const std::size_t index = nodes_.size();
    nodes_.push_back(node);
    if (last - first <= leaf_size) return index;
    const Vec3d size = node.box.upper - node.box.lower;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = (first + last) / 2;
    const auto at = [this](std::size_t i) {
      return order_.begin() + static_cast<std::ptrdiff_t>(i);
    };
    std::nth_element(at(first), at(middle), at(last), [&](std::uint32_t f, std::uint32_t g) {
      return boxes_[f].lower[axis] + boxes_[f].upper[axis] <
             boxes_[g].lower[axis] + boxes_[g].upper[axis];
    });
    const std::size_t left = build(first, middle);
    const std::size_t right = build(middle, last);
    nodes_[index].child = {left, right};
    return index;
  }

  bool is_leaf(std::size_t n) const { return nodes_[n].child[0] == 0; }

  std::size_t within(std::size_t n) const {
    const Node& node = nodes_[n];
    if (!is_leaf(n)) {
      return within(node.child[0]) + within(node.child[1]) + between(node.child[0], node.child[1]);
    }
    std::size_t count = 0;
    for (std::size_t i = node.first; i < node.last; ++i) {
      for (std::size_t j = node.first; j < i; ++j) count += cross_each_other(order_[i], order_[j]);
    }
    return count;
  }

  std::size_t between(std::size_t n, std::size_t m) const {
    if (!meet(nodes_[n].box, nodes_[m].box)) return 0;
    if (is_leaf(n) && is_leaf(m)) {
      std::size_t count = 0;
      for (std::size_t i = nodes_[n].first; i < nodes_[n].last; ++i) {
        for (std::size_t j = nodes_[m].first; j < nodes_[m].last; ++j) {
          count += cross_each_other(order_[i], order_[j]);
        }
      }
      return count;
    }
    const bool split_m = is_leaf(n) || (!is_leaf(m) && nodes_[m].last - nodes_[m].first >
                                                           nodes_[n].last - nodes_[n].first);
    if (!split_m) std::swap(n, m);
    return between(n, nodes_[m].child[0]) + between(n, nodes_[m].child[1]);
  }

  std::size_t cross_each_other(std::uint32_t f, std::uint32_t g) const {
    return meet(boxes_[f], boxes_[g]) && (edge_pierces(mesh_, f, g) || edge_pierces(mesh_, g, f))
               ? 1
               : 0;
  }

  const TriMesh& mesh_;
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace self_intersections_detail

/// How many pairs of facets pass through each other. Those that only touch do not count, nor do
/// neighbours folded onto each other (they are flipped).
///
/// Cost: about 1.5 us per facet.
inline std::size_t self_intersections(const TriMesh& mesh) {
  return self_intersections_detail::PairSearch(mesh).count();
}

}  // namespace scarp

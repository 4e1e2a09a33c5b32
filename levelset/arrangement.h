#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "levelset/polygon.h"

namespace scarp {

/// Closed polygons of two groups drawn over each other, and regions chosen by how often each group
/// surrounds a point.
///
/// Points are rounded to whole units and all decisions are taken in integers. A crossing is rounded
/// as well; that may move an edge over a point by less than a unit, so edges are split again until
/// none cross.
class Arrangement {
 public:
  explicit Arrangement(double unit) : unit_(unit) {}

  /// Draws a loop; group is 0 or 1.
  void add(const Loop& loop, int group);

  /// The boundary of all places where inside(turns of group 0, turns of group 1) holds, interior on
  /// the left. Loops touch at points at most; points in the middle of straight edges are left out.
  std::vector<Loop> region(const std::function<bool(int, int)>& inside);

 private:
  struct Node {
    std::int64_t x = 0;
    std::int64_t y = 0;
    friend bool operator==(const Node&, const Node&) = default;
  };
  /// From the lower to the upper end, or to the right; turns count how often it is passed that way.
  struct Edge {
    Node a;
    Node b;
    std::array<int, 2> turns{};
  };
  struct Split;
  class Sweep;

  void merge_equal_edges();
  std::vector<std::vector<Node>> split_points() const;
  bool split_edges();
  std::vector<Edge> boundary(const std::function<bool(int, int)>& inside) const;
  std::vector<Loop> linked(const std::vector<Edge>& directed) const;
  static int turn(Node o, Node p, Node q);

  double unit_;
  std::vector<Edge> edges_;
};

}  // namespace scarp

#include "core/triangle_tree.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace scarp {

namespace {

constexpr std::uint32_t leaf_size = 4;
constexpr int bin_count = 12;

/// Larger nodes are cut in the middle: where exactly does not matter for them, and to look for the
/// best place takes longest there.
constexpr std::uint32_t large_node = 4096;

/// Below this depth nodes are halved by count, which bounds the depth of the tree.
constexpr int max_heuristic_depth = 48;
constexpr int max_stack = 96;

struct FloatBox {
  Vec3f lower{3e38F, 3e38F, 3e38F};
  Vec3f upper{-3e38F, -3e38F, -3e38F};

  void add(Vec3f r) {
    lower = {std::min(lower.x, r.x), std::min(lower.y, r.y), std::min(lower.z, r.z)};
    upper = {std::max(upper.x, r.x), std::max(upper.y, r.y), std::max(upper.z, r.z)};
  }
  void add(const FloatBox& box) {
    add(box.lower);
    add(box.upper);
  }
  float half_area() const {
    const Vec3f d = upper - lower;
    return d.x * d.y + d.y * d.z + d.z * d.x;
  }
};

/// Square of the distance from r to a box, 0 inside.
inline double squared_distance(Vec3d r, Vec3f lower, Vec3f upper) {
  const double dx = std::max(std::max(lower.x - r.x, r.x - upper.x), 0.0);
  const double dy = std::max(std::max(lower.y - r.y, r.y - upper.y), 0.0);
  const double dz = std::max(std::max(lower.z - r.z, r.z - upper.z), 0.0);
  return dx * dx + dy * dy + dz * dz;
}

using Weights = std::array<double, 3>;

Vec3d weighted(const std::array<Vec3d, 3>& p, const Weights& w) {
  return w[0] * p[0] + w[1] * p[1] + w[2] * p[2];
}

/// Weights of the closest point of a triangle without area: the best point of its three edges.
Weights closest_on_edges(Vec3d r, const std::array<Vec3d, 3>& p) {
  Weights best{1, 0, 0};
  double best_square = dot(r - p[0], r - p[0]);
  for (int edge = 0; edge < 3; ++edge) {
    const int a = edge;
    const int b = (edge + 1) % 3;
    const Vec3d along = p[b] - p[a];
    const double square = dot(along, along);
    const double t = square > 0 ? std::clamp(dot(r - p[a], along) / square, 0.0, 1.0) : 0.0;
    Weights w{};
    w[a] = 1 - t;
    w[b] = t;
    const Vec3d gap = r - weighted(p, w);
    if (dot(gap, gap) < best_square) {
      best_square = dot(gap, gap);
      best = w;
    }
  }
  return best;
}

/// Weights of the closest point, by the region (corner, edge, inside) that r projects to.
/// Source: Ericson 2005, Real-Time Collision Detection, 5.1.5.
Weights closest_weights(Vec3d r, const std::array<Vec3d, 3>& p) {
  const Vec3d ab = p[1] - p[0];
  const Vec3d ac = p[2] - p[0];
  const Vec3d ap = r - p[0];
  const double d1 = dot(ab, ap);
  const double d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};

  const Vec3d bp = r - p[1];
  const double d3 = dot(ab, bp);
  const double d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};

  const Vec3d cp = r - p[2];
  const double d5 = dot(ab, cp);
  const double d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};

  const double vc = d1 * d4 - d3 * d2;
  const double vb = d5 * d2 - d1 * d6;
  const double va = d3 * d6 - d5 * d4;
  const double sum = va + vb + vc;
  if (!(sum > 0)) return closest_on_edges(r, p);
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = d1 / (d1 - d3);
    return {1 - t, t, 0};
  }
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = d2 / (d2 - d6);
    return {1 - t, 0, t};
  }
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double v = vb / sum;
  const double w = vc / sum;
  return {1 - v - w, v, w};
}

std::array<Vec3d, 3> in_double(const std::array<Vec3f, 3>& p) {
  return {Vec3d(p[0]), Vec3d(p[1]), Vec3d(p[2])};
}

}  // namespace

const TriangleTree::Start TriangleTree::root{.nodes = {0}, .count = 1};

ClosestPoint closest_on_triangle(Vec3d r, const std::array<Vec3d, 3>& corners) {
  ClosestPoint result;
  result.barycentric = closest_weights(r, corners);
  result.point = weighted(corners, result.barycentric);
  result.distance = length(r - result.point);
  return result;
}

/// Splits along the longest axis: large nodes in the middle, others where a binned surface area
/// heuristic of the centroids says.
struct TriangleTree::Builder {
  struct Item {
    FloatBox box;
    std::uint32_t id;

    float centroid(int axis) const { return 0.5F * (box.lower[axis] + box.upper[axis]); }
    Vec3f centroid() const { return 0.5F * (box.lower + box.upper); }
  };

  const TriMesh& mesh;
  std::vector<Node>& nodes;
  std::vector<Item> items;

  Builder(const TriMesh& mesh_in, std::vector<Node>& nodes_out) : mesh(mesh_in), nodes(nodes_out) {
    items.resize(mesh.triangles.size());
    FloatBox all;
    for (std::uint32_t f = 0; f < items.size(); ++f) {
      for (const std::uint32_t v : mesh.triangles[f]) items[f].box.add(mesh.vertices[v]);
      items[f].id = f;
      all.add(items[f].centroid());
    }
    // Leaves are nearly full: half as many nodes as triangles and a few more. To grow would copy
    // them.
    nodes.reserve(items.size() * 5 / 8 + 1);
    nodes.resize(1);
    split_large(0, 0, static_cast<std::uint32_t>(items.size()), 0, all);
  }

  /// region holds the centroids. One pass over the items per level; boxes come from the children.
  void split_large(std::uint32_t node, std::uint32_t begin, std::uint32_t end, int depth,
                   const FloatBox& region) {
    if (end - begin <= large_node || depth >= max_heuristic_depth / 2) {
      split(node, begin, end, depth);
      return;
    }
    const int axis = longest_axis(region);
    FloatBox lower = region;
    FloatBox upper = region;
    lower.upper[axis] = upper.lower[axis] = 0.5F * (region.lower[axis] + region.upper[axis]);
    const auto cut =
        std::partition(items.begin() + begin, items.begin() + end,
                       [&](const Item& item) { return item.centroid(axis) < upper.lower[axis]; });
    const auto middle = static_cast<std::uint32_t>(cut - items.begin());
    if (middle == begin || middle == end) {
      split_large(node, begin, end, depth + 1, middle == begin ? upper : lower);
      return;
    }
    const std::uint32_t first = add_children(node);
    split_large(first, begin, middle, depth + 1, lower);
    split_large(first + 1, middle, end, depth + 1, upper);
    FloatBox box{nodes[first].lower, nodes[first].upper};
    box.add({nodes[first + 1].lower, nodes[first + 1].upper});
    nodes[node].lower = box.lower;
    nodes[node].upper = box.upper;
  }

  std::uint32_t add_children(std::uint32_t node) {
    const auto first = static_cast<std::uint32_t>(nodes.size());
    nodes.resize(nodes.size() + 2);
    nodes[node].first = first;
    nodes[node].count = 0;
    return first;
  }

  static int longest_axis(const FloatBox& box) {
    const Vec3f extent = box.upper - box.lower;
    return extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
  }

  void split(std::uint32_t node, std::uint32_t begin, std::uint32_t end, int depth) {
    FloatBox box;
    FloatBox centroids;
    for (std::uint32_t i = begin; i < end; ++i) {
      box.add(items[i].box);
      centroids.add(items[i].centroid());
    }
    nodes[node] = {box.lower, begin, box.upper, end - begin};
    if (end - begin <= leaf_size) return;

    const int axis = longest_axis(centroids);
    const float extent = centroids.upper[axis] - centroids.lower[axis];
    std::uint32_t middle = begin;
    if (depth < max_heuristic_depth && extent > 0) {
      middle = heuristic_split(begin, end, axis, centroids.lower[axis], extent);
    }
    if (middle == begin || middle == end) middle = median_split(begin, end, axis);

    const std::uint32_t first = add_children(node);
    split(first, begin, middle, depth + 1);
    split(first + 1, middle, end, depth + 1);
  }

  std::uint32_t median_split(std::uint32_t begin, std::uint32_t end, int axis) {
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(items.begin() + begin, items.begin() + middle, items.begin() + end,
                     [axis](const Item& a, const Item& b) {
                       const float ca = a.centroid(axis);
                       const float cb = b.centroid(axis);
                       return ca != cb ? ca < cb : a.id < b.id;
                     });
    return middle;
  }

  std::uint32_t heuristic_split(std::uint32_t begin, std::uint32_t end, int axis, float lower,
                                float extent) {
    const float scale = bin_count / extent;
    const auto bin_of = [&](const Item& item) {
      return std::min(bin_count - 1, static_cast<int>((item.centroid(axis) - lower) * scale));
    };
    std::array<FloatBox, bin_count> boxes;
    std::array<std::uint32_t, bin_count> counts{};
    for (std::uint32_t i = begin; i < end; ++i) {
      const int bin = bin_of(items[i]);
      boxes[bin].add(items[i].box);
      ++counts[bin];
    }
    const int best = best_bin(boxes, counts);
    const auto middle = std::partition(items.begin() + begin, items.begin() + end,
                                       [&](const Item& item) { return bin_of(item) < best; });
    return static_cast<std::uint32_t>(middle - items.begin());
  }

  /// The first bin of the upper half at the lowest sum of area times count; 0 if there is none.
  static int best_bin(const std::array<FloatBox, bin_count>& boxes,
                      const std::array<std::uint32_t, bin_count>& counts) {
    std::array<float, bin_count> upper_cost{};
    FloatBox box;
    std::uint32_t count = 0;
    for (int bin = bin_count - 1; bin > 0; --bin) {
      if (counts[bin] > 0) box.add(boxes[bin]);
      count += counts[bin];
      upper_cost[bin] = count > 0 ? box.half_area() * static_cast<float>(count) : 3e38F;
    }
    int best = 0;
    float best_cost = 3e38F;
    box = {};
    count = 0;
    for (int bin = 1; bin < bin_count; ++bin) {
      if (counts[bin - 1] > 0) box.add(boxes[bin - 1]);
      count += counts[bin - 1];
      if (count == 0) continue;
      const float cost = box.half_area() * static_cast<float>(count) + upper_cost[bin];
      if (cost < best_cost) {
        best_cost = cost;
        best = bin;
      }
    }
    return best;
  }
};

TriangleTree::TriangleTree(const TriMesh& mesh) {
  if (mesh.triangles.empty()) return;
  const Builder builder(mesh, nodes_);
  triangles_.reserve(builder.items.size());
  for (const Builder::Item& item : builder.items) {
    const Triangle& t = mesh.triangles[item.id];
    triangles_.push_back(
        {{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]}, item.id});
  }
}

TriangleTree::Start TriangleTree::start(const Box& box, double max_distance) const {
  // A little more than asked for, so that rounding does not hide a triangle at that distance.
  const double reach = max_distance * (1 + 1e-9);
  const auto is_near = [&](std::uint32_t n) {
    for (int axis = 0; axis < 3; ++axis) {
      if (nodes_[n].lower[axis] > box.upper[axis] + reach ||
          nodes_[n].upper[axis] < box.lower[axis] - reach) {
        return false;
      }
    }
    return true;
  };
  Start found;
  if (nodes_.empty()) return found;
  found.count = 1;
  // Nodes become their children, those far away left out, as long as there is room for both.
  for (std::size_t n = 0; n < found.count;) {
    const Node& node = nodes_[found.nodes[n]];
    if (node.count > 0 || found.count == found.nodes.size()) {
      ++n;
      continue;
    }
    found.nodes[n] = found.nodes[--found.count];
    for (const std::uint32_t child : {node.first, node.first + 1}) {
      if (is_near(child)) found.nodes[found.count++] = child;
    }
  }
  return found;
}

namespace {

// All triangles; of those as near the lowest.
struct AnyTriangle {
  static constexpr double rounding = 0;
  static constexpr bool is_first_enough = false;
  bool accepts(const std::array<Vec3d, 3>&) const { return true; }
  bool prefers(const std::array<Vec3d, 3>&, const std::array<Vec3d, 3>&, bool is_lower) const {
    return is_lower;
  }
};

// The first that is found.
struct FirstTriangle : AnyTriangle {
  static constexpr bool is_first_enough = true;
};

struct TriangleFacing {
  static constexpr bool is_first_enough = false;
  static constexpr double rounding = 1e-14;  // of a place, relative to it
  Vec3d direction;

  static Vec3d normal(const std::array<Vec3d, 3>& p) { return cross(p[1] - p[0], p[2] - p[0]); }
  bool accepts(const std::array<Vec3d, 3>& p) const { return dot(normal(p), direction) > 0; }
  bool prefers(const std::array<Vec3d, 3>& p, const std::array<Vec3d, 3>& other,
               bool is_lower) const {
    const double along = dot(normalized(normal(p)), direction);
    const double along_other = dot(normalized(normal(other)), direction);
    return along != along_other ? along > along_other : is_lower;
  }
};

}  // namespace

template <class Choice>
ClosestPoint TriangleTree::search(Vec3d r, double max_distance, const Start& from,
                                  const Choice& choice) const {
  ClosestPoint best;
  if (nodes_.empty()) return best;

  struct Entry {
    double square;
    std::uint32_t node;
  };
  std::array<Entry, max_stack> stack;
  int depth = 0;
  // A little slack, so that rounding of a box distance never hides a triangle at the same distance.
  constexpr double slack = 1 + 1e-12;
  const double rounding = Choice::rounding * (std::abs(r.x) + std::abs(r.y) + std::abs(r.z));
  double best_square = max_distance * max_distance;
  double as_near = 0;  // what squares may differ by
  double bound = best_square * slack;
  Weights best_weights{};
  std::uint32_t best_slot = 0;

  // The nearest last: it is looked at first.
  for (std::size_t n = 0; n < from.count; ++n) {
    const Node& node = nodes_[from.nodes[n]];
    const Entry entry{squared_distance(r, node.lower, node.upper), from.nodes[n]};
    if (entry.square > bound) continue;
    int place = depth++;
    for (; place > 0 && stack[place - 1].square < entry.square; --place) {
      stack[place] = stack[place - 1];
    }
    stack[place] = entry;
  }
  while (depth > 0) {
    const Entry entry = stack[--depth];
    if (entry.square > bound) continue;
    const Node& node = nodes_[entry.node];
    if (node.count == 0) {
      const std::uint32_t child = node.first;
      const Entry a{squared_distance(r, nodes_[child].lower, nodes_[child].upper), child};
      const Entry b{squared_distance(r, nodes_[child + 1].lower, nodes_[child + 1].upper),
                    child + 1};
      const Entry& nearer = a.square <= b.square ? a : b;
      const Entry& further = a.square <= b.square ? b : a;
      if (further.square <= bound) stack[depth++] = further;
      if (nearer.square <= bound) stack[depth++] = nearer;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const LeafTriangle& triangle = triangles_[i];
      const std::array<Vec3d, 3> p = in_double(triangle.corners);
      if (!choice.accepts(p)) continue;
      const Weights w = closest_weights(r, p);
      const Vec3d gap = r - weighted(p, w);
      const double square = dot(gap, gap);
      if (square > best_square + as_near) continue;
      const bool is_nearer = square < best_square - as_near;
      if (!is_nearer && best.found() &&
          !choice.prefers(p, in_double(triangles_[best_slot].corners), triangle.id < best.triangle))
        continue;
      best_square = std::min(best_square, square);
      as_near = rounding * (2 * std::sqrt(best_square) + rounding);
      bound = best_square * slack + as_near;
      best_weights = w;
      best_slot = i;
      best.triangle = triangle.id;
      if constexpr (Choice::is_first_enough) return best;
    }
  }
  if (!best.found()) return best;
  best.barycentric = best_weights;
  best.point = weighted(in_double(triangles_[best_slot].corners), best_weights);
  best.distance = std::sqrt(best_square);
  return best;
}

ClosestPoint TriangleTree::closest(Vec3d r, double max_distance) const {
  return closest(r, max_distance, root);
}

ClosestPoint TriangleTree::closest(Vec3d r, double max_distance, const Start& from) const {
  return search(r, max_distance, from, AnyTriangle{});
}

bool TriangleTree::is_within(Vec3d r, double max_distance) const {
  return search(r, max_distance, root, FirstTriangle{}).found();
}

ClosestPoint TriangleTree::closest_facing(Vec3d r, Vec3d direction, double max_distance) const {
  return closest_facing(r, direction, max_distance, root);
}

ClosestPoint TriangleTree::closest_facing(Vec3d r, Vec3d direction, double max_distance,
                                          const Start& from) const {
  return search(r, max_distance, from, TriangleFacing{direction});
}

}  // namespace scarp

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
  slots_.resize(builder.items.size());
  for (const Builder::Item& item : builder.items) {
    const Triangle& t = mesh.triangles[item.id];
    slots_[item.id] = static_cast<std::uint32_t>(triangles_.size());
    triangles_.push_back(
        {{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]}, item.id});
  }
}

TriangleTree::Neighbourhood TriangleTree::neighbourhood(const Box& box, double max_distance) const {
  Neighbourhood near;
  if (nodes_.empty()) return near;
  near.centre_ = 0.5 * (box.lower + box.upper);
  const Vec3d half = 0.5 * (box.upper - box.lower);
  // A little more than asked for, so that rounding does not hide a triangle at that distance.
  const double reach = max_distance * (1 + 1e-9);
  const auto is_near = [&](const auto& lower, const auto& upper) {
    for (int axis = 0; axis < 3; ++axis)
      if (lower[axis] > box.upper[axis] + reach || upper[axis] < box.lower[axis] - reach)
        return false;
    return true;
  };
  std::vector<FloatBox> boxes;
  std::array<std::uint32_t, max_stack> stack{};
  int depth = 1;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (!is_near(node.lower, node.upper)) continue;
    if (node.count == 0) {
      stack[depth++] = node.first + 1;
      stack[depth++] = node.first;
      continue;
    }
    for (std::uint32_t slot = node.first; slot < node.first + node.count; ++slot) {
      FloatBox around;
      for (const Vec3f& corner : triangles_[slot].corners) around.add(corner);
      if (!is_near(around.lower, around.upper)) continue;
      near.slots_.push_back(slot);
      boxes.push_back(around);
    }
  }
  // Of what lies beyond all points it does not matter how far: that keeps numbers small.
  const double largest = std::max({half.x, half.y, half.z}) + reach;
  const double margin = 1e-5 * largest;
  near.boxes_.resize(6 * boxes.size());
  auto* value = near.boxes_.data();
  for (int axis = 0; axis < 3; ++axis) {
    const auto about_centre = [&](float place, double grown) {
      return static_cast<float>(std::clamp(place - near.centre_[axis], -largest, largest) + grown);
    };
    for (const FloatBox& each : boxes) *value++ = about_centre(each.lower[axis], -margin);
    for (const FloatBox& each : boxes) *value++ = about_centre(each.upper[axis], margin);
  }
  return near;
}

namespace {

// All triangles; of those as near the lowest.
struct AnyTriangle {
  static constexpr double rounding = 0;
  static constexpr bool is_first_enough = false;
  static constexpr bool knows_rivals = false;
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
  static constexpr bool knows_rivals = true;  // those that are not accepted as well
  static constexpr double rounding = 1e-14;   // of a place, relative to it
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

// The nearest triangles so far: those that may still be as near as the nearest, but for rounding.
//
// Which of them answers is chosen at the end, so that it does not depend on the order in which they
// are found. Twice as much is kept as counts as equal: what is alone is so for every direction.
//
// room: others that are further away by so much are kept as well.
template <class Choice>
class Closest {
 public:
  Closest(Vec3d r, double max_distance, const Choice& choice, double room)
      : r_(r),
        choice_(choice),
        room_(room),
        rounding_(Choice::rounding * (std::abs(r.x) + std::abs(r.y) + std::abs(r.z))),
        square_(max_distance * max_distance),
        bound_(square_ * slack) {}

  // No triangle further away than the root of this can be the answer, or as near.
  double bound() const { return bound_; }
  bool found() const { return count_ > 0; }

  void offer(const std::array<Vec3d, 3>& p, std::uint32_t id, std::uint32_t slot) {
    const bool is_accepted = choice_.accepts(p);
    if (!is_accepted && !Choice::knows_rivals) return;
    const Weights w = closest_weights(r_, p);
    const Vec3d gap = r_ - weighted(p, w);
    const double square = dot(gap, gap);
    if (square > square_ + kept_) return;
    if (!is_accepted) {
      rival_ = std::min(rival_, square);
      return;
    }
    if (square <= square_) set_square(square);
    drop(kept_);
    const Near offered{w, square, id, slot};
    if (count_ < nearest_.size()) {
      nearest_[count_++] = offered;
      return;
    }
    Near& last = *std::max_element(nearest_.begin(), nearest_.end());
    if (offered < last) last = offered;
  }

  template <class Corners>
  ClosestPoint result(const Corners& corners_of, TriangleTree::Others* others) const {
    if (!found()) return {};
    std::size_t best = 0;
    for (std::size_t n = 1; n < count_; ++n)
      if (is_better(nearest_[n], nearest_[best], corners_of)) best = n;
    if (others != nullptr && count_ > 1) add_others(best, corners_of, *others);
    ClosestPoint result = point_of(nearest_[best], corners_of);
    result.distance = std::sqrt(square_);
    result.is_alone = Choice::knows_rivals && count_ == 1 && rival_ > square_ + kept_;
    return result;
  }

 private:
  struct Near {
    Weights weights;
    double square;
    std::uint32_t id;
    std::uint32_t slot;

    bool operator<(const Near& other) const {
      return square != other.square ? square < other.square : id < other.id;
    }
  };

  // A little, so that rounding of a box distance never hides a triangle at the same distance.
  static constexpr double slack = 1 + 1e-12;

  // Whether a is the answer rather than b.
  template <class Corners>
  bool is_better(const Near& a, const Near& b, const Corners& corners_of) const {
    const bool a_counts = a.square <= square_ + as_near_;
    const bool b_counts = b.square <= square_ + as_near_;
    if (!a_counts || !b_counts) return a_counts;
    return choice_.prefers(corners_of(a.slot), corners_of(b.slot), a.id < b.id);
  }

  template <class Corners>
  void add_others(std::size_t best, const Corners& corners_of, TriangleTree::Others& others) const {
    const auto normal = [&](std::size_t n) {
      const std::array<Vec3d, 3> p = corners_of(nearest_[n].slot);
      return cross(p[1] - p[0], p[2] - p[0]);
    };
    const Vec3d of_best = normalized(normal(best));
    for (std::size_t n = 0; n < count_; ++n) {
      if (n == best) continue;
      const Vec3d other = normal(n);
      if (dot(other, of_best) < others.cosine * length(other))
        others.points.push_back(point_of(nearest_[n], corners_of));
    }
  }

  template <class Corners>
  ClosestPoint point_of(const Near& near, const Corners& corners_of) const {
    return {.triangle = near.id,
            .point = weighted(corners_of(near.slot), near.weights),
            .barycentric = near.weights,
            .distance = std::sqrt(near.square)};
  }

  void set_square(double square) {
    const double distance = std::sqrt(square);
    square_ = square;
    as_near_ = rounding_ * (2 * distance + rounding_);
    kept_ = 2 * as_near_ + room_ * (2 * distance + room_);
    bound_ = square * slack + kept_;
  }

  // What is further away than the nearest by more than that.
  void drop(double more) {
    std::size_t kept = 0;
    for (std::size_t n = 0; n < count_; ++n)
      if (nearest_[n].square <= square_ + more) nearest_[kept++] = nearest_[n];
    count_ = kept;
  }

  Vec3d r_;
  Choice choice_;
  double room_;
  double rounding_;
  double square_;
  double as_near_ = 0;  // what squares may differ by, once a triangle is found
  double kept_ = 0;     // the same of those that are kept
  double bound_;
  double rival_ = std::numeric_limits<double>::infinity();  // of those that are not accepted
  // More than meet at a vertex, but for meshes with copies of triangles.
  std::array<Near, 32> nearest_;
  std::size_t count_ = 0;
};

}  // namespace

template <class Choice>
ClosestPoint TriangleTree::search(Vec3d r, double max_distance, const Choice& choice,
                                  Others* others) const {
  if (nodes_.empty()) return {};

  struct Entry {
    double square;
    std::uint32_t node;
  };
  std::array<Entry, max_stack> stack;
  int depth = 0;
  Closest<Choice> closest(r, max_distance, choice, others == nullptr ? 0 : others->room);
  const auto corners_of = [&](std::uint32_t slot) { return in_double(triangles_[slot].corners); };
  stack[depth++] = {squared_distance(r, nodes_[0].lower, nodes_[0].upper), 0};
  while (depth > 0) {
    const Entry entry = stack[--depth];
    if (entry.square > closest.bound()) continue;
    const Node& node = nodes_[entry.node];
    if (node.count == 0) {
      const std::uint32_t child = node.first;
      const Entry a{squared_distance(r, nodes_[child].lower, nodes_[child].upper), child};
      const Entry b{squared_distance(r, nodes_[child + 1].lower, nodes_[child + 1].upper),
                    child + 1};
      const Entry& nearer = a.square <= b.square ? a : b;
      const Entry& further = a.square <= b.square ? b : a;
      if (further.square <= closest.bound()) stack[depth++] = further;
      if (nearer.square <= closest.bound()) stack[depth++] = nearer;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      closest.offer(in_double(triangles_[i].corners), triangles_[i].id, i);
      if (Choice::is_first_enough && closest.found()) return closest.result(corners_of, others);
    }
  }
  return closest.result(corners_of, others);
}

// Boxes are compared in single precision, many at a time: they only tell which triangles are not
// worth a look. The answer is that of the exact comparison of all others.
template <class Choice>
ClosestPoint TriangleTree::search_near(Vec3d r, double max_distance, const Neighbourhood& near,
                                       const Choice& choice, std::uint32_t guess,
                                       Others* others) const {
  Closest<Choice> closest(r, max_distance, choice, others == nullptr ? 0 : others->room);
  const auto corners_of = [&](std::uint32_t slot) { return in_double(triangles_[slot].corners); };
  const std::uint32_t guessed_slot = guess == ClosestPoint::none ? guess : slots_[guess];
  if (guess != ClosestPoint::none) closest.offer(corners_of(guessed_slot), guess, guessed_slot);

  const Vec3f at(r - near.centre_);
  const std::size_t count = near.slots_.size();
  constexpr std::size_t most_at_once = 64;
  std::array<float, most_at_once> squares;
  for (std::size_t first = 0; first < count; first += most_at_once) {
    const std::size_t some = std::min(most_at_once, count - first);
    squares.fill(0);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* const lower = near.boxes_.data() + 2 * axis * count + first;
      const float* const upper = lower + count;
      const float place = at[static_cast<int>(axis)];
      for (std::size_t n = 0; n < some; ++n) {
        const float away = std::max(std::max(lower[n] - place, place - upper[n]), 0.0F);
        squares[n] += away * away;
      }
    }
    for (std::size_t n = 0; n < some; ++n) {
      if (!(squares[n] <= 1.00001 * closest.bound())) continue;
      const std::uint32_t slot = near.slots_[first + n];
      if (slot == guessed_slot) continue;
      closest.offer(corners_of(slot), triangles_[slot].id, slot);
    }
  }
  return closest.result(corners_of, others);
}

ClosestPoint TriangleTree::closest(Vec3d r, double max_distance) const {
  return search(r, max_distance, AnyTriangle{});
}

bool TriangleTree::is_within(Vec3d r, double max_distance) const {
  return search(r, max_distance, FirstTriangle{}).found();
}

ClosestPoint TriangleTree::closest_facing(Vec3d r, Vec3d direction, double max_distance) const {
  return search(r, max_distance, TriangleFacing{direction});
}

ClosestPoint TriangleTree::closest_facing(Vec3d r, Vec3d direction, double max_distance,
                                          Others& others) const {
  return search(r, max_distance, TriangleFacing{direction}, &others);
}

ClosestPoint TriangleTree::closest(Vec3d r, double max_distance, const Neighbourhood& near) const {
  return search_near(r, max_distance, near, AnyTriangle{}, ClosestPoint::none, nullptr);
}

ClosestPoint TriangleTree::closest_facing(Vec3d r, Vec3d direction, double max_distance,
                                          const Neighbourhood& near, std::uint32_t guess,
                                          Others* others) const {
  return search_near(r, max_distance, near, TriangleFacing{direction}, guess, others);
}

}  // namespace scarp

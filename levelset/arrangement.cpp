#include "levelset/arrangement.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "core/error.h"
#include "levelset/box_pairs.h"

namespace scarp {

namespace {

__extension__ using Wide = __int128;

constexpr int max_rounds = 64;

}  // namespace

/// The sign of the turn from o over p to q: +1 to the left.
int Arrangement::turn(Node o, Node p, Node q) {
  const Wide twice_area =
      static_cast<Wide>(p.x - o.x) * (q.y - o.y) - static_cast<Wide>(p.y - o.y) * (q.x - o.x);
  return twice_area > 0 ? 1 : twice_area < 0 ? -1 : 0;
}

void Arrangement::add(const Loop& loop, int group) {
  const auto node = [&](const Point2& point) {
    return Node{std::llround(point[0] / unit_), std::llround(point[1] / unit_)};
  };
  for (std::size_t p = 0; p < loop.size(); ++p) {
    const Node a = node(loop[p]);
    const Node b = node(loop[(p + 1) % loop.size()]);
    if (a == b) continue;
    const bool upwards = std::tie(a.y, a.x) < std::tie(b.y, b.x);
    Edge edge{.a = upwards ? a : b, .b = upwards ? b : a};
    edge.turns[static_cast<std::size_t>(group)] = upwards ? 1 : -1;
    edges_.push_back(edge);
  }
}

/// Edges that lie on each other count together; those that cancel go.
void Arrangement::merge_equal_edges() {
  const auto ends = [](const Edge& e) { return std::tie(e.a.x, e.a.y, e.b.x, e.b.y); };
  std::sort(edges_.begin(), edges_.end(),
            [&](const Edge& e, const Edge& f) { return ends(e) < ends(f); });
  std::vector<Edge> merged;
  for (const Edge& e : edges_) {
    if (!merged.empty() && ends(merged.back()) == ends(e)) {
      merged.back().turns[0] += e.turns[0];
      merged.back().turns[1] += e.turns[1];
    } else {
      merged.push_back(e);
    }
  }
  std::erase_if(merged, [](const Edge& e) { return e.turns[0] == 0 && e.turns[1] == 0; });
  edges_ = std::move(merged);
}

/// Where pairs of edges meet other than at their ends.
struct Arrangement::Split {
  std::vector<std::vector<Node>>& points;

  static bool in_box(const Edge& e, Node p) {
    return p.x >= std::min(e.a.x, e.b.x) && p.x <= std::max(e.a.x, e.b.x) && p.y >= e.a.y &&
           p.y <= e.b.y;
  }

  void add(std::size_t n, const Edge& e, Node p) {
    if (!(p == e.a) && !(p == e.b) && in_box(e, p)) points[n].push_back(p);
  }

  void visit(std::size_t n, const Edge& e, std::size_t m, const Edge& f) {
    const int fa = turn(e.a, e.b, f.a);
    const int fb = turn(e.a, e.b, f.b);
    const int ea = turn(f.a, f.b, e.a);
    const int eb = turn(f.a, f.b, e.b);
    if (fa == 0) add(n, e, f.a);
    if (fb == 0) add(n, e, f.b);
    if (ea == 0) add(m, f, e.a);
    if (eb == 0) add(m, f, e.b);
    if (fa * fb >= 0 || ea * eb >= 0) return;
    const auto dx = static_cast<double>(e.b.x - e.a.x);
    const auto dy = static_cast<double>(e.b.y - e.a.y);
    const auto fx = static_cast<double>(f.b.x - f.a.x);
    const auto fy = static_cast<double>(f.b.y - f.a.y);
    const auto sx = static_cast<double>(f.a.x - e.a.x);
    const auto sy = static_cast<double>(f.a.y - e.a.y);
    const double t = (sx * fy - sy * fx) / (dx * fy - dy * fx);
    const Node p{e.a.x + std::llround(t * dx), e.a.y + std::llround(t * dy)};
    add(n, e, p);
    add(m, f, p);
  }
};

std::vector<std::vector<Arrangement::Node>> Arrangement::split_points() const {
  std::vector<std::vector<Node>> points(edges_.size());
  Split split{points};
  std::vector<PlaneBox<std::int64_t>> boxes;
  boxes.reserve(edges_.size());
  for (const Edge& e : edges_) {
    boxes.push_back({{std::min(e.a.x, e.b.x), e.a.y}, {std::max(e.a.x, e.b.x), e.b.y}});
  }
  any_pair_of_boxes<std::int64_t>(boxes, [&](std::size_t m, std::size_t n) {
    split.visit(n, edges_[n], m, edges_[m]);
    return false;
  });
  return points;
}

/// One round of splitting; false when nothing had to be split.
bool Arrangement::split_edges() {
  std::vector<std::vector<Node>> points = split_points();
  std::vector<Edge> pieces;
  bool changed = false;
  for (std::size_t n = 0; n < edges_.size(); ++n) {
    const Edge& e = edges_[n];
    const bool to_the_left = e.b.x < e.a.x;
    std::vector<Node>& inner = points[n];
    std::sort(inner.begin(), inner.end(), [&](const Node& p, const Node& q) {
      return p.y != q.y ? p.y < q.y : to_the_left ? p.x > q.x : p.x < q.x;
    });
    inner.push_back(e.b);
    Node from = e.a;
    for (const Node& to : inner) {
      if (to == from) continue;
      // Rounding may turn a flat edge over.
      const bool upwards = std::tie(from.y, from.x) < std::tie(to.y, to.x);
      Edge piece{.a = upwards ? from : to, .b = upwards ? to : from, .turns = e.turns};
      if (!upwards) piece.turns = {-e.turns[0], -e.turns[1]};
      pieces.push_back(piece);
      changed = changed || !(from == e.a && to == e.b);
      from = to;
    }
  }
  edges_ = std::move(pieces);
  merge_equal_edges();
  return changed;
}

/// A line that goes up through edges that do not cross, and those that it cuts from left to right.
///
/// It leans to the left by less than any angle: points at one height are met from left to right,
/// and a flat edge is one that rises to the right.
class Arrangement::Sweep {
 public:
  explicit Sweep(const std::vector<Edge>& edges) : edges_(edges), cut_(Less{edges}) {}

  /// How often each group surrounds the places on the left of each edge.
  std::vector<std::array<int, 2>> turns_on_left() {
    std::vector<std::size_t> begins(edges_.size());
    for (std::size_t n = 0; n < begins.size(); ++n) begins[n] = n;
    std::vector<std::size_t> ends = begins;
    std::sort(begins.begin(), begins.end(), [&](std::size_t n, std::size_t m) {
      const Node& a = edges_[n].a;
      const Node& b = edges_[m].a;
      return a == b ? turn(a, edges_[n].b, edges_[m].b) < 0 : is_before(a, b);
    });
    std::sort(ends.begin(), ends.end(),
              [&](std::size_t n, std::size_t m) { return is_before(edges_[n].b, edges_[m].b); });
    std::vector<Cut::iterator> places(edges_.size());
    std::vector<std::array<int, 2>> left(edges_.size());
    auto end = ends.begin();
    for (const std::size_t n : begins) {
      for (; !is_before(edges_[n].a, edges_[*end].b); ++end) cut_.erase(places[*end]);
      places[n] = cut_.insert(n);
      if (places[n] == cut_.begin()) continue;
      const std::size_t neighbour = *std::prev(places[n]);
      for (std::size_t group = 0; group < 2; ++group) {
        left[n][group] = left[neighbour][group] - edges_[neighbour].turns[group];
      }
    }
    return left;
  }

 private:
  static bool is_before(const Node& p, const Node& q) {
    return std::tie(p.y, p.x) < std::tie(q.y, q.x);
  }

  /// Of two edges that the line cuts, the one on the left; they share at most an end.
  struct Less {
    const std::vector<Edge>& edges;
    bool operator()(std::size_t n, std::size_t m) const {
      const bool swapped = is_before(edges[m].a, edges[n].a);
      const Edge& first = edges[swapped ? m : n];
      const Edge& second = edges[swapped ? n : m];
      int side = turn(first.a, first.b, second.a);
      if (side == 0) side = turn(first.a, first.b, second.b);
      return swapped ? side > 0 : side < 0;
    }
  };
  using Cut = std::multiset<std::size_t, Less>;

  const std::vector<Edge>& edges_;
  Cut cut_;
};

/// Edges between inside and outside, in the direction that has the inside on the left.
std::vector<Arrangement::Edge> Arrangement::boundary(
    const std::function<bool(int, int)>& inside) const {
  const std::vector<std::array<int, 2>> left = Sweep(edges_).turns_on_left();
  std::vector<Edge> kept;
  for (std::size_t n = 0; n < edges_.size(); ++n) {
    const Edge& e = edges_[n];
    const bool on_left = inside(left[n][0], left[n][1]);
    const bool on_right = inside(left[n][0] - e.turns[0], left[n][1] - e.turns[1]);
    if (on_left == on_right) continue;
    kept.push_back({.a = on_left ? e.a : e.b, .b = on_left ? e.b : e.a});
  }
  return kept;
}

std::vector<Loop> Arrangement::linked(const std::vector<Edge>& directed) const {
  std::multimap<std::pair<std::int64_t, std::int64_t>, std::size_t> leaving;
  for (std::size_t n = 0; n < directed.size(); ++n) {
    leaving.insert({{directed[n].a.x, directed[n].a.y}, n});
  }
  // Where loops touch, the next edge is the sharpest to the left: each loop keeps to itself.
  const auto next = [&](std::size_t n) {
    const auto [first, last] = leaving.equal_range({directed[n].b.x, directed[n].b.y});
    std::size_t best = first->second;
    for (auto each = std::next(first); each != last; ++each) {
      const Node o = directed[n].a;
      const Node tip = directed[n].b;
      const Node p = directed[best].b;
      const Node q = directed[each->second].b;
      const int turn_p = turn(o, tip, p);
      const int turn_q = turn(o, tip, q);
      const bool sharper = turn_p != turn_q ? turn_q > turn_p : turn(tip, p, q) > 0;
      if (sharper) best = each->second;
    }
    return best;
  };
  std::vector<Loop> loops;
  std::vector<bool> used(directed.size(), false);
  for (std::size_t start = 0; start < directed.size(); ++start) {
    std::vector<Node> nodes;
    for (std::size_t n = start; !used[n]; n = next(n)) {
      used[n] = true;
      nodes.push_back(directed[n].a);
    }
    Loop loop;
    for (std::size_t p = 0; p < nodes.size(); ++p) {
      const Node before = nodes[(p + nodes.size() - 1) % nodes.size()];
      const Node after = nodes[(p + 1) % nodes.size()];
      if (turn(before, nodes[p], after) != 0) {
        loop.push_back(
            {static_cast<double>(nodes[p].x) * unit_, static_cast<double>(nodes[p].y) * unit_});
      }
    }
    if (loop.size() > 2) loops.push_back(std::move(loop));
  }
  return loops;
}

std::vector<Loop> Arrangement::region(const std::function<bool(int, int)>& inside) {
  merge_equal_edges();
  int rounds = 0;
  while (split_edges()) {
    ++rounds;
    SCARP_ASSERT(rounds, <, max_rounds);
  }
  return linked(boundary(inside));
}

}  // namespace scarp

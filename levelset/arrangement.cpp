#include "levelset/arrangement.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "core/error.h"

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
  std::vector<std::size_t> order(edges_.size());
  for (std::size_t n = 0; n < order.size(); ++n) order[n] = n;
  const auto left = [&](std::size_t n) { return std::min(edges_[n].a.x, edges_[n].b.x); };
  const auto right = [&](std::size_t n) { return std::max(edges_[n].a.x, edges_[n].b.x); };
  std::sort(order.begin(), order.end(), [&](std::size_t n, std::size_t m) {
    return std::pair(left(n), n) < std::pair(left(m), m);
  });
  std::vector<std::size_t> open;
  for (const std::size_t n : order) {
    std::erase_if(open, [&](std::size_t m) { return right(m) < left(n); });
    for (const std::size_t m : open) {
      const bool apart = edges_[m].b.y < edges_[n].a.y || edges_[n].b.y < edges_[m].a.y;
      if (!apart) split.visit(n, edges_[n], m, edges_[m]);
    }
    open.push_back(n);
  }
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

/// Edges by the rows (or columns) that they span, for rays along them.
class Arrangement::Rows {
 public:
  /// axis is the one across the rows.
  Rows(const std::vector<Edge>& edges, int axis) : edges_(edges), axis_(axis) {
    lowest_ = along(edges[0].a, axis);
    std::int64_t highest = lowest_;
    for (const Edge& e : edges) {
      lowest_ = std::min({lowest_, along(e.a, axis), along(e.b, axis)});
      highest = std::max({highest, along(e.a, axis), along(e.b, axis)});
    }
    const auto count = std::clamp<std::size_t>(edges.size() / 4, 1, 4096);
    height_ = (highest - lowest_) / static_cast<std::int64_t>(count) + 1;
    rows_.resize(count);
    for (std::size_t n = 0; n < edges.size(); ++n) {
      const std::int64_t a = along(edges[n].a, axis);
      const std::int64_t b = along(edges[n].b, axis);
      for (std::size_t row = row_of(std::min(a, b)); row <= row_of(std::max(a, b)); ++row) {
        rows_[row].push_back(static_cast<std::uint32_t>(n));
      }
    }
  }

  /// How often each group surrounds the places next to the middle of an edge, on its side towards
  /// lower coordinates along the row.
  std::array<int, 2> turns_before(const Edge& edge) const {
    const Node middle{edge.a.x + edge.b.x, edge.a.y + edge.b.y};
    const std::int64_t level = along(middle, axis_);
    std::array<int, 2> turns{};
    // Halves are rounded down: the row of the lower half holds every edge that spans the level.
    const std::int64_t half = level >= 0 ? level / 2 : -((1 - level) / 2);
    for (const std::uint32_t n : rows_[row_of(half)]) {
      const Edge& f = edges_[n];
      const std::int64_t from = 2 * along(f.a, axis_);
      const std::int64_t to = 2 * along(f.b, axis_);
      if (level < std::min(from, to) || level >= std::max(from, to)) continue;
      // To the right of an upward edge, above one that goes to the right.
      const int side = turn({2 * f.a.x, 2 * f.a.y}, {2 * f.b.x, 2 * f.b.y}, middle);
      const bool ascends = to > from;
      const bool is_before = axis_ == 1 ? (side < 0) == ascends : (side > 0) == ascends;
      if (side == 0 || !is_before) continue;
      const int sign = (axis_ == 1) == ascends ? -1 : 1;
      turns[0] += sign * f.turns[0];
      turns[1] += sign * f.turns[1];
    }
    return turns;
  }

 private:
  std::size_t row_of(std::int64_t level) const {
    return std::min(static_cast<std::size_t>((level - lowest_) / height_), rows_.size() - 1);
  }

  const std::vector<Edge>& edges_;
  int axis_;
  std::int64_t lowest_ = 0;
  std::int64_t height_ = 1;
  std::vector<std::vector<std::uint32_t>> rows_;
};

/// Edges between inside and outside, in the direction that has the inside on the left.
std::vector<Arrangement::Edge> Arrangement::boundary(
    const std::function<bool(int, int)>& inside) const {
  std::vector<Edge> kept;
  if (edges_.empty()) return kept;
  const Rows rows(edges_, 1);
  const Rows columns(edges_, 0);
  for (const Edge& e : edges_) {
    const bool flat = e.a.y == e.b.y;
    const std::array<int, 2> before = (flat ? columns : rows).turns_before(e);
    const int sign = flat ? 1 : -1;
    const bool near = inside(before[0], before[1]);
    const bool beyond = inside(before[0] + sign * e.turns[0], before[1] + sign * e.turns[1]);
    if (near == beyond) continue;
    const bool left = flat ? beyond : near;
    kept.push_back({.a = left ? e.a : e.b, .b = left ? e.b : e.a});
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

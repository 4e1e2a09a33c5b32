#include "core/triangulate.h"

#include <algorithm>
#include <optional>

namespace scarp {

namespace {

using Point = std::array<double, 2>;

/// Twice the area of a triangle: positive counter-clockwise.
double turn(const Point& a, const Point& b, const Point& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

double area(std::span<const Point> points, const VertexLoop& loop) {
  double doubled = 0;
  for (std::size_t n = 0; n < loop.size(); ++n) {
    const Point& a = points[loop[n]];
    const Point& b = points[loop[(n + 1) % loop.size()]];
    doubled += a[0] * b[1] - b[0] * a[1];
  }
  return 0.5 * doubled;
}

/// Borders included.
bool holds(const Point& a, const Point& b, const Point& c, const Point& p) {
  return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
}

/// Where the line from a point to the right meets a loop first: the edge and how far away.
struct Hit {
  std::size_t edge = 0;
  double x = 0;
};

std::optional<Hit> first_to_the_right(std::span<const Point> points, const VertexLoop& loop,
                                      const Point& from) {
  std::optional<Hit> nearest;
  for (std::size_t n = 0; n < loop.size(); ++n) {
    const Point& a = points[loop[n]];
    const Point& b = points[loop[(n + 1) % loop.size()]];
    // The inside lies to the left of edges that go up.
    if (!(a[1] <= from[1] && from[1] < b[1])) continue;
    const double x = a[0] + (from[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
    if (x < from[0] || (nearest && x >= nearest->x)) continue;
    nearest = Hit{.edge = n, .x = x};
  }
  return nearest;
}

/// Whether the way from a corner of a loop to a point begins inside. Where holes were joined before
/// a loop comes to one place several times: only one of its corners there is open to the point.
bool is_open_to(std::span<const Point> points, const VertexLoop& loop, std::size_t n,
                const Point& point) {
  const Point& before = points[loop[n == 0 ? loop.size() - 1 : n - 1]];
  const Point& corner = points[loop[n]];
  const Point& after = points[loop[(n + 1) % loop.size()]];
  const bool left_of_first = turn(before, corner, point) > 0;
  const bool left_of_second = turn(corner, after, point) > 0;
  return turn(before, corner, after) > 0 ? left_of_first && left_of_second
                                         : left_of_first || left_of_second;
}

/// The place in a loop of a vertex that can be seen from a point whose line to the right meets an
/// edge: its end further right, or what hides that.
std::size_t seen_vertex(std::span<const Point> points, const VertexLoop& loop, const Point& from,
                        const Hit& hit) {
  const std::size_t next = (hit.edge + 1) % loop.size();
  std::size_t best = points[loop[hit.edge]][0] > points[loop[next]][0] ? hit.edge : next;
  const Point end = points[loop[best]];
  const Point on_edge{hit.x, from[1]};
  const bool is_above = end[1] > from[1];
  double best_slope = 1e300;
  for (std::size_t n = 0; n < loop.size(); ++n) {
    const Point& p = points[loop[n]];
    if (p[0] < from[0] || p == from) continue;
    const bool is_hiding = is_above ? holds(from, on_edge, end, p) : holds(from, end, on_edge, p);
    if (!is_hiding || !is_open_to(points, loop, n, from)) continue;
    const double slope = std::abs(p[1] - from[1]) / std::max(p[0] - from[0], 1e-300);
    const bool is_nearer = slope == best_slope && p[0] < points[loop[best]][0];
    if (slope < best_slope || is_nearer) {
      best = n;
      best_slope = slope;
    }
  }
  return best;
}

/// Joins a hole to the loop around it by going there and back; false if the loop is not around it.
bool join(std::span<const Point> points, VertexLoop& outer, const VertexLoop& hole) {
  const auto rightmost =
      std::ranges::max_element(hole, [&](auto a, auto b) { return points[a][0] < points[b][0]; });
  const Point& from = points[*rightmost];
  const std::optional<Hit> hit = first_to_the_right(points, outer, from);
  if (!hit) return false;
  const std::size_t bridge = seen_vertex(points, outer, from, *hit);
  VertexLoop joined(outer.begin(), outer.begin() + static_cast<std::ptrdiff_t>(bridge) + 1);
  joined.insert(joined.end(), rightmost, hole.end());
  joined.insert(joined.end(), hole.begin(), rightmost + 1);
  joined.insert(joined.end(), outer.begin() + static_cast<std::ptrdiff_t>(bridge), outer.end());
  outer = std::move(joined);
  return true;
}

/// Cuts ears off a loop until nothing is left.
class EarClipper {
 public:
  EarClipper(std::span<const Point> points, const VertexLoop& loop)
      : points_(points), loop_(loop), next_(loop.size()), before_(loop.size()) {
    for (std::size_t n = 0; n < loop.size(); ++n) {
      next_[n] = (n + 1) % loop.size();
      before_[next_[n]] = n;
    }
  }

  void run(std::vector<Triangle>& triangles) {
    std::size_t at = 0;
    std::size_t left = loop_.size();
    std::size_t tried = 0;
    // Where no ear is left, what is left has no inside: its ears without an area go.
    for (int patience = 0; left > 2;) {
      if (is_ear(at, patience)) {
        triangles.push_back({loop_[before_[at]], loop_[at], loop_[next_[at]]});
        next_[before_[at]] = next_[at];
        before_[next_[at]] = before_[at];
        --left;
        tried = 0;
        patience = 0;
        // The one after the next, so that no fan of needles comes about.
        at = next_[next_[at]];
      } else if (++tried > left) {
        tried = 0;
        ++patience;
        at = next_[at];
      } else {
        at = next_[at];
      }
    }
  }

 private:
  const Point& point(std::size_t n) const { return points_[loop_[n]]; }

  bool is_ear(std::size_t at, int patience) const {
    const Point& a = point(before_[at]);
    const Point& b = point(at);
    const Point& c = point(next_[at]);
    const double size = turn(a, b, c);
    if (patience == 0) return size > 0 && !holds_others(at, a, b, c);
    if (patience == 1) return size == 0;
    return patience > 2 || size > 0;
  }

  bool holds_others(std::size_t at, const Point& a, const Point& b, const Point& c) const {
    for (std::size_t n = next_[next_[at]]; n != before_[at]; n = next_[n]) {
      const Point& p = point(n);
      if (p == a || p == b || p == c) continue;
      if (holds(a, b, c, p)) return true;
    }
    return false;
  }

  std::span<const Point> points_;
  const VertexLoop& loop_;
  std::vector<std::size_t> next_;
  std::vector<std::size_t> before_;
};

}  // namespace

std::vector<Triangle> triangulate(std::span<const Point> points, std::vector<VertexLoop> loops) {
  std::vector<VertexLoop> outer;
  std::vector<VertexLoop> holes;
  for (VertexLoop& loop : loops)
    (area(points, loop) >= 0 ? outer : holes).push_back(std::move(loop));
  // The holes furthest right first: what joins them is in nobody's way.
  const auto rightmost = [&](const VertexLoop& loop) {
    double x = -1e300;
    for (const std::uint32_t v : loop) x = std::max(x, points[v][0]);
    return x;
  };
  std::ranges::stable_sort(holes, std::ranges::greater{}, rightmost);
  std::vector<Triangle> triangles;
  for (const VertexLoop& hole : holes) {
    const double x = rightmost(hole);
    VertexLoop* around = nullptr;
    double nearest = 1e300;
    const auto at = std::ranges::find_if(hole, [&](auto v) { return points[v][0] == x; });
    for (VertexLoop& each : outer) {
      const auto hit = first_to_the_right(points, each, points[*at]);
      if (!hit || hit->x >= nearest) continue;
      nearest = hit->x;
      around = &each;
    }
    // A hole without anything around it can only be one without an area.
    if (around == nullptr || !join(points, *around, hole)) outer.push_back(hole);
  }
  for (const VertexLoop& loop : outer) EarClipper(points, loop).run(triangles);
  return triangles;
}

}  // namespace scarp

#include "levelset/start/polygon.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/recipe/quantity.h"
#include "levelset/start/box_pairs.h"

namespace scarp {

namespace {

/// Images beyond a side are kept this far, in spacings: further than the band and a leaf see.
constexpr double image_reach = 24;

/// Points are rounded to this fraction of a spacing.
constexpr double units_per_spacing = 65536;

/// How far the chords of arcs may be from them, in spacings. Each of up to four offsets adds some.
constexpr double arc_tolerance = 0.0025;

struct NamedEdge {
  std::size_t loop = 0;
  std::size_t number = 0;
  Point2 a{};
  Point2 b{};

  double lower(int axis) const { return std::min(a[axis], b[axis]); }
  double upper(int axis) const { return std::max(a[axis], b[axis]); }
};

std::vector<NamedEdge> edges_of(std::span<const Loop> loops) {
  std::vector<NamedEdge> edges;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    for (std::size_t p = 0; p < loops[l].size(); ++p) {
      edges.push_back({l, p, loops[l][p], loops[l][(p + 1) % loops[l].size()]});
    }
  }
  return edges;
}

std::string named(const NamedEdge& edge, std::size_t loop_count) {
  return (loop_count > 1 ? "polygon " + std::to_string(edge.loop) + " edge " : "edge ") +
         std::to_string(edge.number);
}

double cross(Point2 o, Point2 p, Point2 q) {
  return (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]);
}

double distance_to_edge(Point2 r, const NamedEdge& e) {
  const Point2 along{e.b[0] - e.a[0], e.b[1] - e.a[1]};
  const double square = along[0] * along[0] + along[1] * along[1];
  const double s =
      std::clamp(((r[0] - e.a[0]) * along[0] + (r[1] - e.a[1]) * along[1]) / square, 0.0, 1.0);
  const double x = r[0] - e.a[0] - s * along[0];
  const double y = r[1] - e.a[1] - s * along[1];
  return std::sqrt(x * x + y * y);
}

bool cross_properly(const NamedEdge& e, const NamedEdge& f) {
  return (cross(e.a, e.b, f.a) > 0) != (cross(e.a, e.b, f.b) > 0) &&
         (cross(f.a, f.b, e.a) > 0) != (cross(f.a, f.b, e.b) > 0);
}

double distance_between(const NamedEdge& e, const NamedEdge& f) {
  if (cross_properly(e, f)) return 0;
  return std::min({distance_to_edge(e.a, f), distance_to_edge(e.b, f), distance_to_edge(f.a, e),
                   distance_to_edge(f.b, e)});
}

/// The end of one of two edges that is nearest to the other one.
Point2 nearest_end(const NamedEdge& e, const NamedEdge& f) {
  const auto is_nearer = [&](const Point2& p, const Point2& q) {
    const auto distance = [&](const Point2& r) {
      return distance_to_edge(r, e) + distance_to_edge(r, f);
    };
    return std::pair(distance(p), p) < std::pair(distance(q), q);
  };
  return std::min({e.a, e.b, f.a, f.b}, is_nearer);
}

/// Whether f follows e around the same loop, or the other way round.
bool adjacent(const NamedEdge& e, const NamedEdge& f, std::span<const Loop> loops) {
  const std::size_t count = loops[e.loop].size();
  return e.loop == f.loop &&
         ((e.number + 1) % count == f.number || (f.number + 1) % count == e.number);
}

/// Calls visit for pairs of edges whose boxes are not further apart than reach, until it is true.
template <class Visit>
void any_pair(const std::vector<NamedEdge>& edges, double reach, const Visit& visit) {
  std::vector<PlaneBox<double>> boxes;
  boxes.reserve(edges.size());
  for (const NamedEdge& e : edges) {
    boxes.push_back({{e.lower(0), e.lower(1)}, {e.upper(0) + reach, e.upper(1) + reach}});
  }
  any_pair_of_boxes<double>(
      boxes, [&](std::size_t n, std::size_t m) { return visit(edges[n], edges[m]); });
}

std::optional<std::string> fault_of_loop(const Loop& loop, const std::string& name) {
  if (loop.size() < 3)
    return name + " has " + std::to_string(loop.size()) + " points; three or more are needed";
  for (std::size_t p = 0; p < loop.size(); ++p) {
    if (!std::isfinite(loop[p][0]) || !std::isfinite(loop[p][1])) {
      return name + " point " + std::to_string(p) + " is not finite";
    }
    const std::size_t next = (p + 1) % loop.size();
    if (loop[p] == loop[next]) {
      return name + " points " + std::to_string(p) + " and " + std::to_string(next) +
             " are the same; the last point is joined to the first by itself";
    }
  }
  return std::nullopt;
}

/// Two neighbours share their point; they are at fault if one runs back along the other.
bool runs_back(const NamedEdge& e, const NamedEdge& f) {
  const bool forward = e.b == f.a;
  const Point2 tip = forward ? e.b : e.a;
  const Point2 p = forward ? e.a : e.b;
  const Point2 q = forward ? f.b : f.a;
  const double along = (p[0] - tip[0]) * (q[0] - tip[0]) + (p[1] - tip[1]) * (q[1] - tip[1]);
  return along > 0 && std::abs(cross(tip, p, q)) <= 1e-12 * along;
}

std::vector<Loop> mirrored(std::vector<Loop> loops, int axis, double wall) {
  for (Loop& loop : loops) {
    for (Point2& point : loop) point[axis] = 2 * wall - point[axis];
    std::reverse(loop.begin(), loop.end());
  }
  return loops;
}

/// Together with the mirror images beyond both sides, as far as a reach: images of images, where
/// the domain is narrower than that.
std::vector<Loop> with_mirror_images(std::vector<Loop> loops, const Sides& sides, int axis,
                                     double reach) {
  double lower = sides.lower[axis];
  double upper = sides.upper[axis];
  do {
    std::vector<Loop> images = loops;
    for (const double wall : {lower, upper}) {
      const std::vector<Loop> image = mirrored(loops, axis, wall);
      images.insert(images.end(), image.begin(), image.end());
    }
    loops = std::move(images);
    const double width = upper - lower;
    lower -= width;
    upper += width;
  } while (sides.lower[axis] - lower < reach);
  return loops;
}

std::vector<Loop> shifted(std::vector<Loop> loops, int axis, double shift) {
  for (Loop& loop : loops) {
    for (Point2& point : loop) point[axis] += shift;
  }
  return loops;
}

Loop box(const Sides& sides, Point2 margin) {
  return box_loop({sides.lower[0] - margin[0], sides.lower[1] - margin[1]},
                  {sides.upper[0] + margin[0], sides.upper[1] + margin[1]});
}

using Fill = RegionGrid::Fill;

/// Whether some of what loops surround lies in a box.
bool meet(const RegionGrid& grid, const std::vector<Loop>& loops, const Loop& box) {
  return std::ranges::any_of(loops, [&](const Loop& loop) { return may_meet(loop, box); }) &&
         !grid.clipped(loops, box, Fill::non_zero).empty();
}

/// By how much loops have to be shifted for their copies beyond periodic sides to come into a box.
std::vector<Point2> shifts_into(const Frame& frame, const std::vector<Loop>& loops,
                                const Loop& box) {
  std::array<std::vector<double>, 2> along{{{0}, {0}}};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (frame.boundary[axis] != Boundary::periodic) continue;
    double lower = box[2][axis];
    double upper = box[0][axis];
    for (const Loop& loop : loops) {
      for (const Point2& point : loop) {
        lower = std::min(lower, point[axis]);
        upper = std::max(upper, point[axis]);
      }
    }
    const double width = frame.sides().width(static_cast<int>(axis));
    const double last = std::floor((box[2][axis] - lower) / width);
    for (double n = std::ceil((box[0][axis] - upper) / width); n <= last; ++n) {
      if (n != 0) along[axis].push_back(n * width);
    }
  }
  std::vector<Point2> shifts;
  for (const double x : along[0]) {
    for (const double y : along[1]) shifts.push_back({x, y});
  }
  return shifts;
}

}  // namespace

std::optional<std::string> polygon_fault(std::span<const Loop> loops) {
  if (loops.empty()) return "there is no polygon";
  for (std::size_t l = 0; l < loops.size(); ++l) {
    if (auto fault = fault_of_loop(loops[l], "polygon " + std::to_string(l))) return fault;
  }
  std::optional<std::string> fault;
  const std::vector<NamedEdge> edges = edges_of(loops);
  any_pair(edges, 0, [&](const NamedEdge& e, const NamedEdge& f) {
    const bool neighbours = adjacent(e, f, loops);
    if (neighbours ? !runs_back(e, f) : distance_between(e, f) > 0) return false;
    const bool in_order = std::pair(e.loop, e.number) < std::pair(f.loop, f.number);
    fault = named(in_order ? e : f, loops.size()) + " and " +
            named(in_order ? f : e, loops.size()) +
            (neighbours ? " lie on each other" : " cross or touch") +
            "; write holes and islands as polygons of their own";
    return true;
  });
  return fault;
}

std::optional<std::string> thin_feature(const Frame& frame, std::span<const Loop> loops,
                                        double shortest) {
  const Sides sides = frame.sides();
  const auto in_domain = [&](const NamedEdge& e) {
    return e.upper(0) >= sides.lower[0] && e.lower(0) <= sides.upper[0] &&
           e.upper(1) >= sides.lower[1] && e.lower(1) <= sides.upper[1];
  };
  // Walls that face each other within 60 degrees; others meet at a corner.
  const auto opposite = [](const NamedEdge& e, const NamedEdge& f) {
    const Point2 u{e.b[0] - e.a[0], e.b[1] - e.a[1]};
    const Point2 v{f.b[0] - f.a[0], f.b[1] - f.a[1]};
    const double cosine = (u[0] * v[0] + u[1] * v[1]) /
                          std::sqrt((u[0] * u[0] + u[1] * u[1]) * (v[0] * v[0] + v[1] * v[1]));
    return cosine < -0.5;
  };
  std::optional<std::string> fault;
  const std::vector<NamedEdge> edges = edges_of(loops);
  any_pair(edges, shortest, [&](const NamedEdge& e, const NamedEdge& f) {
    if (!in_domain(e) || !in_domain(f) || adjacent(e, f, loops)) return false;
    const double gap = distance_between(e, f);
    if (gap >= (opposite(e, f) ? shortest * (1 - 1e-4) : 1e-4 * shortest)) return false;
    const auto text = [&](double length) {
      const double digit = 1e-3 * frame.spacing;
      return rounded_number(std::round(length / digit) * digit);
    };
    const Point2 place = nearest_end(e, f);
    // Strips of a section go on along y.
    std::string where(frame.is_section() ? "x = " : "(");
    where += text(place[0]);
    if (!frame.is_section()) where += ", " + text(place[1]) + ')';
    fault = "walls at " + where + " nm " +
            (gap > 1e-4 * shortest ? "are " + text(gap) + " nm apart" : "touch or cross") +
            "; let shapes overlap, or keep walls " + text(shortest) + " nm apart";
    return true;
  });
  return fault;
}

RegionGrid region_grid(const Frame& frame) {
  return {frame.spacing / units_per_spacing, arc_tolerance * frame.spacing};
}

namespace {

/// The loops of an outline in groups that belong together; those of a layout that lie wholly
/// outside the domain are left out where copies of them would come into it.
std::vector<std::vector<Loop>> separate_shapes(const Frame& frame, const PolygonOutline& outline) {
  if (outline.rule == PolygonOutline::Rule::even_odd) return {outline.loops};
  const RegionGrid grid = region_grid(frame);
  const bool is_periodic = std::find(frame.boundary.begin(), frame.boundary.end(),
                                     Boundary::periodic) != frame.boundary.end();
  std::vector<std::vector<Loop>> shapes;
  if (outline.rule == PolygonOutline::Rule::region) {
    if (!is_periodic) return {outline.loops};
    shapes = grid.parts(outline.loops);
  } else {
    // Each by itself first: where one crosses itself or goes the other way, others do not cancel
    // it.
    for (const Loop& loop : outline.loops) shapes.push_back(grid.untangled(loop));
  }
  if (is_periodic) {
    const Loop domain = box(frame.sides(), {0, 0});
    std::erase_if(shapes, [&](const auto& shape) { return !meet(grid, shape, domain); });
  }
  return shapes;
}

/// The outline with its images, up to a distance from the sides, as it is drawn.
std::vector<Loop> unsized_loops(const Frame& frame, const PolygonOutline& outline, double reach) {
  const Sides sides = frame.sides();
  const RegionGrid grid = region_grid(frame);
  const bool even_odd = outline.rule == PolygonOutline::Rule::even_odd;
  // Cut at reflective sides alone: elsewhere no edge gets a new end.
  Point2 margin{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const bool is_endless = axis == 1 && outline.is_section;
    if (is_endless || frame.boundary[axis] == Boundary::periodic) margin[axis] = reach;
  }
  const Loop kept = box(sides, margin);
  std::vector<Loop> all;
  for (const std::vector<Loop>& shape : separate_shapes(frame, outline)) {
    for (const Point2& shift : shifts_into(frame, shape, kept)) {
      std::vector<Loop> copy = shifted(shifted(shape, 0, shift[0]), 1, shift[1]);
      if (even_odd) copy = grid.clipped(copy, kept, Fill::even_odd);
      all.insert(all.end(), std::make_move_iterator(copy.begin()),
                 std::make_move_iterator(copy.end()));
    }
  }
  if (!even_odd) all = grid.clipped(all, kept, Fill::non_zero);
  for (int axis = 0; axis < 2; ++axis) {
    if (margin[axis] == 0) all = with_mirror_images(std::move(all), sides, axis, reach);
  }
  return grid.clipped(all, box(sides, {reach, reach}), Fill::non_zero);
}

}  // namespace

std::vector<Loop> domain_loops(const Frame& frame, const PolygonOutline& outline, double growth) {
  const double reach = image_reach * frame.spacing + 2 * std::abs(growth);
  if (outline.sizing.is_none()) return unsized_loops(frame, outline, reach);
  const Sides sides = frame.sides();
  const double further = reach + outline.sizing.reach();
  const RegionGrid grid = region_grid(frame);
  return grid.clipped(grid.sized(unsized_loops(frame, outline, further),
                                 box(sides, {further, further}), outline.sizing),
                      box(sides, {reach, reach}), Fill::non_zero);
}

SizingLosses sizing_losses(const Frame& frame, const PolygonOutline& outline) {
  if (outline.sizing.is_none()) return {};
  const Sides sides = frame.sides();
  const double reach = image_reach * frame.spacing + outline.sizing.reach();
  return region_grid(frame).losses(unsized_loops(frame, outline, reach), box(sides, {reach, reach}),
                                   box(sides, {0, 0}), outline.sizing);
}

}  // namespace scarp

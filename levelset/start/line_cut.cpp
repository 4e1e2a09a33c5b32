#include "levelset/start/line_cut.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace scarp {

namespace {

/// A wall that the line meets at a smaller angle counts as parallel to it.
constexpr double least_sine = 1e-9;

/// Strips go on this far beyond the section, in spacings: further than walls are seen.
constexpr double strip_length = 64;

/// So far reaches what is endless. Units: nm.
constexpr double endless = 1e12;

/// A part of the line. Units: nm.
struct Interval {
  double lower = 0;
  double upper = 0;

  bool is_empty() const { return !(lower < upper); }
  double width() const { return upper - lower; }
};

Interval common(const Interval& a, const Interval& b) {
  return {std::max(a.lower, b.lower), std::min(a.upper, b.upper)};
}

/// Where the line is within a half width of a centre along an axis.
Interval within_slab(const LineCut& line, int axis, double centre, double half) {
  const double away = line.middle[axis] - centre;
  const double slope = line.along[axis];
  if (std::abs(slope) < least_sine)
    return std::abs(away) < half ? Interval{-endless, endless} : Interval{};
  const double middle = -away / slope;
  const double reach = half / std::abs(slope);
  return {middle - reach, middle + reach};
}

Interval within_disc(const LineCut& line, const Point2& centre, double radius) {
  const Point2 to{centre[0] - line.middle[0], centre[1] - line.middle[1]};
  const double along = to[0] * line.along[0] + to[1] * line.along[1];
  const double across = to[1] * line.along[0] - to[0] * line.along[1];
  const double square = radius * radius - across * across;
  if (!(square > 0)) return {};
  return {along - std::sqrt(square), along + std::sqrt(square)};
}

/// A rectangle is convex: the line is in it from where it first meets a part of it to where it
/// last does.
Interval within_rectangle(const LineCut& line, const RectangleOutline& box, const Point2& centre) {
  const double radius = box.corner_radius;
  const Point2 half{0.5 * box.size[0], 0.5 * box.size[1]};
  std::vector<Interval> pieces{common(within_slab(line, 0, centre[0], half[0] - radius),
                                      within_slab(line, 1, centre[1], half[1])),
                               common(within_slab(line, 0, centre[0], half[0]),
                                      within_slab(line, 1, centre[1], half[1] - radius))};
  for (const double x : {-1, 1}) {
    for (const double y : {-1, 1}) {
      const Point2 corner{centre[0] + x * (half[0] - radius), centre[1] + y * (half[1] - radius)};
      pieces.push_back(within_disc(line, corner, radius));
    }
  }
  Interval all{endless, -endless};
  for (const Interval& piece : pieces) {
    if (piece.is_empty()) continue;
    all = {std::min(all.lower, piece.lower), std::max(all.upper, piece.upper)};
  }
  return all;
}

/// The centres of copies on a lattice.
std::vector<Point2> centres(const Repeat& repeat, const Point2& middle) {
  std::vector<Point2> all;
  for (int i = 0; i < repeat.count[0]; ++i) {
    for (int j = 0; j < repeat.count[1]; ++j) {
      all.push_back({middle[0] + (i - 0.5 * (repeat.count[0] - 1)) * repeat.pitch[0],
                     middle[1] + (j - 0.5 * (repeat.count[1] - 1)) * repeat.pitch[1]});
    }
  }
  return all;
}

/// Parts of the line as they show in the section: cut at its ends, and where these are periodic
/// with what comes back on the other side.
std::vector<Interval> shown(const Frame& frame, const std::vector<Interval>& intervals) {
  const Sides sides = frame.sides();
  const Interval section{sides.lower[0], sides.upper[0]};
  const double width = section.width();
  std::vector<Interval> pieces;
  for (const Interval& each : intervals) {
    if (common(each, section).width() > 1e-9 * width) pieces.push_back(common(each, section));
    if (each.is_empty() || frame.boundary[0] != Boundary::periodic) continue;
    // What reaches over both ends covers all anyway.
    for (const double shift : {-width, width}) {
      const Interval copy = common({each.lower + shift, each.upper + shift}, section);
      if (copy.width() > 1e-9 * width && !common(each, section).is_empty()) pieces.push_back(copy);
    }
  }
  std::ranges::sort(pieces, {}, &Interval::lower);
  std::vector<Interval> joined;
  for (const Interval& piece : pieces) {
    if (!joined.empty() && piece.lower <= joined.back().upper) {
      joined.back().upper = std::max(joined.back().upper, piece.upper);
    } else {
      joined.push_back(piece);
    }
  }
  return joined;
}

bool covers(const Frame& frame, const std::vector<Interval>& joined) {
  return joined.size() == 1 && joined[0].width() >= (1 - 1e-9) * frame.sides().width(0);
}

PolygonOutline strips(const Frame& frame, const std::vector<Interval>& intervals) {
  PolygonOutline outline{.loops = {}, .rule = PolygonOutline::Rule::any};
  const double reach = strip_length * frame.spacing;
  for (const auto& [lower, upper] : intervals)
    outline.loops.push_back(box_loop({lower, -reach}, {upper, reach}));
  outline.is_section = true;
  return outline;
}

/// The intervals in which a line at y = 0 is within loops that do not overlap.
std::vector<Interval> along_axis(const std::vector<Loop>& loops) {
  std::vector<double> crossings;
  for (const Loop& loop : loops) {
    for (std::size_t p = 0; p < loop.size(); ++p) {
      const Point2& a = loop[p];
      const Point2& b = loop[(p + 1) % loop.size()];
      if ((a[1] > 0) == (b[1] > 0)) continue;
      crossings.push_back(a[0] - a[1] / (b[1] - a[1]) * (b[0] - a[0]));
    }
  }
  std::ranges::sort(crossings);
  std::vector<Interval> intervals;
  for (std::size_t n = 0; n + 1 < crossings.size(); n += 2)
    intervals.push_back({crossings[n], crossings[n + 1]});
  return intervals;
}

/// The layout seen along the line: x along it, y to its left.
PolygonOutline turned(PolygonOutline outline, const LineCut& line) {
  for (Loop& loop : outline.loops) {
    for (Point2& r : loop) {
      const Point2 away{r[0] - line.middle[0], r[1] - line.middle[1]};
      r = {away[0] * line.along[0] + away[1] * line.along[1],
           away[1] * line.along[0] - away[0] * line.along[1]};
    }
  }
  return outline;
}

/// A piece of the plane around the line, wide enough for what a sizing does on it.
Frame around_line(const Frame& frame, double reach) {
  Frame around = frame;
  around.two_dimensional = false;
  around.cells[1] = 2 * static_cast<int>(std::ceil(reach / frame.spacing) + 8);
  around.boundary[1] = Boundary::reflective;
  return around;
}

std::vector<Interval> meets(const Frame&, const SlotOutline& s, const LineCut& line) {
  std::vector<Interval> intervals;
  for (const Point2& centre : centres(s.repeat, {s.centre, s.centre}))
    intervals.push_back(within_slab(line, 1 - s.along, centre[1 - s.along], 0.5 * s.width));
  return intervals;
}
std::vector<Interval> meets(const Frame&, const CircleOutline& s, const LineCut& line) {
  std::vector<Interval> intervals;
  for (const Point2& centre : centres(s.repeat, s.centre))
    intervals.push_back(within_disc(line, centre, s.radius));
  return intervals;
}
std::vector<Interval> meets(const Frame&, const RectangleOutline& s, const LineCut& line) {
  std::vector<Interval> intervals;
  for (const Point2& centre : centres(s.repeat, s.centre))
    intervals.push_back(within_rectangle(line, s, centre));
  return intervals;
}
std::vector<Interval> meets(const Frame& frame, const PolygonOutline& s, const LineCut& line) {
  return along_axis(domain_loops(around_line(frame, s.sizing.reach()), turned(s, line)));
}

std::vector<Interval> shown(const Frame& frame, const Outline& outline, const LineCut& line) {
  return shown(frame,
               std::visit([&](const auto& each) { return meets(frame, each, line); }, outline));
}

/// The taper of a wall as the section shows it. sine: of the angle between wall and line.
double apparent(double taper, double sine) {
  return std::abs(sine) < least_sine ? taper : std::atan(std::tan(taper) / std::abs(sine));
}

/// Trenches for parts of the line. One whose middle lies beyond an end is mirrored there, or comes
/// back at the other end.
std::vector<Shape> trenches(const Frame& frame, const std::vector<Interval>& intervals,
                            const Cut& cut) {
  const Sides sides = frame.sides();
  const Interval section{sides.lower[0], sides.upper[0]};
  std::vector<Shape> shapes;
  for (const Interval& each : intervals) {
    const Interval part = common(each, section);
    if (!(part.width() > 1e-9 * section.width())) continue;
    TrenchShape trench{
        .width = each.width(), .centre = 0.5 * (each.lower + each.upper), .along = 1, .cut = cut};
    if (part.width() >= (1 - 1e-9) * section.width()) {
      trench = {.cut = cut, .is_everywhere = true};
    } else if (frame.boundary[0] == Boundary::periodic) {
      if (trench.centre < section.lower) trench.centre += section.width();
      if (trench.centre > section.upper) trench.centre -= section.width();
    } else if (trench.centre < section.lower || trench.centre > section.upper) {
      trench.centre = trench.centre < section.lower ? section.lower : section.upper;
      trench.width = 2 * part.width();
    }
    shapes.push_back(trench);
  }
  return shapes;
}

class Cutter {
 public:
  Cutter(const Frame& frame, const LineCut& line) : frame_(frame), line_(line) {}

  std::vector<Shape> operator()(const TrenchShape& s) const {
    Cut cut = s.cut;
    cut.taper = apparent(cut.taper, line_.along[1 - s.along]);
    return trenches(frame_, meets(frame_, slot(s), line_), cut);
  }
  std::vector<Shape> operator()(const HoleShape& s) const {
    return trenches(frame_, meets(frame_, CircleOutline{s.radius, s.centre, s.repeat}, line_),
                    s.cut);
  }
  std::vector<Shape> operator()(const FinShape& s) const {
    return film({.material = s.material,
                 .thickness = s.height,
                 .taper = apparent(s.taper, line_.along[1 - s.along]),
                 .outlines = MaskShape::Outlines::resist,
                 .outline = slot(s),
                 .is_ridge = true});
  }
  std::vector<Shape> operator()(const MaskShape& s) const { return film(s); }
  template <class Other>
  std::vector<Shape> operator()(const Other& s) const {
    return {s};
  }

 private:
  template <class Row>
  static SlotOutline slot(const Row& s) {
    return {.width = s.width, .centre = s.centre, .along = s.along, .repeat = s.repeat};
  }

  std::vector<Shape> film(MaskShape mask) const {
    const auto* const done = std::get_if<PolygonOutline>(&mask.outline);
    const bool is_cut = done != nullptr && done->is_section;
    const std::vector<Interval> parts =
        is_cut ? shown(frame_, *done, LineCut{}) : shown(frame_, mask.outline, line_);
    const bool is_opening = mask.outlines == MaskShape::Outlines::opening;
    const bool is_all = covers(frame_, parts);
    if (is_opening ? is_all : parts.empty()) return {};
    if (is_opening ? parts.empty() : is_all)
      return {LayerShape{.material = mask.material, .thickness = mask.thickness}};
    mask.outline = strips(frame_, parts);
    return {mask};
  }

  const Frame& frame_;
  const LineCut& line_;
};

}  // namespace

std::array<Point2, 2> box_around(const Frame& frame, const LineCut& line, double reach) {
  const Sides sides = frame.sides();
  const Point2 a = line.at(sides.lower[0]);
  const Point2 b = line.at(sides.upper[0]);
  std::array<Point2, 2> box{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    box[0][axis] = std::min(a[axis], b[axis]) - reach - 8 * frame.spacing;
    box[1][axis] = std::max(a[axis], b[axis]) + reach + 8 * frame.spacing;
  }
  return box;
}

PolygonOutline cut_outline(const Frame& frame, const Outline& outline, const LineCut& line) {
  return strips(frame, shown(frame, outline, line));
}

std::vector<Shape> cut_shape(const Frame& frame, const Shape& shape, const LineCut& line) {
  return std::visit(Cutter(frame, line), shape);
}

}  // namespace scarp

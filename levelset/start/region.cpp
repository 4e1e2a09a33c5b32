#include "levelset/start/region.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <polyclipping/clipper.hpp>
#include <utility>

namespace scarp {

namespace {

/// Mitred corners stay sharp where edges turn by less than this: right angles and somewhat beyond.
constexpr double least_mitre_cosine = -0.1;

/// Loops in whole units, as the library for them wants them.
class Integers {
 public:
  explicit Integers(double unit) : unit_(unit) {}

  ClipperLib::Path path(const Loop& loop) const {
    ClipperLib::Path path;
    path.reserve(loop.size());
    for (const auto& [x, y] : loop)
      path.emplace_back(std::llround(x / unit_), std::llround(y / unit_));
    return path;
  }

  Loop loop(const ClipperLib::Path& path) const {
    Loop loop;
    loop.reserve(path.size());
    for (const ClipperLib::IntPoint& point : path)
      loop.push_back({static_cast<double>(point.X) * unit_, static_cast<double>(point.Y) * unit_});
    return loop;
  }

  std::vector<Loop> loops(const ClipperLib::Paths& paths) const {
    std::vector<Loop> loops;
    loops.reserve(paths.size());
    for (const ClipperLib::Path& path : paths) loops.push_back(loop(path));
    return loops;
  }

 private:
  double unit_;
};

/// One loop after the other with two loops of which the second follows the first.
void add_part(const ClipperLib::PolyNode& outer, const Integers& integers,
              std::vector<std::vector<Loop>>& parts) {
  std::vector<Loop>& part = parts.emplace_back();
  part.push_back(integers.loop(outer.Contour));
  for (const ClipperLib::PolyNode* hole : outer.Childs)
    part.push_back(integers.loop(hole->Contour));
  for (const ClipperLib::PolyNode* hole : outer.Childs)
    for (const ClipperLib::PolyNode* island : hole->Childs) add_part(*island, integers, parts);
}

Point2 shifted(const Point2& r, const Point2& n, double by) {
  return {r[0] + by * n[0], r[1] + by * n[1]};
}

/// To the right of the way from a to b: outside a loop with the interior on the left.
Point2 outward(const Point2& a, const Point2& b) {
  const double x = b[0] - a[0];
  const double y = b[1] - a[1];
  const double norm = std::sqrt(x * x + y * y);
  return {y / norm, -x / norm};
}

}  // namespace

std::vector<Loop> RegionGrid::untangled(Loop loop) const {
  if (loop.size() == 3) {
    if (area(std::span(&loop, 1)) < 0) std::reverse(loop.begin(), loop.end());
    return {std::move(loop)};
  }
  const Integers integers(unit_);
  ClipperLib::Paths result;
  ClipperLib::SimplifyPolygon(integers.path(loop), result, ClipperLib::pftNonZero);
  return integers.loops(result);
}

std::vector<Loop> RegionGrid::united(std::span<const Loop> loops) const {
  // Each by itself first: where one crosses itself or goes the other way, others do not cancel it.
  const Integers integers(unit_);
  ClipperLib::Clipper clipper(ClipperLib::ioStrictlySimple);
  for (const Loop& loop : loops)
    for (const Loop& simple : untangled(loop))
      clipper.AddPath(integers.path(simple), ClipperLib::ptSubject, true);
  ClipperLib::Paths result;
  clipper.Execute(ClipperLib::ctUnion, result, ClipperLib::pftNonZero, ClipperLib::pftNonZero);
  return integers.loops(result);
}

std::vector<Loop> RegionGrid::clipped(const std::vector<Loop>& loops, const Loop& box,
                                      Fill fill) const {
  const Integers integers(unit_);
  ClipperLib::Clipper clipper(ClipperLib::ioStrictlySimple);
  for (const Loop& loop : loops)
    if (may_meet(loop, box)) clipper.AddPath(integers.path(loop), ClipperLib::ptSubject, true);
  clipper.AddPath(integers.path(box), ClipperLib::ptClip, true);
  ClipperLib::Paths result;
  clipper.Execute(ClipperLib::ctIntersection, result,
                  fill == Fill::even_odd ? ClipperLib::pftEvenOdd : ClipperLib::pftNonZero,
                  ClipperLib::pftNonZero);
  return integers.loops(result);
}

std::vector<Loop> RegionGrid::combined(const std::vector<Loop>& a, const std::vector<Loop>& b,
                                       Combination how) const {
  const Integers integers(unit_);
  ClipperLib::Clipper clipper(ClipperLib::ioStrictlySimple);
  for (const Loop& loop : a) clipper.AddPath(integers.path(loop), ClipperLib::ptSubject, true);
  for (const Loop& loop : b) clipper.AddPath(integers.path(loop), ClipperLib::ptClip, true);
  ClipperLib::Paths result;
  clipper.Execute(how == Combination::sum          ? ClipperLib::ctUnion
                  : how == Combination::difference ? ClipperLib::ctDifference
                                                   : ClipperLib::ctIntersection,
                  result, ClipperLib::pftNonZero, ClipperLib::pftNonZero);
  return integers.loops(result);
}

std::vector<std::vector<Loop>> RegionGrid::parts(const std::vector<Loop>& region) const {
  const Integers integers(unit_);
  ClipperLib::Clipper clipper(ClipperLib::ioStrictlySimple);
  for (const Loop& loop : region) clipper.AddPath(integers.path(loop), ClipperLib::ptSubject, true);
  ClipperLib::PolyTree tree;
  clipper.Execute(ClipperLib::ctUnion, tree, ClipperLib::pftNonZero, ClipperLib::pftNonZero);
  std::vector<std::vector<Loop>> parts;
  for (const ClipperLib::PolyNode* outer : tree.Childs) add_part(*outer, integers, parts);
  return parts;
}

/// What an edge's end becomes where two edges with these outward normals meet.
void RegionGrid::add_corner(const Point2& at, const Point2& before, const Point2& after, double by,
                            bool is_round, Loop& loop) const {
  const double cosine = before[0] * after[0] + before[1] * after[1];
  loop.push_back(shifted(at, before, by));
  if (before[0] * after[1] - before[1] * after[0] <= 0) {
    // An inner corner: moved edges cross, and what is wound the other way is cut off there.
    loop.push_back(at);
  } else if (!is_round && cosine > least_mitre_cosine) {
    loop.back() = shifted(at, {before[0] + after[0], before[1] + after[1]}, by / (1 + cosine));
    return;
  } else {
    add_arc(at, before, after, by, loop);
  }
  loop.push_back(shifted(at, after, by));
}

/// Halved until it is as good as round: a mirrored corner gets mirrored points, and square roots
/// are the same everywhere.
void RegionGrid::add_arc(const Point2& at, const Point2& before, const Point2& after, double by,
                         Loop& loop) const {
  const double x = before[0] + after[0];
  const double y = before[1] + after[1];
  const double norm = std::sqrt(x * x + y * y);
  if (!(norm > 0) || by * (1 - 0.5 * norm) <= tolerance_) return;
  const Point2 middle{x / norm, y / norm};
  add_arc(at, before, middle, by, loop);
  loop.push_back(shifted(at, middle, by));
  add_arc(at, middle, after, by, loop);
}

/// Loops whose edges are moved outwards, and what they surround counterclockwise.
std::vector<Loop> RegionGrid::grown(const std::vector<Loop>& region, double by, bool is_round,
                                    const Loop& box) const {
  const Integers integers(unit_);
  ClipperLib::Clipper clipper(ClipperLib::ioStrictlySimple);
  for (const Loop& loop : region) {
    const std::size_t count = loop.size();
    Loop moved;
    for (std::size_t p = 0; p < count; ++p) {
      const Point2& at = loop[p];
      add_corner(at, outward(loop[(p + count - 1) % count], at), outward(at, loop[(p + 1) % count]),
                 by, is_round, moved);
    }
    clipper.AddPath(integers.path(moved), ClipperLib::ptSubject, true);
  }
  clipper.AddPath(integers.path(box), ClipperLib::ptClip, true);
  ClipperLib::Paths result;
  clipper.Execute(ClipperLib::ctIntersection, result, ClipperLib::pftPositive,
                  ClipperLib::pftNonZero);
  return integers.loops(result);
}

std::vector<Loop> RegionGrid::shrunk(const std::vector<Loop>& region, double by, bool is_round,
                                     const Loop& box) const {
  const std::vector<Loop> outside = combined({box}, region, Combination::difference);
  // Not around the box: what lies on its edge goes on beyond it.
  return combined(region, grown(outside, by, is_round, box), Combination::difference);
}

std::vector<Loop> RegionGrid::sized(std::vector<Loop> region, const Loop& box,
                                    const Sizing& sizing) const {
  if (sizing.grow > 0) region = grown(region, sizing.grow, sizing.is_round, box);
  if (sizing.grow < 0) region = shrunk(region, -sizing.grow, sizing.is_round, box);
  const double radius = sizing.corner_radius;
  if (radius <= 0) return region;
  region = grown(shrunk(region, radius, true, box), radius, true, box);
  return shrunk(grown(region, radius, true, box), radius, true, box);
}

SizingLosses RegionGrid::losses(const std::vector<Loop>& region, const Loop& box,
                                const Loop& window, const Sizing& sizing) const {
  SizingLosses losses;
  const auto count = [&](const std::vector<Loop>& whole, double by, std::size_t& all,
                         std::size_t& lost) {
    for (const std::vector<Loop>& part : parts(whole)) {
      if (!may_meet(part.front(), window) || clipped(part, window, Fill::non_zero).empty())
        continue;
      ++all;
      if (by > 0 && shrunk(part, by, true, box).empty()) ++lost;
    }
  };
  count(region, sizing.corner_radius - sizing.grow, losses.shapes, losses.vanished);
  count(combined({box}, region, Combination::difference), sizing.corner_radius + sizing.grow,
        losses.gaps, losses.closed);
  return losses;
}

Loop box_loop(const Point2& lower, const Point2& upper) {
  return {lower, {upper[0], lower[1]}, upper, {lower[0], upper[1]}};
}

bool may_meet(const Loop& loop, const Loop& box) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto by_axis = [&](const Point2& a, const Point2& b) { return a[axis] < b[axis]; };
    const auto [least, most] = std::minmax_element(loop.begin(), loop.end(), by_axis);
    if ((*most)[axis] < box[0][axis] || (*least)[axis] > box[2][axis]) return false;
  }
  return true;
}

double area(std::span<const Loop> loops) {
  double twice = 0;
  for (const Loop& loop : loops) {
    for (std::size_t p = 0; p < loop.size(); ++p) {
      const Point2& a = loop[p];
      const Point2& b = loop[(p + 1) % loop.size()];
      twice += a[0] * b[1] - a[1] * b[0];
    }
  }
  return 0.5 * twice;
}

}  // namespace scarp

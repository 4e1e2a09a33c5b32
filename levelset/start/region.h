#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace scarp {

using Point2 = std::array<double, 2>;

/// A closed polygon; the last point is joined to the first.
using Loop = std::vector<Point2>;

/// How an outline changes before it is drawn, as a layout tool or the lithography would change it.
/// The bias acts first.
///
/// Units: nm.
struct Sizing {
  /// Every edge moves outwards by it; inwards if it is negative.
  double grow = 0;
  /// Corners that a bias moves outwards are arcs; else they stay sharp up to right angles.
  bool is_round = false;
  /// Corners become arcs of at least this radius: an opening and then a closing by a disc.
  double corner_radius = 0;

  bool is_none() const { return grow == 0 && corner_radius == 0; }
  /// What is further away than this from a place has no effect there.
  double reach() const { return (grow < 0 ? -grow : grow) + 4 * corner_radius; }
};

/// What a sizing leaves nothing of.
struct SizingLosses {
  std::size_t shapes = 0;
  std::size_t vanished = 0;
  std::size_t gaps = 0;
  std::size_t closed = 0;
};

/// Loops on a grid of a fine unit, as regions of the plane. Results are loops that neither cross
/// nor touch except at points, interior on the left.
///
/// Units:  nm.
/// Source: Vatti 1992, as the Clipper library has it.
class RegionGrid {
 public:
  enum class Fill { even_odd, non_zero };
  enum class Combination { sum, difference, intersection };

  /// tolerance: how far arcs may be from the round.
  RegionGrid(double unit, double tolerance) : unit_(unit), tolerance_(tolerance) {}

  /// What a loop surrounds, whichever way and however often.
  std::vector<Loop> untangled(Loop loop) const;

  /// What any loop surrounds, whichever way.
  std::vector<Loop> united(std::span<const Loop> loops) const;

  /// The part of what loops surround that lies in a box.
  std::vector<Loop> clipped(const std::vector<Loop>& loops, const Loop& box, Fill fill) const;

  /// Of two regions.
  std::vector<Loop> combined(const std::vector<Loop>& a, const std::vector<Loop>& b,
                             Combination how) const;

  /// The parts of a region, each with its holes.
  std::vector<std::vector<Loop>> parts(const std::vector<Loop>& region) const;

  /// A region in a box with other corners; what lies beyond the box goes on as within it.
  std::vector<Loop> sized(std::vector<Loop> region, const Loop& box, const Sizing& sizing) const;

  /// Of the parts of a region, and of the gaps between them in a box, those that sized() leaves
  /// nothing of, and how many there are; all that lie in the window.
  SizingLosses losses(const std::vector<Loop>& region, const Loop& box, const Loop& window,
                      const Sizing& sizing) const;

 private:
  std::vector<Loop> grown(const std::vector<Loop>& region, double by, bool is_round,
                          const Loop& box) const;
  std::vector<Loop> shrunk(const std::vector<Loop>& region, double by, bool is_round,
                           const Loop& box) const;
  void add_corner(const Point2& at, const Point2& before, const Point2& after, double by,
                  bool is_round, Loop& loop) const;
  void add_arc(const Point2& at, const Point2& before, const Point2& after, double by,
               Loop& loop) const;

  double unit_;
  double tolerance_;
};

/// The corners of an upright box, counterclockwise from the lower one.
Loop box_loop(const Point2& lower, const Point2& upper);

/// False if the loop lies wholly on one side of the box and changes nothing in it.
bool may_meet(const Loop& loop, const Loop& box);

/// Area enclosed by loops with the interior on the left.
double area(std::span<const Loop> loops);

}  // namespace scarp

#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "levelset/metrology/cross_section.h"

namespace scarp {

// Metrology of one opening in one cross-section: docs/metrology.md has the definitions.
//
// Units: lateral positions and heights in nm, angles in rad.

/// The gas between two walls at one height.
struct Gap {
  double left = 0;
  double right = 0;

  double width() const { return right - left; }
};

/// A width and where it is.
struct WidthAt {
  double width = 0;
  double height = 0;
};

/// The surface of an opening in a cross-section, from the field on its left to that on its right,
/// with the gas on its left.
class Contour {
 public:
  using Point = std::array<double, 2>;

  /// The gap at the height by which the contour was found, for widths half-way down to its floor,
  /// and the first and the last point below it.
  struct Mouth {
    Gap gap;
    double height = 0;
    std::size_t first = 0;
    std::size_t last = 0;
  };

  Contour(std::vector<Point> points, const Mouth& mouth);

  const std::vector<Point>& points() const { return points_; }

  /// Nothing where no gas lies between two walls. Above the mouth it is the gap that overlaps most
  /// with it; below, what rises from the floor is no wall.
  std::optional<Gap> gap(double height) const;

  Point lowest() const;

  /// Height of the floor at a lateral position.
  std::optional<double> floor(double lateral) const;

  /// What lies before the lowest point, from the field downwards, and behind it, from there
  /// upwards.
  std::span<const Point> left_side() const;
  std::span<const Point> right_side() const;

  /// The outer walls from the fields down to a height below the mouth.
  std::span<const Point> left_wall(double lowest) const;
  std::span<const Point> right_wall(double lowest) const;

 private:
  /// Heights of some of the points, one after the other, of which the last is the next one's first.
  struct Stretch {
    double lowest = 0;
    double highest = 0;
  };

  std::size_t lowest_index() const;

  std::vector<Point> points_;
  Mouth mouth_;
  std::vector<Stretch> stretches_;
};

/// The contour whose gap at a height holds a lateral position, cut off at the fields; nothing where
/// the lines have no such gap.
std::optional<Contour> find_contour(std::span<const Polyline> lines, double lateral, double height,
                                    std::array<double, 2> fields);

/// The walls of an opening at evenly spaced heights, from the highest down; heights without a gap
/// are left out.
struct Walls {
  std::vector<double> heights;
  std::vector<double> left;
  std::vector<double> right;
};
Walls sample_walls(const Contour& contour, double highest, double lowest, double spacing);

/// A straight line through a wall by least squares: lateral = at_zero + slope * height.
struct WallFit {
  double at_zero = 0;
  double slope = 0;
  double deviation = 0;  ///< root mean square

  double lateral(double height) const { return at_zero + slope * height; }
};
/// Nothing for less than two heights.
std::optional<WallFit> fit_wall(std::span<const double> heights, std::span<const double> laterals);

/// The widest and the narrowest gap; the height is that of the vertex of a parabola through the
/// gaps around it, where it has one.
std::optional<WidthAt> widest(const Walls& walls);
std::optional<WidthAt> narrowest(const Walls& walls);

/// Scallops of one wall between two heights. Cusps are where it comes farthest into the gas; as no
/// grid holds their tips, a scallop is as deep as the arc of the circle through it over its pitch,
/// where it is one.
struct Scallops {
  double pitch = 0;      ///< from one to the next
  double amplitude = 0;  ///< how deep a scallop lies behind the line between its cusps
};
/// Nothing where fewer than three cusps rise by a quarter of a spacing.
std::optional<Scallops> scallops(std::span<const Contour::Point> wall, double highest,
                                 double lowest, double spacing);

/// How wide the slope is at the upper edge of a wall, from the field to the wall below: what falls
/// at 15 to 75 degrees before the wall falls more steeply for a length of two spacings. A straight
/// slope of more than four spacings reaches as far as the line through it, as edges are cut off by
/// the mesh; a round one is that part of its circle. Nothing where the wall never gets steep.
///
/// Shape: the wall from the field downwards.
std::optional<double> facet_width(std::span<const Contour::Point> wall, double field,
                                  double spacing);

/// How much gas lies straight above a height, up to another one: in voids.
double gas_above(std::span<const Polyline> lines, double lateral, double lower, double upper);

/// How far points are from lines.
class DistanceToLines {
 public:
  explicit DistanceToLines(std::span<const Polyline> lines);

  /// Infinite without lines.
  double operator()(const Contour::Point& point) const;

 private:
  using Point = Contour::Point;

  // Some of a line, whose points share all but one with the next, and the box around it.
  struct Stretch {
    std::span<const Point> points;
    Point lower;
    Point upper;
  };

  std::vector<Stretch> stretches_;
};

}  // namespace scarp

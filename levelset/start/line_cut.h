#pragma once

#include <optional>
#include <vector>

#include "core/frame.h"
#include "levelset/start/shapes.h"

namespace scarp {

/// The line through a layout along which a section lies: its middle is x = 0 of the section.
///
/// Units: nm; along has length 1.
struct LineCut {
  Point2 middle{};
  Point2 along{1, 0};

  Point2 at(double x) const { return {middle[0] + x * along[0], middle[1] + x * along[1]}; }
};

/// Corners of a box around all that has a part in the section: the line within the frame, and what
/// is near it.
std::array<Point2, 2> box_around(const Frame& frame, const LineCut& line, double reach);

/// What the line meets of an outline: strips that are endless across the section.
PolygonOutline cut_outline(const Frame& frame, const Outline& outline, const LineCut& line);

/// What the line meets of a shape, as shapes of the section: none where it misses it. Trenches and
/// holes become trenches, ridges and masks become masks, or a layer where they cover all. A taper
/// is that of the wall in the section, of holes the one through the axis.
///
/// Shape: a mask's outline may be cut before.
std::vector<Shape> cut_shape(const Frame& frame, const Shape& shape, const LineCut& line);

}  // namespace scarp

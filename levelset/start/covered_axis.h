#pragma once

#include <optional>

#include "core/frame.h"
#include "levelset/start/shapes.h"

namespace scarp {

/// By how much a rectangle reaches further than the sides of the domain along an axis, at the worse
/// end; below 0 where it ends within. What the sides bring back counts as part of it.
///
/// Units: nm. growth: by how much its walls lie further out at the top than at the foot.
double reach_beyond_sides(const Frame& frame, const RectangleOutline& rectangle, int axis,
                          double growth);

/// The axis along which a rectangle goes from side to side, at all heights and with its corners
/// beyond the sides: a slot, in one piece with its images.
std::optional<int> covered_axis(const Frame& frame, const RectangleOutline& rectangle,
                                double growth);

}  // namespace scarp

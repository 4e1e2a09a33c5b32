#pragma once

#include <span>

#include "levelset/grid/layers.h"
#include "levelset/start/shapes.h"

namespace scarp {

/// What shapes stand on.
Ground ground_of(const Layers& layers);

/// Applies shapes to layers, one after the other, as build_layers does to a wafer: each stands on
/// the highest point of the surface, and fills gas that is joined to the source. Closed voids stay
/// closed unless a cut opens them. What no shape changes keeps its bits.
///
/// Shape: without a problem of check_shapes_on. Solid may be left that nothing joins to the wafer
///        (see remove_islands).
void place_shapes(Layers& layers, std::span<const Shape> shapes);

/// What lies over and under an outline, with upright walls, wherever layers have a surface; or what
/// lies beside it.
LevelSet outline_columns(const Layers& layers, const Outline& outline, MaskShape::Outlines kind);

}  // namespace scarp

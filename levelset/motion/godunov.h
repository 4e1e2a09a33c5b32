#pragma once

#include <cstddef>

#include "core/vec3.h"
#include "levelset/motion/speed_field.h"

namespace scarp {

/// V |grad phi| at a node by Godunov's scheme, for rates of crystals: where the difference to the
/// neighbour before is below that to the neighbour behind the least value between the two, else the
/// largest, axis by axis.
///
/// Between a floor and a wall lie normals whose planes etch a hundred times as fast as the wall.
/// Where the solid is concave the slowest plane between the two counts, to the last digit of its
/// rate, and where it is convex the fastest: so no dissipation is needed, which would blunt
/// corners. Values are looked for at both ends, at all cusps of the rates, and where the ends are
/// far apart at three places between them.
///
/// Where x asks for the least and y for the largest the order of the two counts. Both orders are a
/// scheme, and so is their mean, which is the same when x and y are exchanged.
///
/// Source: Bardi and Osher 1991 (the nonconvex multidimensional Riemann problem).
float godunov_rate(const SpeedField& field, std::size_t node, Vec3f backward, Vec3f forward);

}  // namespace scarp

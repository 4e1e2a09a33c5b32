#pragma once

#include <vector>

#include "levelset/grid/level_set.h"
#include "levelset/metrology/cross_section.h"

namespace scarp {

/// Lines in which an upright plane cuts the facets of a level set, bent as its surface is.
///
/// Points of walls go sideways from where phi is 0 by linear interpolation to where it is by
/// parabolas along x and y, and segments become arcs where grad phi turns along them. Facets lie
/// within an arc by up to a fifth of a spacing squared over its radius, by as much as depends on
/// where the nodes lie; what remains is third order in the spacing. At edges second differences, or
/// turns at both ends, do not agree, and lines stay as they are.
///
/// Units: nm.
std::vector<Polyline> bent(std::vector<Polyline> lines, const CutPlane& plane, const LevelSet& phi);

}  // namespace scarp

#pragma once

#include "levelset/grid/level_set.h"

namespace scarp {

/// Takes away sheets, which have no thickness: where solids that were put together meet, or the
/// gas of cuts that meet, phi is next to zero amid solid or amid gas, or even has the other sign.
/// A film that grew there would close what is open, an etch would open what is closed.
///
/// phi is the distance to what is left then, as redistance_fully finds it; where there are no
/// sheets, and next to the surface, no bit changes.
///
/// Cost: a look at the neighbours of nodes next to the surface; with sheets that of
/// redistance_fully.
void remove_sheets(LevelSet& phi);

}  // namespace scarp

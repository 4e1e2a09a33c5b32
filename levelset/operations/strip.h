#pragma once

#include "levelset/grid/layers.h"

namespace scarp {

/// Takes a material away at once, but for the wafer itself: all of it that gas from the source
/// reaches, on its way through this material as well, or with buried = true all there is.
///
/// Gas follows films thinner than a spacing only where they are exposed. Where another material
/// thinner than that covers it from the gas, it is buried. Films of other materials that are left
/// standing free and are thinner than a spacing may be lost: no grid holds them. Solid may be left
/// that nothing joins to the wafer (see remove_islands).
///
/// Cost: for each layer of the material that of open_gas and redistance_fully.
void strip(Layers& layers, MaterialId material, bool buried);

}  // namespace scarp

#pragma once

#include "levelset/grid/layers.h"

namespace scarp {

/// Takes a material away at once, but for the wafer itself: all of it that gas from the source
/// reaches, on its way through this material as well, or with buried = true all there is.
///
/// Gas follows films thinner than a spacing as well, down to a hundredth of one, from where they
/// are exposed on: also at an edge between two other materials that no edge of the grid cuts. Where
/// another material thinner than a spacing covers it from the gas, it is buried. Films of other
/// materials that are left standing free and are thinner than a spacing may be lost: no grid holds
/// them. Solid may be left that nothing joins to the wafer (see remove_islands).
///
/// No material grows, but for up to two spacings squared along each edge of a gap, and 6.5 where
/// several films thinner than 1.5 spacings meet. What is gone leaves gas, also where it was thinner
/// than a spacing: what lay on it is parted from what lies below. Where that stays, because
/// something else holds it or with keep_free = true, the gap is as wide as the film was, and less
/// than a spacing from its place.
///
/// Returns whether there were such gaps. Without keep_free, what is free then is not whole any
/// more.
///
/// Cost: for each layer of the material that of open_gas and redistance_fully; twice that where
/// films thinner than a spacing leave gaps.
bool strip(Layers& layers, MaterialId material, bool buried, bool keep_free = false);

}  // namespace scarp

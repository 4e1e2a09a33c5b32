#pragma once

#include <cstddef>
#include <span>

#include "levelset/grid/layers.h"
#include "levelset/operations/thin_gaps.h"

namespace scarp {

// Layers as sets of points: joined with other solid, and cut by it.

/// All open gas within a solid becomes solid of the top layer (see add_layer). Closed voids stay as
/// they are to the last bit.
///
/// Shape: the solid is on the grid of the layers; only open gas has to be above its surface.
void fill_gas(Layers& layers, const LevelSet& solid);

/// Of what the top layer has more than an earlier one, only what lies within a solid stays.
void keep_within(Layers& layers, const LevelSet& earlier, const LevelSet& solid);

/// Takes away the materials of layers first..last, where they lie outside a solid if there is one:
/// layers below stay, layers above lose only what is no material of their own.
///
/// Solid may be left that nothing joins to the wafer (see remove_islands).
/// gaps: what parts the layers above from those below where no node lies in between.
void take_away(Layers& layers, std::size_t first, std::size_t last, const LevelSet* kept = nullptr,
               std::span<const GapNode> gaps = {});

/// The top layer as if the materials of layers first..last were gas.
LevelSet top_without(const Layers& layers, std::size_t first, std::size_t last);

/// Whether two surfaces are nowhere further apart than a thousandth of a spacing.
bool is_same_surface(const LevelSet& a, const LevelSet& b);

}  // namespace scarp

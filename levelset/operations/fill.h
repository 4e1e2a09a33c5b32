#pragma once

#include <optional>
#include <span>

#include "levelset/grid/layers.h"

namespace scarp {

/// Where a fill goes.
struct FillPlaces {
  /// Only openings that no disc of this diameter, level with the wafer, fits into; each height by
  /// itself. Nothing: everywhere. Units: nm.
  std::optional<double> narrower_than{};
  /// Only over these materials: where one of them is the first solid straight below. Empty: all.
  std::span<const MaterialId> on{};
};

/// Fills open gas up to a height with solid of the top layer (see add_layer), flat on top. Closed
/// voids stay closed.
///
/// Units: nm.
/// Errors: sides that are no walls, where an opening widens or a material ends, to half a spacing.
/// Cost:   of narrower_than, per node below the height as many steps as its diameter has spacings.
void fill(Layers& layers, double height, const FillPlaces& places = {});

}  // namespace scarp

#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/simulator/state.h"

namespace scarp {

// Closed voids and loose pieces of solid, as run and preview report them.

/// Units: nm^3.
double volume_of(std::span<const Region> regions);

/// With the mirror images of each.
std::size_t count_of(std::span<const Region> regions);

/// "1 void", "2 voids".
std::string counted(std::size_t count, std::string_view what);

/// Solid of the start geometry that was left out; empty if there was none.
std::string loose_solid_text(const Frame& frame, const RemovedSolid& islands);

/// Sizes and heights, a line each; only the first few, as a closing seam may leave many at once.
std::vector<std::string> region_lines(const Frame& frame, std::span<const Region> regions);

}  // namespace scarp

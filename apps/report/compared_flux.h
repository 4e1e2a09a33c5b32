#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "apps/report/comparison.h"

namespace scarp {

/// The fluxes in the surface files of two groups of runs, along the profile of a reference. Nothing
/// where a surface has no flux, as of single states. Times are left open.
std::vector<ComparedFlux> compare_fluxes(
    const std::array<std::vector<std::filesystem::path>, 2>& surfaces, const Snapshot& reference);

}  // namespace scarp

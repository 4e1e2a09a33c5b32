#pragma once

#include <optional>

#include "levelset/metrology/metrology.h"
#include "levelset/metrology/openings.h"
#include "levelset/metrology/wafer_surfaces.h"

namespace scarp {

/// Films thinner than this have no ratios. Units: spacings.
inline constexpr double least_film = 0.01;

/// Nothing where one of them is not known, or the second is no more than so much.
std::optional<double> ratio(std::optional<double> a, std::optional<double> b, double least);

/// Measures one opening in the plane r[axis] = position, in which it lies as the row says.
OpeningMetrology measure_section(const WaferSurfaces& surfaces, const MetrologyOptions& options,
                                 int axis, double position, const OpeningRow& row);

}  // namespace scarp

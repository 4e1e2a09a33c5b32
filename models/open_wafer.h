#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/angular_factor.h"
#include "models/surface_model.h"

namespace scarp {

/// How fast an open flat wafer of each material moves, > 0 grows; what comes from the surface
/// itself is left out.
///
/// Units: nm/s.
std::vector<float> open_wafer_speeds(const SurfaceModel& model, std::size_t material_count);

/// About how many time steps a model takes in a time, at the speed of a surface that sees the whole
/// source. Factors are the model's own. Units: s; nm that the surface moves in one.
double open_wafer_time_steps(const SurfaceModel& model, std::span<const AngularFactor> factors,
                             std::size_t material_count, double duration, double longest_move);

}  // namespace scarp

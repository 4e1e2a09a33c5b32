#pragma once

#include "core/frame.h"
#include "core/recipe/recipe_table.h"
#include "models/surface_model.h"

namespace scarp {

/// Notes in the table of a step what its domain takes for symmetric and is not: a source or a
/// crystal that reflective sides would mirror, or that is not the same all around an axis.
void refuse_asymmetry(const RecipeTable& step, const SurfaceModel& model, const Frame& frame);

}  // namespace scarp

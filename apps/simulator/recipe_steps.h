#pragma once

#include "apps/simulator/recipe.h"
#include "core/recipe/recipe_table.h"

namespace scarp {

/// Reads the tables [[step]] of a recipe whose start geometry is known: the steps with repeats
/// written out, and the materials that occur.
void read_steps(const RecipeTable& root, Recipe& recipe);

}  // namespace scarp

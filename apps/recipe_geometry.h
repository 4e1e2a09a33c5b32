#pragma once

#include <vector>

#include "core/material.h"
#include "core/recipe_table.h"
#include "levelset/shapes.h"

namespace scarp {

/// Reads the tables [[geometry]], from the bottom up.
std::vector<Shape> read_geometry(std::span<const RecipeTable> tables, const Materials& materials);

}  // namespace scarp

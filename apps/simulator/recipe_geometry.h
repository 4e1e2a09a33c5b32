#pragma once

#include <filesystem>
#include <vector>

#include "core/material.h"
#include "core/recipe/recipe_table.h"
#include "levelset/start/shapes.h"

namespace scarp {

/// Reads the tables [[geometry]], from the bottom up. Files that they name are looked for in the
/// folder of the recipe; of layouts what may reach into the domain is taken.
std::vector<Shape> read_geometry(std::span<const RecipeTable> tables, const Materials& materials,
                                 const Frame& frame, const std::filesystem::path& folder);

}  // namespace scarp

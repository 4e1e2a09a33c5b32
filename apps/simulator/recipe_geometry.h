#pragma once

#include <span>
#include <vector>

#include "core/material.h"
#include "core/recipe/recipe_table.h"
#include "levelset/start/shapes.h"

namespace scarp {

/// Reads the tables [[geometry]], from the bottom up; of layouts what may reach into the domain is
/// taken.
std::vector<Shape> read_geometry(std::span<const RecipeTable> tables, const Materials& materials,
                                 const Frame& frame);

/// Reads a mask with its outline from a table of the geometry, or of a step.
MaskShape read_mask(const RecipeTable& table, const Materials& materials, const Frame& frame);

}  // namespace scarp

#pragma once

#include <optional>
#include <span>

#include "apps/simulator/recipe.h"
#include "core/material.h"
#include "core/recipe/recipe_table.h"
#include "levelset/start/line_cut.h"

namespace scarp {

/// Where shapes are drawn.
struct GeometryScope {
  const Materials& materials;
  const Frame& frame;
  std::optional<LineCut> cut{};  ///< the frame is a section through a layout, along this line
};

/// Reads the tables [[geometry]], from the bottom up; of layouts what may reach into the domain is
/// taken.
StartGeometry read_geometry(std::span<const RecipeTable> tables, const GeometryScope& scope);

/// Reads a mask with its outline from a table of the geometry, or of a step.
MaskShape read_mask(const RecipeTable& table, const GeometryScope& scope);

}  // namespace scarp

#pragma once

#include <string>
#include <string_view>

#include "core/material.h"
#include "core/recipe/recipe_table.h"

namespace scarp {

/// What heads lines of tables and pictures: one line without control characters that no spreadsheet
/// takes for a formula. An error of the table otherwise.
std::string read_name(const RecipeTable& table, std::string_view key, std::string_view fallback);

/// Adds the materials of the table [materials].
void read_materials(const RecipeTable& table, Materials& materials);

}  // namespace scarp

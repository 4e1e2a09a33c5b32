#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "apps/simulator/recipe.h"
#include "core/recipe/recipe_table.h"

namespace scarp {

/// In spacings: what is narrower is not resolved.
inline constexpr double least_feature_width = 5;

/// Notes in the table of a whole recipe what is allowed, but too coarse for what it asks of the
/// grid: features less than 5 spacings wide; layers and films of less than 2, where they are etched
/// or grown; facets that may become longer than half an opening is wide. Also bodies of meshes that
/// add or cut nothing. An error is a film thinner
/// than a spacing that is sure to lose what holds it.
void judge_coarseness(const RecipeTable& root, const Recipe& recipe);

/// A mask that a step uses up, and what to say of it.
struct UsedMask {
  std::size_t step = 0;
  std::string text;
};

/// Masks whose flat tops are etched away before the last step that etches them ends, on an open
/// flat wafer.
///
/// ends: when steps with an end condition are expected to end, by their numbers; those that are not
/// there do not count. Units: s from their beginning.
std::vector<UsedMask> used_masks(std::span<const Shape> start, std::span<const ProcessStep> steps,
                                 const Materials& materials,
                                 const std::map<std::size_t, double>& ends = {});

}  // namespace scarp

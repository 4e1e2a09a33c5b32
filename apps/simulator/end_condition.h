#pragma once

#include <array>
#include <optional>
#include <string>

#include "core/material.h"
#include "core/recipe/recipe_table.h"
#include "levelset/grid/layers.h"

namespace scarp {

/// What ends a step of a recipe before its longest time, measured on the surface that gas from the
/// source reaches.
///
/// Heights are those of its lowest point (depth), of its highest one (thickness), or, with a place,
/// of the surface that is seen there from above.
///
/// Units: nm; over_etch in parts of the time from the beginning of the step until the condition
///        holds.
struct EndCondition {
  enum class Kind {
    depth,      ///< the surface lies lower by this than when the step began; of a material: the
                ///< surface of it lies this far below its highest point when the step began
    thickness,  ///< the surface lies higher by this than when the step began
    exposed,    ///< the material is seen
    gone,       ///< the material is not seen any more
  };
  Kind kind = Kind::depth;
  double length = 0;  ///< of depth and thickness
  std::optional<MaterialId> material{};
  std::optional<std::array<double, 2>> place{};
  double over_etch = 0;
};

/// "depth", "thickness", "exposed" or "gone": the key that a recipe has.
std::string name_of(EndCondition::Kind kind);

/// What it waits for, for messages: "a depth of 2 um in Si", "Si exposed at (1 um, 0 nm)".
std::string text_of(const EndCondition& condition, const Materials& materials, const Frame& frame);

/// ", and 20 % of over-etch"; empty where there is none.
std::string over_etch_text(const EndCondition& condition);

/// The height that depth or thickness counts from, at the beginning of a step. Units: nm.
std::optional<double> start_height(const EndCondition& condition, const Layers& layers);

/// The way that is left until the condition holds, at most 0 when it does; infinite where there is
/// no surface to measure on. Of a material that is to be seen, or not, the sign alone has a
/// meaning.
///
/// Units: nm. Cost: as extract_surface.
double distance_left(const EndCondition& condition, std::optional<double> start,
                     const Layers& layers);

/// Conditions whose distance_left is a length, and shrinks steadily.
bool is_length(const EndCondition& condition);

/// Reads the table `until` of a step. Errors are noted in the recipe; which materials the step can
/// meet is not looked at.
EndCondition read_end_condition(const RecipeTable& until, const Materials& materials,
                                const Frame& frame);

}  // namespace scarp

#pragma once

#include <array>
#include <string>

#include "apps/recipe.h"
#include "apps/state.h"

namespace scarp {

/// The planes across x and y in the middle of the domain that mirror a recipe's start onto itself
/// and all that its steps do.
///
/// Only between reflective sides: a process on them is its own mirror image, or the recipe would
/// have been refused. What is left is the start geometry, which has to be the same to the last bit,
/// and maps of sources.
struct MirrorPlanes {
  std::array<bool, 2> across{};
  std::array<std::string, 2> hindrance{};  ///< why there is none, where there is none
};
MirrorPlanes mirror_planes(const Recipe& recipe);

/// What a recipe makes of its mirror planes, or could; empty in two dimensions without one.
std::string symmetry_text(const Recipe& recipe, const MirrorPlanes& planes);

/// The recipe on the half or quarter of its domain beyond the planes of symmetry, where it asks for
/// them; as it is otherwise.
Recipe on_part(const Recipe& recipe, const MirrorPlanes& planes);

/// The part of a state beyond planes of symmetry, without what is known on facets.
State half_of(const State& whole, std::array<bool, 2> planes);

/// All of the wafer of which a state may hold the half. Its voids have to be looked for anew.
State whole_of(State state);

}  // namespace scarp

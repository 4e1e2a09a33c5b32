#pragma once

#include <array>
#include <string>

#include "apps/simulator/recipe.h"
#include "apps/simulator/state.h"
#include "levelset/grid/symmetry.h"

namespace scarp {

/// The planes in the middle of the domain that mirror a recipe's start onto itself and all that its
/// steps do.
///
/// Only between reflective sides: a process on them is its own mirror image, or the recipe would
/// have been refused. What is left is the start geometry, which has to be the same to the last bit,
/// and maps of sources. Across the diagonal, too, crystals, baths and sources that lean are left
/// out.
struct FoundPlanes {
  MirrorPlanes planes;
  /// Why there is none across an axis, and of a square quarter none across x = y.
  std::array<std::string, 2> hindrance{};
  std::string diagonal_hindrance{};
};
FoundPlanes mirror_planes(const Recipe& recipe);

/// What a domain makes of its mirror planes, or could; empty in two dimensions without one.
std::string symmetry_text(const Domain& domain, const FoundPlanes& found);

/// The recipe on the part of its domain beyond the planes of symmetry, where it asks for them; as
/// it is otherwise.
Recipe on_part(Recipe recipe, const FoundPlanes& found);

/// The part of a state beyond planes of symmetry, without what is known on facets.
State part_of(const State& whole, const MirrorPlanes& planes);

/// All of the wafer of which a state may hold a part. Its voids have to be looked for anew.
State whole_of(State state);

}  // namespace scarp

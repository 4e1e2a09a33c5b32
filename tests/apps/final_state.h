#pragma once

#include "apps/simulator/simulator.h"

namespace scarp {

/// The state when a recipe is complete.
inline State final_state(const Recipe& recipe) {
  State state = start_state(recipe.domain.frame, recipe.start);
  while (!finished(state, recipe.steps)) {
    begin_step(state, recipe.steps);
    const Survey now = survey(state, recipe);
    note_voids(state, now.gas);
    advance(state, recipe, now, next_output(state, recipe.outputs.every));
  }
  return state;
}

}  // namespace scarp

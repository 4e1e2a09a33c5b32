#pragma once

#include "apps/simulator/simulator.h"

namespace scarp {

/// The state when a recipe is complete.
inline State final_state(const Recipe& recipe) {
  State state = start_state(recipe);
  while (!finished(state, recipe)) {
    begin_step(state, recipe);
    const Survey now = survey(state, recipe);
    note_voids(state, now.gas);
    advance(state, recipe, now, next_output(state, recipe));
  }
  return state;
}

}  // namespace scarp

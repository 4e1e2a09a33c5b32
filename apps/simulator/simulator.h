#pragma once

#include <map>
#include <vector>

#include "apps/simulator/survey.h"
#include "levelset/operations/layer_steps.h"

namespace scarp {

/// How far one time step went, what it cut off, and what the grid part of it cost.
struct Move {
  double dt = 0;
  std::vector<Region> islands;  ///< solid that was cut off from the wafer and removed
  double residue_volume = 0;    ///< see advect
  NecksLeftOut necks_left_out{};
  /// Of other materials than that of a strip, what it took: what was too thin to stand free on the
  /// grid, and what the grid cut off at edges and gaps. Units: nm^3.
  std::map<MaterialId, double> lost_films{};
  bool is_in_vain = false;  ///< what acted at once has changed nothing
  StageTimer timer;
};

/// A start geometry, without solid that nothing joins to the wafer; or the state that
/// it starts from.
State start_state(const Frame& frame, const StartGeometry& start);

/// The start geometry with what the first steps of a recipe do to it at once, before any that takes
/// time steps.
State prepared_state(const Frame& frame, const StartGeometry& start,
                     std::span<const ProcessStep> steps, const Materials& materials);

/// Opens the layer that the current step deposits, if it is not there yet, and notes where its end
/// condition measures from. Before every survey.
void begin_step(State& state, std::span<const ProcessStep> steps);

/// What has become of closed voids since the survey before.
struct VoidChanges {
  std::vector<std::size_t> closed;  ///< new ones, by their place among the voids of the survey
  std::size_t opened = 0;           ///< how many of those before are gone
};

/// Takes over the voids of a survey; those that were not there before have closed just now.
VoidChanges note_voids(State& state, const OpenGas& gas);

/// Carries the surface through one time step, or does what the current step does at once.
///
/// A time step has as many moves as the scheme needs for it, with speeds from the facets of the
/// survey. It ends early where these tell nothing of what the particles meet any more: where a void
/// closes, or half a percent of the surface becomes another material.
///
/// A time step goes at most to the end of the recipe's step and to the time limit; both are hit
/// exactly and never leave a tiny remainder. Where an end condition is met on the way, the time
/// step is cut to the moment at which it holds: a depth or a thickness within 1e-4 spacings, a
/// material that is exposed or gone within a thousandth of the time step. A step whose condition
/// holds when it begins takes no time.
///
/// Units: time limit in s of process time.
Move advance(State& state, const Recipe& recipe, const Survey& survey, double time_limit);

}  // namespace scarp

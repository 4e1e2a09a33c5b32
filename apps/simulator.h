#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "apps/coverages.h"
#include "apps/recipe.h"
#include "core/stage_timer.h"
#include "flux/flux_field.h"
#include "levelset/connectivity.h"
#include "levelset/extend.h"
#include "levelset/layers.h"

namespace scarp {

/// A void as it was measured when it closed, and when that was.
///
/// Units: s of process time.
struct VoidClosure {
  Region region;
  double time = 0;
};

/// All solid that was cut off from the wafer and removed so far. Units: nm^3.
struct RemovedSolid {
  std::size_t count = 0;
  double volume = 0;
};

/// How far a step with an end condition has come.
///
/// Units: nm; s of process time.
struct EndProgress {
  std::optional<double> start_height{};  ///< see start_height(); found when the step begins
  std::optional<double> reached{};       ///< when the condition held; over-etch goes on
};

/// How a step of the recipe ended. Units: s of process time.
struct StepEnd {
  double time = 0;
  std::optional<double> reached{};  ///< when its end condition held
  bool out_of_time = false;         ///< its duration came before its end condition, or over-etch
  bool skipped = false;             ///< it is of a round that was not needed any more
};

/// Where the time of a recipe begins: at 0, or where the run ended whose state it starts from.
///
/// Units: s.
struct Origin {
  double time = 0;
  std::uint32_t time_step = 0;
};

/// Everything the next time step depends on, and what results tell of the past; what a checkpoint
/// holds.
///
/// Process time counts from the start of the first of a chain of recipes. Units: s.
struct State {
  Layers layers;
  Origin origin{};
  double time = 0;
  std::size_t step = 0;
  double step_start = 0;
  EndProgress progress{};
  std::optional<double> repeat_start{};  ///< see start_height(); of the repeat that has an until
  std::vector<StepEnd> ends{};           ///< of the steps that are complete
  std::uint32_t time_step = 0;
  std::vector<VoidClosure> voids{};  ///< as in the gas of the last survey, see note_voids
  RemovedSolid islands{};
  double residue_volume = 0;     ///< of films that went beside layers that stand still; nm^3
  SurfaceCoverages coverages{};  ///< at the beginning of the last time step
};

/// The surface at one moment with all that the current step of the recipe does to it. A pure
/// function of state and recipe: an interrupted run finds the same numbers again.
///
/// Shape: one flux per species; speeds_of_layers[k] is how the corners of the facets would move if
///        layer k of the stack were seen there, so that a time step can cross from layer to layer.
/// Units: nm/s along the outward normal.
struct Survey {
  OpenGas gas;
  std::size_t vertices_full = 0;
  std::size_t facets_full = 0;
  Box extent;  ///< of the surface before it is simplified
  double simplify_max_distance = 0;
  TriMesh facets;
  std::vector<FluxField> flux;
  std::vector<std::vector<float>> coverages;  ///< on facets, in the order of the model's names
  CoverageFit coverage_fit;
  std::vector<LayerSpeeds> speeds_of_layers;
  std::vector<AngularFactor> factors;  ///< what the speeds depend on the normal by
  /// The longest time step for which the model holds, and the flux is good enough with a target in
  /// position. Units: s.
  double longest_dt = std::numeric_limits<double>::infinity();
  StageTimer timer;
};

/// The standard error of the distance by which the surface moves in a time step: root mean square
/// over the exposed surface on patches of 4 x 4 spacings. Nothing unless it was the target.
///
/// Units: dt in s, result in nm.
std::optional<double> position_error(const Survey& survey, double dt);

/// The next moment after that of the state at which results are wanted; infinity if there is none.
///
/// Units: s of process time.
double next_output(const State& state, const Recipe& recipe);

/// How far one time step went, what it cut off, and what the grid part of it cost.
struct Move {
  double dt = 0;
  std::vector<Region> islands;  ///< solid that was cut off from the wafer and removed
  double residue_volume = 0;    ///< see advect
  StageTimer timer;
};

/// The step that the next time step belongs to; the last one when the recipe is complete.
const ProcessStep& current_step(const State& state, const Recipe& recipe);

/// The start geometry of a recipe, without solid that nothing joins to the wafer; or the state that
/// it starts from.
State start_state(const Recipe& recipe);

/// The start geometry with what the first steps of a recipe do to it at once, before any that takes
/// time steps.
State prepared_state(const Recipe& recipe);

/// Opens the layer that the current step deposits, if it is not there yet, and notes where its end
/// condition measures from. Before every survey.
void begin_step(State& state, const Recipe& recipe);

/// What has become of closed voids since the survey before.
struct VoidChanges {
  std::vector<std::size_t> closed;  ///< new ones, by their place among the voids of the survey
  std::size_t opened = 0;           ///< how many of those before are gone
};

/// Takes over the voids of a survey; those that were not there before have closed just now.
VoidChanges note_voids(State& state, const OpenGas& gas);

/// The speed of every facet, of the layer that is seen there. Units: nm/s.
std::vector<float> facet_speeds(const State& state, const Survey& survey);

/// Extracts and simplifies the surface, solves the flux on it and asks the model for speeds.
///
/// With a target in position, a flux of a tenth of the accuracy tells how far the surface will move
/// until the end of the time step, and what each tally does to that; the flux is then solved to the
/// target.
///
/// Throws: NumericalError with step, time and place when a speed is not finite.
Survey survey(const State& state, const Recipe& recipe);

/// Carries the surface through one time step, or does what the current step does at once.
///
/// A time step goes at most to the end of the recipe's step and to the time limit; both are hit
/// exactly and never leave a tiny remainder. Where an end condition is met on the way, the time
/// step is cut to the moment at which it holds: a depth or a thickness within 1e-4 spacings, a
/// material that is exposed or gone within a thousandth of the time step. A step whose condition
/// holds when it begins takes no time.
///
/// Units: time limit in s of process time.
Move advance(State& state, const Recipe& recipe, const Survey& survey, double time_limit);

/// Whether a repeat is over at the end of a round, by what the surface is then.
bool ends_repeat(const State& state, const RoundEnd& round_end);

/// True when the last step of the recipe is complete.
bool finished(const State& state, const Recipe& recipe);

}  // namespace scarp

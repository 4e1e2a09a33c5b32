#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "apps/simulator/coverages.h"
#include "apps/simulator/kept_mesh.h"
#include "apps/simulator/recipe.h"
#include "levelset/grid/layers.h"
#include "levelset/surface/connectivity.h"

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
  bool ends_repeat = false;         ///< what its repeat waits for holds at its end
};

/// What arrived in the last time step on the facets of the mesh of a state, and how long that time
/// step was; empty at the beginning of a step of the recipe.
///
/// Shape: tallies[t][f], species in their order, of each one its tallies in theirs. Units: s.
struct EarlierFlux {
  std::vector<std::vector<float>> tallies{};
  double dt = 0;
};

/// Where the time of a recipe begins: at 0, or where the run ended whose state it starts from.
///
/// Units: s.
struct Origin {
  double time = 0;
  std::uint32_t time_step = 0;
};

/// Everything the next time step depends on, and what results report of the past; what a checkpoint
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
  double residue_volume = 0;      ///< of films that went beside layers that do not move; nm^3
  bool feet_are_rounded = false;  ///< see MetrologyOptions; by this step or one before it
  KeptMesh mesh{};                ///< of the last time step; empty if nothing needs it any more
  SurfaceCoverages coverages{};   ///< of its facets, at the beginning of that time step
  EarlierFlux earlier{};          ///< on its facets, likewise
};

/// A member of a state and its name in checkpoints.
template <class T>
struct StateField {
  const char* name;
  T& value;
};
template <class T>
StateField(const char*, T&) -> StateField<T>;

/// All members of a state, const or not: what copies, saves, reads or mirrors a state goes through
/// this list. A member that is added and not listed does not compile.
template <class S>
auto fields_of(S& state) {
  auto& [layers, origin, time, step, step_start, progress, repeat_start, ends, time_step, voids,
         islands, residue_volume, feet_are_rounded, mesh, coverages, earlier] = state;
  return std::tuple(
      StateField{"layers", layers}, StateField{"origin", origin}, StateField{"time_s", time},
      StateField{"step", step}, StateField{"step_start_s", step_start},
      StateField{"step_progress", progress}, StateField{"repeat_start_height_nm", repeat_start},
      StateField{"step_ends", ends}, StateField{"time_step", time_step}, StateField{"voids", voids},
      StateField{"islands", islands}, StateField{"residue_volume_nm3", residue_volume},
      StateField{"feet_are_rounded", feet_are_rounded}, StateField{"mesh", mesh},
      StateField{"coverages", coverages}, StateField{"earlier_flux", earlier});
}

/// A state whose members are each made from that of another one.
template <class Make>
State made_from(const State& state, const Make& make) {
  State made;
  const auto from = fields_of(state);
  const auto to = fields_of(made);
  [&]<std::size_t... n>(std::index_sequence<n...>) {
    ((std::get<n>(to).value = make(std::get<n>(from).value)), ...);
  }
  (std::make_index_sequence<std::tuple_size_v<decltype(from)>>());
  return made;
}

/// Makes a member as it is; layers are copied.
struct CopyOf {
  Layers operator()(const Layers& layers) const { return layers.copy(); }
  template <class T>
  T operator()(const T& value) const {
    return value;
  }
};

/// All of a state, with layers of its own.
inline State copy_of(const State& state) { return made_from(state, CopyOf()); }

/// The step that the next time step belongs to; the last one when the recipe is complete.
const ProcessStep& current_step(const State& state, std::span<const ProcessStep> steps);

/// True when the last step of the recipe is complete.
bool finished(const State& state, std::span<const ProcessStep> steps);

/// The next moment after that of the state at which results are wanted; infinity if there is none.
///
/// Units: s of process time.
double next_output(const State& state, double every);

/// When over-etch is over; infinity before the end condition holds. Units: s of process time.
double end_of_over_etch(const State& state, const ProcessStep& step);

/// When the step ends, as far as it is known. Units: s of process time.
double end_of_step(const State& state, const ProcessStep& step);

/// The end of a step, or the time limit if that is before it.
///
/// Moments are set, not summed, where one is hit: no rounding error can leave a remainder. A limit
/// within rounding of the end of a step is the end of the step.
/// Units: s of process time.
double next_moment(const State& state, const ProcessStep& step, double time_limit);

/// A time step that is cut to what is left to a limit; the last two before it share what is left,
/// so that none is a tiny remainder. Units: s.
double cut_to(double left, double dt);

}  // namespace scarp

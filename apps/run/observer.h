#pragma once

#include <cstddef>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "apps/simulator/recipe.h"
#include "apps/simulator/simulator.h"
#include "core/log.h"

namespace scarp {

/// Tells what a user would want to know at once, and each of it once per step of the recipe.
class Observer {
 public:
  Observer(const Recipe& recipe, Log log) : recipe_(recipe), log_(std::move(log)) {}

  /// Of the start geometry: solid that nothing joins to the wafer.
  void tell_loose_shapes(const State& start) const;
  /// At the beginning of a time step, and at the end of the run.
  void look_at(const State& state, const Survey& now, const VoidChanges& changes);
  /// After a time step, of the step with the given number.
  void look_at(const State& state, const Move& move, std::size_t step);

 private:
  void tell_end(const ProcessStep& step, const State& state, std::size_t number);
  void tell_rounds(const ProcessStep& step, const State& state, std::size_t number);
  void tell_used_masks(const State& state, std::size_t step);
  void note_movement(const State& state, const Survey& now);
  void tell_standstill(const ProcessStep& step);
  void tell_left_out(const State& state, const Survey& now);
  void tell_missed_targets(const State& state, const Survey& now);
  void tell_unfit_coverages(const State& state, const Survey& now);
  void tell_voids(const State& state, const Survey& now, const VoidChanges& changes);
  void tell(std::span<const Region> regions);
  std::size_t step_number(const State& state) const;

  /// Whether a step moves anything; as long as it does not, what was seen in it.
  struct Movement {
    std::size_t step = 0;
    bool any = false;
    std::set<MaterialId> seen{};
  };

  const Recipe& recipe_;
  Log log_;
  Movement movement_;
  std::set<const SurfaceModel*> still_models_;
  std::set<std::string> still_paths_;  // of steps that act at once
  std::set<std::pair<const SurfaceModel*, SimplifyChoice>> left_out_;

  std::set<MaterialId> masks_;  // that are there

  std::size_t warned_ = 0;  // in which step
  std::size_t warned_of_coverages_ = 0;
};

}  // namespace scarp

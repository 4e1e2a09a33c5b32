#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "apps/simulator/recipe.h"
#include "apps/simulator/simulator.h"

namespace scarp {

/// Whether a step of a recipe takes as much away of each material as rates and surfaces say, and
/// leaves what it does not etch as it was. A film thinner than a spacing goes with what holds it,
/// where that is etched away beneath it, and so does a sharp edge: no node tells that it is there.
class MaterialBalance {
 public:
  /// Both have to outlive it.
  MaterialBalance(std::span<const ProcessStep> steps, const Materials& materials)
      : steps_(steps), materials_(materials) {}

  /// At the beginning of a time step, and at the end of the run. Returns what to report of the
  /// step that ended before, a line for each material that lost more, or that should have stood.
  std::vector<std::string> look_at(const State& state, const Survey& now);

  /// After a time step that began with a survey.
  void note(const Survey& before, const Move& move);

 private:
  std::vector<double> volumes_of(const State& state) const;
  void open(const State& state, std::vector<double> volumes);
  std::vector<std::string> close(const State& state, std::span<const double> volumes);

  std::span<const ProcessStep> steps_;
  const Materials& materials_;
  bool is_open_ = false;
  std::size_t step_ = 0;
  // One per material. Units: nm^3.
  std::vector<double> volumes_then_;
  std::vector<double> etched_;
  std::vector<double> of_edges_;
  double islands_ = 0;
};

}  // namespace scarp

#pragma once

#include <optional>
#include <string>

#include "apps/simulator/material_balance.h"
#include "apps/simulator/recipe.h"
#include "apps/simulator/simulator.h"
#include "core/log.h"

namespace scarp {

/// Looks at every time step of a run for what makes results wrong without showing it.
///
/// Told once when it happens first, with the place or the numbers; how often it did, at the end.
class Watchdog {
 public:
  /// Steps and materials have to outlive it.
  Watchdog(std::span<const ProcessStep> steps, const Materials& materials, double spacing, Log log)
      : steps_(steps),
        materials_(materials),
        spacing_(spacing),
        log_(std::move(log)),
        balances_(steps, materials) {}

  /// At the beginning of a time step: whether phi is a distance near the surface (see
  /// surface_slopes) and the mesh that the flux is solved on a surface (see surface_fault), whether
  /// the time step goes anywhere, whether the particles of the flux are all accounted for, and
  /// whether the error in position is that of all facets. And of the step that ended before,
  /// whether the solid changed by what speeds say (see Survey::growth), unless they are those of a
  /// crystal, and whether each material did (see MaterialBalance).
  ///
  /// Throws: NumericalError with step, time and place when phi is not finite or on half of the
  ///         surface no distance, when the mesh is no surface, and when the time step has
  ///         collapsed: its step would take more than 1e8 of them.
  void look_at(const State& state, const Survey& now);

  /// After a time step, of the step with the given number.
  void note(const Survey& before, const Move& move, std::size_t step);

  /// Tells how often things happened.
  void sum_up();

 private:
  /// Something that is reported the first time and then counted. The worst has the largest measure.
  struct Finding {
    std::size_t count = 0;
    double worst = 0;
  };

  /// Of one step of the recipe. Units: nm^3.
  struct Balance {
    std::size_t step = 0;
    double surplus = 0;  ///< of solid, beyond what speeds say
    double moved = 0;    ///< what grew and what went together
    double of_edges = 0;
  };

  /// A time step whose effect on the volume is not seen yet. Units: nm^3.
  struct Due {
    std::size_t step = 0;
    double dt = 0;
    double volume_then = 0;
    Growth growth_then;
    double removed = 0;
    double of_edges = 0;  ///< no surplus to speak of
  };

  void look_at_slopes(const State& state);
  void look_at_mesh(const State& state, const Survey& now) const;
  void look_at_time_step(const State& state, const Survey& now);
  void look_at_audit(const State& state, const Survey& now);
  void look_at_poles(const State& state, const Survey& now);
  void settle(const State& state, const Survey& now);
  void close_balance();
  std::string place_of_fastest(const State& state, const Survey& now) const;
  std::string moment(const State& state) const;
  void find(Finding& finding, double measure, const std::string& text);

  std::span<const ProcessStep> steps_;
  const Materials& materials_;
  double spacing_;
  Log log_;
  std::size_t surfaces_ = 0;
  std::size_t time_steps_ = 0;
  std::size_t balances_closed_ = 0;
  Finding bad_slopes_;
  Finding many_time_steps_;
  Finding unbalanced_flux_;
  Finding unbalanced_volume_;
  Finding poles_;
  Balance balance_;
  std::optional<Due> due_;
  MaterialBalance balances_;
};

/// False when the particles of a flux are not all accounted for, beyond what chance explains: by
/// more than the allowed part of them.
bool is_balanced(const FluxAudit& audit, double allowed = 1e-3);

/// The same of a flux whose particles may be off in all by what the flux may be off in places, at
/// least by a part of them. The standard error of the balance is itself known to a part only: five
/// of it alone would be passed now and then.
bool is_balanced(const FluxField& field, double allowed_at_least = 1e-3);

}  // namespace scarp

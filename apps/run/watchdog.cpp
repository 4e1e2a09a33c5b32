#include "apps/run/watchdog.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "apps/simulator/region_text.h"
#include "apps/simulator/surface_speeds.h"
#include "core/error.h"
#include "levelset/grid/slope.h"
#include "levelset/motion/extend.h"
#include "mesh/surface_fault.h"

namespace scarp {

namespace {

constexpr double most_time_steps = 1e8;   // of a step: a recipe is refused from 1e7 on
constexpr double many_bad_slopes = 0.05;  // part of the nodes next to the surface
constexpr double most_bad_slopes = 0.5;
constexpr double many_time_steps = 1e6;  // of a step: a day at a tenth of a second each
// Part of the particles. Flux with a larger error may have it in its sum, up to a bound beyond
// which it is worth a word.
constexpr double most_unbalanced = 0.01;
constexpr double most_by_flux_error = 0.05;
constexpr double largest_surplus = 0.1;  // part of the volume that moved
// What the edges of a start geometry lose as they become those of the grid. Spacings, by area.
constexpr double edge_surplus = 0.02;

}  // namespace

bool is_balanced(const FluxAudit& audit, double allowed) {
  // Chance explains five standard errors, but a tenth of all particles is too much to trust the
  // rest.
  const double chance = std::min(5 * audit.balance_std_error, 0.1);
  return std::abs(audit.balance_error()) - chance <= allowed;
}

bool is_balanced(const FluxField& field, double allowed_at_least) {
  return is_balanced(field.audit, std::clamp(field.error, allowed_at_least, most_by_flux_error));
}

void Watchdog::look_at(const State& state, const Survey& now) {
  settle(state, now);
  for (const std::string& line : balances_.look_at(state, now)) log_.warn(line);
  look_at_slopes(state);
  look_at_mesh(state, now);
  if (finished(state, steps_) || !current_step(state, steps_).model) return;
  look_at_time_step(state, now);
  look_at_audit(state, now);
  look_at_poles(state, now);
}

void Watchdog::note(const Survey& before, const Move& move, std::size_t step) {
  due_.reset();
  if (!steps_[step].model) return;
  ++time_steps_;
  balances_.note(before, move);
  // An edge of a crystal moves by none of the speeds of the facets beside it.
  if (std::ranges::any_of(before.factors, &AngularFactor::has_cusps)) return;
  due_ = Due{.step = step,
             .dt = move.dt,
             .volume_then = before.volume,
             .growth_then = before.growth,
             .removed = volume_of(move.islands) + move.residue_volume,
             .of_edges = edge_surplus * spacing_ * before.growth.area};
}

void Watchdog::settle(const State& state, const Survey& now) {
  if (due_) {
    if (balance_.moved == 0) balance_.step = due_->step;
    // Speeds and areas of both ends, unless what comes next is another step.
    const bool goes_on = !finished(state, steps_) && state.step == due_->step;
    const Growth& then = due_->growth_then;
    const Growth& growth = goes_on ? now.growth : then;
    const double grown = due_->dt * std::midpoint(then.net, growth.net);
    balance_.surplus += now.volume - due_->volume_then - grown + due_->removed;
    balance_.moved += due_->dt * std::midpoint(then.gross, growth.gross);
    balance_.of_edges = std::max(balance_.of_edges, due_->of_edges);
    due_.reset();
  }
  if (finished(state, steps_) || state.step != balance_.step) close_balance();
}

void Watchdog::close_balance() {
  const Balance balance = std::exchange(balance_, {});
  if (balance.moved <= 0) return;
  ++balances_closed_;
  const double part = balance.surplus / balance.moved;
  if (std::abs(balance.surplus) <= largest_surplus * balance.moved + balance.of_edges) return;
  find(unbalanced_volume_, std::abs(part),
       fmt::format("step \"{}\": the solid has {:.3g} nm^3 {} than follows from speeds and areas, "
                   "{:.2g} of the volume that moved: the grid is too coarse for this step; lower "
                   "domain.spacing or advection.cfl",
                   steps_[balance.step].name, std::abs(balance.surplus), part > 0 ? "more" : "less",
                   std::abs(part)));
}

std::string Watchdog::moment(const State& state) const {
  return fmt::format("time step {} of step \"{}\", t = {:g} s", state.time_step,
                     current_step(state, steps_).name, state.time);
}

void Watchdog::look_at_slopes(const State& state) {
  ++surfaces_;
  const SurfaceSlopes slopes = surface_slopes(state.layers.top());
  const double part =
      static_cast<double>(slopes.off) / std::max(1.0, static_cast<double>(slopes.nodes));
  if (part <= many_bad_slopes && std::isfinite(slopes.worst)) return;
  // What acts at once leaves edges that are as sharp as the grid has them: no time step did it.
  const bool is_after_operation =
      state.step > 0 && state.time == state.step_start && !steps_[state.step - 1].model;
  if (is_after_operation && std::isfinite(slopes.worst)) return;
  const Vec3d r = slopes.worst_at;
  const std::string what = fmt::format(
      "{}: |grad phi| is {:.3g} at ({:g}, {:g}, {:g}) nm, and below 1/2 or above 2 on {:.2g} of "
      "the surface, where it should be 1; lower domain.spacing or advection.cfl",
      moment(state), slopes.worst, r.x, r.y, r.z, part);
  if (part > most_bad_slopes || !std::isfinite(slopes.worst)) throw NumericalError(what);
  find(bad_slopes_, part, what);
}

void Watchdog::look_at_mesh(const State& state, const Survey& now) const {
  const auto fault = surface_fault(now.facets, state.layers.frame.sides());
  if (!fault) return;
  throw NumericalError(fmt::format(
      "{}: {} at ({:g}, {:g}, {:g}) nm of the mesh of {} facets; please report it with the recipe",
      moment(state), fault->text, fault->r.x, fault->r.y, fault->r.z, now.facets.triangles.size()));
}

void Watchdog::look_at_time_step(const State& state, const Survey& now) {
  const ProcessStep& step = current_step(state, steps_);
  const double dt = now.longest_dt;
  const double count = (state.step_start + step.duration - state.time) / dt;
  if (count < many_time_steps && state.time + dt > state.time) return;
  const std::string what =
      fmt::format("{}: time steps of {:.3g} s, {:.2g} of them to the end of the step; {}",
                  moment(state), dt, count, place_of_fastest(state, now));
  if (count > most_time_steps || !(state.time + dt > state.time)) throw NumericalError(what);
  find(many_time_steps_, count, what);
}

std::string Watchdog::place_of_fastest(const State& state, const Survey& now) const {
  const std::vector<float> speeds = facet_speeds(state, now);
  const auto slower = [](float a, float b) { return std::abs(a) < std::abs(b); };
  const auto fastest = std::ranges::max_element(speeds, slower);
  const auto f = static_cast<std::size_t>(fastest - speeds.begin());
  const Vec3f r = now.facets.vertices[now.facets.triangles[f][0]];
  return fmt::format("{:.3g} nm/s on facet {} at ({:g}, {:g}, {:g}) nm, material {}", *fastest, f,
                     r.x, r.y, r.z, materials_[now.facets.materials[f]].name);
}

void Watchdog::look_at_audit(const State& state, const Survey& now) {
  // Where coverages do not fit the fluxes, particles are missing for that reason; a run tells it.
  if (!now.coverage_fit.reached) return;
  for (const FluxField& field : now.flux) {
    if (is_balanced(field, most_unbalanced)) continue;
    const double off = field.audit.balance_error();
    find(unbalanced_flux_, std::abs(off),
         fmt::format("{}: {:.2g} of the particles that were sent are {}, by chance {:.2g}; raise "
                     "flux.rays or lower flux.target_error",
                     moment(state), std::abs(off), off < 0 ? "missing" : "too many",
                     field.audit.balance_std_error));
    return;
  }
}

void Watchdog::look_at_poles(const State& state, const Survey& now) {
  if (now.facets_with_pole == 0) return;
  const double part =
      static_cast<double>(now.facets_with_pole) / static_cast<double>(now.facets.triangles.size());
  find(
      poles_, part,
      fmt::format("{}: on {:.2g} of the facets the rate is not finite for a flux within its error, "
                  "and flux.position_error leaves them out; use flux.target_error, or a rate "
                  "without a pole there",
                  moment(state), part));
}

void Watchdog::find(Finding& finding, double measure, const std::string& text) {
  if (finding.count++ == 0) log_.warn(text);
  finding.worst = std::max(finding.worst, measure);
}

void Watchdog::sum_up() {
  const auto tell = [&](const Finding& finding, const char* what, const std::string& of) {
    if (finding.count < 2) return;
    log_.warn(fmt::format("{} of {}: {}, {:.2g} at worst", finding.count, of, what, finding.worst));
  };
  tell(bad_slopes_, "|grad phi| is not 1 on a part of it", counted(surfaces_, "surface"));
  tell(many_time_steps_, "many more to the end of the step", counted(time_steps_, "time step"));
  tell(unbalanced_flux_, "particles missing or too many", counted(time_steps_, "time step"));
  tell(poles_, "facets without an error in position", counted(time_steps_, "time step"));
  tell(unbalanced_volume_, "the volume of the solid does not follow speeds and areas",
       counted(balances_closed_, "step"));
}

}  // namespace scarp

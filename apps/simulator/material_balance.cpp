#include "apps/simulator/material_balance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/simulator/region_text.h"
#include "levelset/metrology/cross_section.h"

namespace scarp {

namespace {

// What edges cost that are those of the grid. Part of a material's volume; spacings, by the area
// of its surface.
constexpr double of_volume = 0.05;
constexpr double of_surface = 0.05;
constexpr double of_etched = 0.1;     // part of what goes
constexpr double of_standing = 0.01;  // of a material that a step does not etch
constexpr double of_cell = 0.1;       // what of a material is not worth a word

}  // namespace

std::vector<double> MaterialBalance::volumes_of(const State& state) const {
  std::vector<double> volumes(materials_.size());
  const std::vector<double> of_layers = material_volumes(state.layers);
  for (std::size_t n = 0; n < of_layers.size(); ++n)
    volumes[state.layers.stack[n].material] += state.layers.frame.images() * of_layers[n];
  return volumes;
}

std::vector<std::string> MaterialBalance::look_at(const State& state, const Survey& now) {
  std::vector<std::string> lines;
  const bool is_done = finished(state, steps_);
  const bool ends = is_open_ && (is_done || state.step != step_);
  // One material goes as all solid goes.
  const bool begins = (ends || !is_open_) && !is_done && current_step(state, steps_).model &&
                      state.layers.stack.size() > 1;
  if (ends || begins) {
    std::vector<double> volumes = volumes_of(state);
    if (ends) lines = close(state, volumes);
    if (begins) open(state, std::move(volumes));
  }
  for (std::size_t m = 0; is_open_ && m < now.growth.area_of.size(); ++m) {
    const double of_edges = of_surface * state.layers.frame.spacing * now.growth.area_of[m];
    of_edges_[m] = std::max(of_edges_[m], of_edges);
  }
  return lines;
}

void MaterialBalance::note(const Survey& before, const Move& move) {
  if (!is_open_) return;
  islands_ += volume_of(move.islands) + move.residue_volume;
  for (std::size_t m = 0; m < before.growth.etched.size(); ++m)
    etched_[m] += move.dt * before.growth.etched[m];
}

void MaterialBalance::open(const State& state, std::vector<double> volumes) {
  is_open_ = true;
  step_ = state.step;
  etched_.assign(volumes.size(), 0);
  of_edges_.assign(volumes.size(), 0);
  volumes_then_ = std::move(volumes);
  islands_ = 0;
}

std::vector<std::string> MaterialBalance::close(const State& state,
                                                std::span<const double> volumes) {
  is_open_ = false;
  std::vector<std::string> lines;
  const ProcessStep& step = steps_[step_];
  // The lowest one has no lower side: how much of it there is depends on where z = 0 lies.
  const MaterialId lowest = state.layers.stack.front().material;
  const double least = of_cell * std::pow(state.layers.frame.spacing, 3);
  for (std::size_t m = 0; m < volumes.size(); ++m) {
    if (m == lowest || m == step.deposits) continue;
    const double then = volumes_then_[m];
    const double gained = volumes[m] - then;
    const double explained = (1 + of_etched) * etched_[m] + of_volume * then + of_edges_[m];
    if (-gained > explained + islands_) {
      lines.push_back(
          fmt::format("step \"{}\": {:.3g} nm^3 of {} disappeared, {:.2g} of it, where rates allow "
                      "{:.3g}: a film thinner than a spacing disappears with its support, or the "
                      "grid is too coarse for this step; lower domain.spacing",
                      step.name, -gained, materials_[m].name, -gained / then, etched_[m]));
    } else if (etched_[m] == 0 &&
               std::max(gained, -gained - islands_) > std::max(of_standing * then, least)) {
      const double part = std::abs(gained) / then;
      lines.push_back(fmt::format(
          "step \"{}\": {:.3g} nm^3 of {} {}, {:.2g} of it, though the step does not etch "
          "it: the grid does not hold sharp edges and what is thinner than a spacing; "
          "lower domain.spacing, to about {:.2g} nm",
          step.name, std::abs(gained), materials_[m].name,
          gained > 0 ? "were added" : "disappeared", part,
          state.layers.frame.spacing * of_standing / part));
    }
  }
  return lines;
}

}  // namespace scarp

#include "apps/symmetry.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "apps/simulator.h"
#include "levelset/symmetry.h"

namespace scarp {

namespace {

bool has_source_map(const Recipe& recipe) {
  return std::ranges::any_of(recipe.steps, [](const ProcessStep& step) {
    return step.model && std::ranges::any_of(step.model->species(), [](const Species& species) {
             return !species.source.map.empty();
           });
  });
}

void move_to_part(EndCondition& condition, const Frame& frame) {
  if (!condition.place) return;
  for (std::size_t axis = 0; axis < 2; ++axis)
    if (frame.half[axis]) (*condition.place)[axis] = std::abs((*condition.place)[axis]);
}

void move_to_part(std::optional<EndCondition>& condition, const Frame& frame) {
  if (condition) move_to_part(*condition, frame);
}

}  // namespace

std::array<bool, 2> mirror_planes(const Recipe& recipe) {
  if (has_source_map(recipe)) return {};
  const Layers layers = start_state(recipe).layers;
  return {is_mirror_symmetric(layers, 0), is_mirror_symmetric(layers, 1)};
}

Recipe on_symmetric_part(const Recipe& recipe) {
  Recipe part = recipe;
  if (!recipe.uses_symmetry) return part;
  part.frame = half_of(recipe.frame, mirror_planes(recipe));
  part.flux.sides = part.frame.sides();
  if (part.simplify) part.simplify->sides = part.frame.sides();
  for (ProcessStep& step : part.steps) {
    move_to_part(step.until, part.frame);
    move_to_part(step.begins_repeat, part.frame);
    if (step.round_end) move_to_part(step.round_end->until, part.frame);
  }
  return part;
}

State half_of(const State& whole, std::array<bool, 2> planes) {
  State part = copy_of(whole);
  part.layers = half_of(whole.layers, planes);
  part.voids.clear();
  part.mesh = {};
  part.coverages = {};
  return part;
}

State whole_of(State state) {
  const Frame frame = state.layers.frame;
  if (frame.images() == 1) return state;
  state.layers = WholeLayers(state.layers).get().copy();
  state.voids.clear();
  state.mesh.facets = with_images(state.mesh.facets, frame);
  state.mesh.hits = {};
  for (std::vector<float>& values : state.coverages.values) values = with_images(values, frame);
  return state;
}

}  // namespace scarp

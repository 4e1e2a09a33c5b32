#include "apps/simulator/symmetry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "apps/simulator/simulator.h"
#include "core/error.h"

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

// Whether what a model does is its own mirror image across every upright plane.
bool is_upright(const SurfaceModel& model) {
  return model.angular().is_isotropic() && model.bath() == nullptr &&
         std::ranges::all_of(model.species(), [](const Species& species) {
           return species.source.kind == SourceLobe::Kind::none || species.source.is_upright();
         });
}

bool is_upright(const Recipe& recipe) {
  return std::ranges::all_of(
      recipe.steps, [](const ProcessStep& step) { return !step.model || is_upright(*step.model); });
}

}  // namespace

FoundPlanes mirror_planes(const Recipe& recipe) {
  const Frame& frame = recipe.frame;
  const bool has_map = has_source_map(recipe);
  const Layers layers = start_state(recipe).layers;
  FoundPlanes found;
  auto& [across, diagonal] = found.planes;
  for (int axis = 0; axis < frame.lateral_axes(); ++axis) {
    std::string& hindrance = found.hindrance[axis];
    if (frame.boundary[axis] != Boundary::reflective) {
      hindrance = "the sides are not reflective";
    } else if (frame.cells[axis] % 2 != 0) {
      hindrance = fmt::format("{} cells cannot be halved", frame.cells[axis]);
    } else if (has_map) {
      hindrance = "a source has a map";
    } else if (!is_mirror_symmetric(layers, axis)) {
      hindrance = "the start is not its own mirror image";
    }
    across[axis] = hindrance.empty();
  }
  if (across[0] && across[1] && frame.is_square()) {
    if (!is_upright(recipe)) {
      found.diagonal_hindrance = "a step has a crystal, a bath or a source that leans";
    } else if (!is_diagonally_symmetric(layers)) {
      found.diagonal_hindrance = "the start is not its own mirror image";
    }
    diagonal = found.diagonal_hindrance.empty();
  }
  if (frame.axisymmetric && !across[0])
    throw InputError("domain.mode = \"axisymmetric\": " + found.hindrance[0]);
  return found;
}

std::string symmetry_text(const Recipe& recipe, const FoundPlanes& found) {
  const auto& [x, y] = found.planes.across;
  if (recipe.frame.axisymmetric) return "runs on a section from the axis on";
  if (x || y) {
    const bool diagonal = found.planes.diagonal;
    const std::string which = fmt::format("on the {} of the domain beyond the mirror plane{}",
                                          diagonal ? "eighth"
                                          : x && y ? "quarter"
                                                   : "half",
                                          diagonal ? "s x = 0, y = 0 and x = y"
                                          : x && y ? "s x = 0 and y = 0"
                                          : x      ? " x = 0"
                                                   : " y = 0");
    const std::string whether =
        recipe.uses_symmetry ? "runs " : "domain.symmetry = \"auto\" would run ";
    const std::string& hindrance = found.diagonal_hindrance;
    return whether + which + (hindrance.empty() ? "" : "; x = y is none: " + hindrance);
  }
  if (!recipe.uses_symmetry) return "";
  const bool is_same = found.hindrance[0] == found.hindrance[1];
  std::string text = "runs on the whole domain, there is no mirror plane: ";
  if (recipe.frame.is_section() || is_same) return text + found.hindrance[0];
  return text + "along x " + found.hindrance[0] + ", along y " + found.hindrance[1];
}

Recipe on_part(const Recipe& recipe, const FoundPlanes& found) {
  Recipe part = recipe;
  if (!recipe.uses_symmetry) return part;
  part.frame = part_of(recipe.frame, found.planes);
  part.flux.sides = part.frame.sides();
  if (part.simplify) part.simplify->sides = part.frame.sides();
  for (ProcessStep& step : part.steps) {
    move_to_part(step.until, part.frame);
    move_to_part(step.begins_repeat, part.frame);
    if (step.round_end) move_to_part(step.round_end->until, part.frame);
  }
  return part;
}

State part_of(const State& whole, const MirrorPlanes& planes) {
  State part = copy_of(whole);
  part.layers = part_of(whole.layers, planes);
  part.voids.clear();
  part.mesh = {};
  part.coverages = {};
  part.earlier = {};
  return part;
}

State whole_of(State state) {
  const Frame frame = state.layers.frame;
  if (frame.images() == 1) return state;
  state.layers = with_images(state.layers);
  state.voids.clear();
  state.mesh.facets = with_images(state.mesh.facets, frame);
  state.mesh.hits = {};
  state.mesh.tree = {};
  state.earlier = {};
  for (std::vector<float>& values : state.coverages.values) values = with_images(values, frame);
  return state;
}

}  // namespace scarp

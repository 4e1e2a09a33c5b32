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

bool has_source_map(std::span<const ProcessStep> steps) {
  return std::ranges::any_of(steps, [](const ProcessStep& step) {
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

bool is_upright(std::span<const ProcessStep> steps) {
  return std::ranges::all_of(
      steps, [](const ProcessStep& step) { return !step.model || is_upright(*step.model); });
}

// Voids have to be looked for anew, and what is known on facets is known of all of them.
struct NothingOnFacets : CopyOf {
  using CopyOf::operator();
  std::vector<VoidClosure> operator()(const std::vector<VoidClosure>&) const { return {}; }
  EarlierFlux operator()(const EarlierFlux&) const { return {}; }
};

struct PartOf : NothingOnFacets {
  MirrorPlanes planes;

  using NothingOnFacets::operator();
  Layers operator()(const Layers& layers) const { return part_of(layers, planes); }
  KeptMesh operator()(const KeptMesh&) const { return {}; }
  SurfaceCoverages operator()(const SurfaceCoverages&) const { return {}; }
};

struct WholeOf : NothingOnFacets {
  Frame part;

  using NothingOnFacets::operator();
  Layers operator()(const Layers& layers) const { return with_images(layers); }
  KeptMesh operator()(const KeptMesh& mesh) const {
    return {.facets = with_images(mesh.facets, part),
            .made_at = mesh.made_at,
            .bound = mesh.bound,
            .max_distance = mesh.max_distance};
  }
  SurfaceCoverages operator()(SurfaceCoverages coverages) const {
    for (std::vector<float>& values : coverages.values) values = with_images(values, part);
    return coverages;
  }
};

}  // namespace

FoundPlanes mirror_planes(const Recipe& recipe) {
  const Frame& frame = recipe.domain.frame;
  const bool has_map = has_source_map(recipe.steps);
  const Layers layers = start_state(frame, recipe.start).layers;
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
    if (!is_upright(recipe.steps)) {
      found.diagonal_hindrance = "a step has a crystal, a bath or a source that leans";
    } else if (!is_diagonally_symmetric(layers)) {
      found.diagonal_hindrance = "the start is not its own mirror image";
    }
    diagonal = found.diagonal_hindrance.empty();
  }
  if (frame.is_around_axis() && !across[0])
    throw InputError("domain.mode = \"axisymmetric\": " + found.hindrance[0]);
  return found;
}

std::string symmetry_text(const Domain& domain, const FoundPlanes& found) {
  const auto& [x, y] = found.planes.across;
  if (domain.frame.is_around_axis()) return "runs on a section from the axis on";
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
        domain.uses_symmetry ? "runs " : "domain.symmetry = \"auto\" would run ";
    const std::string& hindrance = found.diagonal_hindrance;
    return whether + which + (hindrance.empty() ? "" : "; x = y is none: " + hindrance);
  }
  if (!domain.uses_symmetry) return "";
  const bool is_same = found.hindrance[0] == found.hindrance[1];
  std::string text = "runs on the whole domain, there is no mirror plane: ";
  if (domain.frame.is_section() || is_same) return text + found.hindrance[0];
  return text + "along x " + found.hindrance[0] + ", along y " + found.hindrance[1];
}

Recipe on_part(Recipe recipe, const FoundPlanes& found) {
  if (!recipe.domain.uses_symmetry) return recipe;
  Frame& frame = recipe.domain.frame;
  frame = part_of(frame, found.planes);
  recipe.flux.options.sides = frame.sides();
  if (recipe.simplification.options) recipe.simplification.options->sides = frame.sides();
  for (ProcessStep& step : recipe.steps) {
    move_to_part(step.until, frame);
    move_to_part(step.begins_repeat, frame);
    if (step.round_end) move_to_part(step.round_end->until, frame);
  }
  return recipe;
}

State part_of(const State& whole, const MirrorPlanes& planes) {
  return made_from(whole, PartOf{{}, planes});
}

State whole_of(State state) {
  const Frame frame = state.layers.frame;
  if (frame.images() == 1) return state;
  return made_from(state, WholeOf{{}, frame});
}

}  // namespace scarp

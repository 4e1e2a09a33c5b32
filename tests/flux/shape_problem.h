#pragma once

#include <vector>

#include "flux/rays/elements.h"
#include "flux/rays/problem.h"
#include "flux/rays/ray_plan.h"
#include "tests/flux/shapes.h"

namespace scarp::exact {

/// One species on a shape, half of whose particles stick, with all that the problem refers to.
struct ShapeProblem {
  ShapeProblem(Shape of, Species what, bool two_dimensional = false)
      : shape(std::move(of)),
        species(std::move(what)),
        options{.sides = shape.sides, .two_dimensional = two_dimensional} {}
  ShapeProblem(const ShapeProblem&) = delete;
  ShapeProblem& operator=(const ShapeProblem&) = delete;

  Shape shape;
  RayScene scene = scene_of(shape);
  Patches patches{shape.mesh, scene};
  std::vector<float> sticking = std::vector<float>(scene.facet_count(), 0.5F);
  Species species;
  FluxOptions options;
  FluxProblem problem{.mesh = shape.mesh,
                      .scene = scene,
                      .patches = patches,
                      .sticking = sticking,
                      .species = species,
                      .options = options};
  Elements elements{scene, longest_piece_edge};
};

}  // namespace scarp::exact

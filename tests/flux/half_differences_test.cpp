#include "flux/half_differences.h"

#include <gtest/gtest.h>

#include <array>

#include "flux/element_flux.h"
#include "flux/view.h"
#include "tests/flux/shape_problem.h"

namespace scarp {
namespace {

// Of what sticks at once a ray tells the sky it meets: 1 or nothing, as Bernoulli's numbers.
TEST(HalfDifferences, ScatterAsTheSkyThatRaysMeet) {
  exact::ShapeProblem of(exact::trench(1), {.name = "gas", .sticking = {1.0F}});
  of.sticking.assign(of.scene.facet_count(), 1);
  RayPlan plan(of.scene, of.elements);
  plan.grow(64, 1'000'000);
  const View view = look({&of.problem, 1}, plan, {});
  const FacetValues values(of.shape.mesh, of.elements);
  ElementFlux flux(of.problem, 0, plan, values, view);
  flux.solve(1e-7);
  const HalfDifferences halves = half_differences(view, 0, flux.radiosity());
  int shadowed = 0;
  int open = 0;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const double p = flux.by_rank()[i];
    const double square = p * (1 - p);
    EXPECT_NEAR(halves.scatter_of_flux.squares[i], square, 1e-6) << i;
    EXPECT_NEAR(halves.scatter_of_flux.fourths[i], square * (1 - 3 * square), 1e-6) << i;
    EXPECT_EQ(halves.scatter_of_lost.squares[i], 0);
    (p < 0.9 ? shadowed : open) += 1;
  }
  EXPECT_GT(shadowed, 100);
  EXPECT_GT(open, 4);
}

// A source that is not equally bright everywhere scatters on what sees only the sky, too.
TEST(HalfDifferences, ScatterAsTheSource) {
  exact::ShapeProblem of(exact::flat_wafer(8, 4), {.name = "gas", .sticking = {1.0F}});
  of.sticking.assign(of.scene.facet_count(), 1);
  const std::array<double, 2> x{0, 8};
  const std::array<double, 2> density{1, 3};
  of.species.source.map = SourceMap(x, {}, density, of.shape.sides);
  RayPlan plan(of.scene, of.elements);
  plan.grow(64, 1'000'000);
  const View view = look({&of.problem, 1}, plan, {});
  const FacetValues values(of.shape.mesh, of.elements);
  ElementFlux flux(of.problem, 0, plan, values, view);
  flux.solve(1e-7);
  const HalfDifferences halves = half_differences(view, 0, flux.radiosity());
  for (std::size_t i = 0; i < plan.size(); ++i) EXPECT_GT(halves.scatter_of_flux.squares[i], 1e-3);
}

}  // namespace
}  // namespace scarp

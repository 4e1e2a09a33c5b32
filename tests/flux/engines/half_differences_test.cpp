#include "flux/engines/half_differences.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "flux/engines/element_flux.h"
#include "flux/engines/view.h"
#include "tests/flux/shape_problem.h"

namespace scarp {
namespace {

// Of what sticks at once a ray tells the sky it meets: 1 or nothing. Parts of a set of 16 rays tell
// quarters more or less than the set.
TEST(HalfDifferences, OfPartsAreThoseOfTheSkyThatRaysMeet) {
  exact::ShapeProblem of(exact::trench(1), {.name = "gas", .sticking = {1.0F}});
  of.sticking.assign(of.scene.facet_count(), 1);
  RayPlan plan(of.scene, of.elements);
  plan.grow(64, 1'000'000);
  const View view = look({&of.problem, 1}, plan, {});
  const FacetValues values(of.shape.mesh, of.elements);
  ElementFlux flux(of.problem, 0, plan, values, view);
  flux.solve(1e-7);
  const HalfDifferences halves = half_differences(view, 0, plan, flux.radiosity());
  int shadowed = 0;
  int open = 0;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    ASSERT_EQ(part_count(plan, plan.block_of(i)), most_parts);
    const double in_part = plan.rays(i) / 4.0;
    const double p = flux.by_rank()[i];
    double varies = 0;
    for (std::size_t set = 0; set < set_count; ++set) {
      double sum = 0;
      for (std::size_t part = 0; part < most_parts; ++part) {
        const auto more = static_cast<double>(halves.flux.parts[i][set * most_parts + part]);
        const double rays = 4 * in_part * more;
        EXPECT_NEAR(rays, std::round(rays), 1e-4) << i;
        sum += more;
        varies += more * more;
        EXPECT_EQ(halves.lost.parts[i][set * most_parts + part], 0);
      }
      EXPECT_NEAR(sum, 0, 1e-6) << i;
    }
    if (p == 1) {
      EXPECT_EQ(varies, 0) << i;
    }
    EXPECT_EQ(halves.flux.of_rays[i], 0) << i;
    const double n = plan.rays(i) * set_count;
    EXPECT_NEAR(halves.flux.of_rays_in_parts[i], p * (1 - p) * n / (n - 1), 1e-6) << i;
    EXPECT_EQ(halves.sum_of_rays[i], halves.flux.of_rays_in_parts[i]) << i;
    (varies > 0 ? shadowed : open) += 1;
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
  const HalfDifferences halves = half_differences(view, 0, plan, flux.radiosity());
  for (std::size_t i = 0; i < plan.size(); ++i) EXPECT_GT(halves.flux.of_rays[i], 1e-3F);
}

}  // namespace
}  // namespace scarp

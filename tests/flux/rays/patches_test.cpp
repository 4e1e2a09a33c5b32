#include "flux/rays/patches.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/flux/shapes.h"

namespace scarp {
namespace {

TEST(Patches, AreCellsOfFourSpacings) {
  const exact::Shape wafer = exact::flat_wafer(20, 20);
  const Patches patches(wafer.mesh, scene_of(wafer));
  EXPECT_EQ(patches.list().size(), 25U);
  EXPECT_EQ(patches.part_count(), 1U);
  for (const auto& patch : patches.list()) {
    EXPECT_EQ(patch.area, 16);
    EXPECT_EQ(patch.whole, 16);
    EXPECT_EQ(patch.facets.size(), 32U);
  }
}

TEST(Patches, DoNotReachAroundEdges) {
  const exact::Shape shape = exact::trench(1);
  const auto normals = facet_normals(shape.mesh);
  const Patches patches(shape.mesh, scene_of(shape));
  for (const auto& patch : patches.list())
    for (const std::uint32_t f : patch.facets)
      EXPECT_GT(dot(normals[f], normals[patch.facets.front()]), 0.9F);
}

// A slice one spacing wide stands for an infinitely long structure.
TEST(Patches, AreWholeInANarrowSlice) {
  exact::Builder builder;
  builder.grid({0, 0, 0}, {20, 0, 0}, 20, {0, 1, 0}, 1);
  const exact::Shape slice{builder.mesh, {.lower = {0, 0}, .upper = {20, 1}}};
  const Patches patches(slice.mesh, scene_of(slice));
  EXPECT_EQ(patches.list().size(), 5U);
  for (const auto& patch : patches.list()) {
    EXPECT_EQ(patch.area, 4);
    EXPECT_EQ(patch.whole, 4);
  }
}

// Alternating deviations of one facet each: the error of a patch is that of their mean.
TEST(Estimate, TakesDeviationsTogetherOnPatches) {
  const exact::Shape wafer = exact::flat_wafer(20, 20);
  const RayScene scene = scene_of(wafer);
  const Patches patches(wafer.mesh, scene);
  const auto deviations = [](std::size_t f, std::span<double> of_facet) {
    for (std::size_t k = 0; k < of_facet.size(); ++k) of_facet[k] = f % 2 == k ? 0.2 : 0.0;
  };
  const FluxEstimate result = estimate(scene, patches,
                                       {.flux = [](std::size_t) { return 0.5; },
                                        .deviations = deviations,
                                        .count = 2,
                                        .divisor = 2});
  for (const float error : result.tally.std_error) EXPECT_FLOAT_EQ(error, 0.2F / std::sqrt(2.0F));
  EXPECT_NEAR(result.error, 0.1 / 0.5, 1e-7);
  EXPECT_FLOAT_EQ(result.tally.patch_mean.front(), 0.5F);
  for (const float error : result.tally.patch_std_error) EXPECT_FLOAT_EQ(error, 0.1F);
  EXPECT_NEAR(result.max_facet_error, 0.2 / std::sqrt(2.0) / 0.5, 1e-6);
}

// Nothing arrived on a sliver and on a whole facet: of the one that says nothing, of the other that
// it gets less than a particle.
TEST(Estimate, BoundsTheErrorOfASliverByThePatchAroundIt) {
  exact::Builder builder;
  builder.grid({0, 0, 0}, {8, 0, 0}, 8, {0, 8, 0}, 8);
  builder.triangle({0, 0, 0}, {0, 1e-2, -1e-2}, {0, 0, -1e-2});
  const exact::Shape shape{builder.mesh, {.lower = {0, 0}, .upper = {8, 8}}};
  const std::size_t sliver = builder.mesh.triangles.size() - 1;
  const RayScene scene = scene_of(shape);
  const Patches patches(shape.mesh, scene);
  constexpr std::size_t dark = 0;
  const FluxSpread spread{
      .flux = [&](std::size_t f) { return f == sliver || f == dark ? 0.0 : 0.5; },
      .deviations = [](std::size_t, std::span<double> of_facet) { of_facet[0] = 0.05; },
      .count = 1,
      .unseen = 0.1};
  const FluxEstimate result = estimate(scene, patches, spread);
  EXPECT_NEAR(result.tally.std_error[sliver], 0.5, 0.05);
  EXPECT_FLOAT_EQ(result.tally.std_error[dark], 0.2F);
  EXPECT_LE(result.max_facet_error, 0.55 / small_flux);
}

// With one patch cut in 16 by position the error is the same as whole: equal noise, equal error.
TEST(Estimate, DoesNotDependOnWhereTheCellsFall) {
  const auto error_of = [](double shift) {
    exact::Shape wafer = exact::flat_wafer(20, 20);
    wafer.sides.lower = {-shift, -shift};
    wafer.sides.upper = {24, 24};
    const RayScene scene = scene_of(wafer);
    const Patches patches(wafer.mesh, scene);
    const auto deviations = [](std::size_t f, std::span<double> of_facet) {
      for (std::size_t k = 0; k < of_facet.size(); ++k) of_facet[k] = f == k ? 1.0 : 0.0;
    };
    return estimate(scene, patches,
                    {.flux = [](std::size_t) { return 1.0; },
                     .deviations = deviations,
                     .count = wafer.mesh.triangles.size(),
                     .divisor = 100})
        .error;
  };
  EXPECT_NEAR(error_of(0), error_of(1), 1e-6);
  EXPECT_NEAR(error_of(0), error_of(2), 1e-6);
}

TEST(Estimate, GivesUnseenFacetsTheErrorOfOneParticle) {
  const exact::Shape wafer = exact::flat_wafer(20, 20);
  const RayScene scene = scene_of(wafer);
  const Patches patches(wafer.mesh, scene);
  const FluxEstimate result =
      estimate(scene, patches,
               {.flux = [](std::size_t f) { return f == 0 ? 1.0 : 0.0; },
                .deviations = [](std::size_t,
                                 std::span<double> of_facet) { std::ranges::fill(of_facet, 0.0); },
                .count = 2,
                .divisor = 2,
                .unseen = 0.01});
  EXPECT_EQ(result.tally.std_error[0], 0);
  EXPECT_FLOAT_EQ(result.tally.std_error[1], 0.02F);
  EXPECT_NEAR(result.error, std::sqrt(24.0 / 25) * 0.01 / 16 / 0.05, 1e-6);
}

}  // namespace
}  // namespace scarp

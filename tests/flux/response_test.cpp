// The target of what follows from the flux, instead of that of the flux.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/running_statistics.h"
#include "flux/rays/patches.h"
#include "tests/flux/ion_traces.h"

namespace scarp {
namespace {

using exact::Shape;
using Engine = FluxOptions::Engine;

struct Case {
  const char* name;
  Engine engine;
  bool ions;
};

Species species_of(const Case& c) {
  if (c.ions) return exact::plasma_ions();
  return {.name = "gas", .sticking = {0.5F}};
}

/// Much at the bottom, some on the walls, nothing on the field; of yields the opposite.
std::vector<std::vector<float>> responses(const Shape& shape, const Species& species, float scale) {
  std::vector<std::vector<float>> result(1 + species.yields.size());
  const std::vector<Vec3f> normals = facet_normals(shape.mesh);
  for (std::size_t f = 0; f < normals.size(); ++f) {
    const bool is_field = corners(shape.mesh, f)[0].z > -1e-3 && normals[f].z > 0.5F;
    const float response = is_field ? 0.0F : normals[f].z > 0.5F ? scale : 0.2F * scale;
    result[0].push_back(response);
    for (std::size_t k = 1; k < result.size(); ++k) result[k].push_back(-0.5F * response);
  }
  return result;
}

class Response : public ::testing::TestWithParam<Case> {};

// Of whole patches: deviations from the mean over seeds against the error that is stated.
TEST_P(Response, HasAnErrorThatIsTrueAndBelowTheTarget) {
  const Shape shape = exact::trench(2, 4, 8, 10);
  const Species species = species_of(GetParam());
  const auto of_tallies = responses(shape, species, 1);
  constexpr double target = 0.02;
  constexpr int seeds = 72;
  std::vector<std::vector<double>> sums(seeds);  // of each facet
  double stated = 0;
  for (int k = 0; k < seeds; ++k) {
    const FluxField flux = exact::trace(shape, species,
                                        {.engine = GetParam().engine,
                                         .target_error = target,
                                         .responses = {of_tallies},
                                         .seed = static_cast<std::uint64_t>(k + 1)});
    EXPECT_TRUE(flux.target_reached());
    ASSERT_TRUE(flux.response_error.has_value());
    EXPECT_LE(*flux.response_error, target);
    EXPECT_GT(*flux.response_error, target / 30);
    stated += std::pow(*flux.response_error, 2) / seeds;
    for (std::size_t f = 0; f < shape.mesh.triangles.size(); ++f) {
      double sum = 0;
      for (std::size_t t = 0; t < of_tallies.size(); ++t)
        sum += static_cast<double>(of_tallies[t][f]) * flux.tallies[t].mean[f];
      sums[k].push_back(sum);
    }
  }
  const Patches patches(shape.mesh, RayScene(shape.mesh, shape.sides, 1));
  const std::vector<double> areas = facet_areas(shape.mesh);
  RunningStatistics true_squares;
  std::vector<double> by_seed(seeds);
  double area = 0;
  for (const Patches::Patch& patch : patches.list()) {
    std::vector<double> means(seeds);
    double mean = 0;
    for (int k = 0; k < seeds; ++k) {
      for (const std::uint32_t f : patch.facets) means[k] += sums[k][f] * areas[f] / patch.area;
      mean += means[k] / seeds;
    }
    const double share = patch.area * std::min(1.0, patch.area / patch.whole);
    for (int k = 0; k < seeds; ++k)
      by_seed[k] += share * std::pow(means[k] - mean, 2) / (1 - 1.0 / seeds);
    area += patch.area;
  }
  for (const double squares : by_seed) true_squares.add(squares / area / stated);
  EXPECT_NEAR(true_squares.mean(), 1, 0.1 + 4 * true_squares.std_error());
  EXPECT_LT(true_squares.std_error(), 0.2);
}

TEST_P(Response, TakesFewerRaysTheLessFollows) {
  const Shape shape = exact::trench(2, 4, 8, 10);
  const Species species = species_of(GetParam());
  const auto trace = [&](float scale) {
    return exact::trace(shape, species,
                        {.engine = GetParam().engine,
                         .target_error = 3e-4,
                         .responses = {responses(shape, species, scale)}});
  };
  const FluxField much = trace(0.3F);
  const FluxField little = trace(0.03F);
  EXPECT_TRUE(much.target_reached());
  EXPECT_TRUE(little.target_reached());
  EXPECT_LT(3 * little.rays, much.rays);
  EXPECT_EQ(trace(0).response_error, 0);
  EXPECT_LE(trace(0).rays, little.rays);
}

INSTANTIATE_TEST_SUITE_P(Engines, Response,
                         ::testing::Values(Case{"forward", Engine::forward, false},
                                           Case{"gather", Engine::gather, false},
                                           Case{"ions_forward", Engine::forward, true},
                                           Case{"ions", Engine::gather, true}),
                         [](const auto& info) { return info.param.name; });

// What one tally does and another undoes has no error: they are off together.
TEST(Response, KnowsThatTalliesAreOffTogether) {
  const Shape shape = exact::trench(2);
  Species ions{.name = "ion", .source = {.cosine_power = 20}, .ions = Ions{}};
  ions.ions->energy = EnergyDistribution::gaussian(100, 0);
  ions.yields = {{.name = "y", .amplitude = 0.1}};  // one of each
  const std::vector<float> one(shape.mesh.triangles.size(), 1.0F);
  const std::vector<float> minus_one(shape.mesh.triangles.size(), -1.0F);
  for (const Engine engine : {Engine::forward, Engine::gather}) {
    const auto error = [&](const std::vector<float>& of_yield) {
      return *exact::trace(shape, ions,
                           {.engine = engine, .responses = {{one, of_yield}}, .rays = 1 << 14})
                  .response_error;
    };
    EXPECT_GT(error(one), 1e-3);
    EXPECT_LT(error(minus_one), 1e-5);
  }
}

}  // namespace
}  // namespace scarp

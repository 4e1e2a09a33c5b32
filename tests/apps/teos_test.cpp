// Oxide from TEOS on whole surfaces.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "apps/simulator/simulator.h"
#include "apps/simulator/surface_speeds.h"
#include "flux/solve.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

constexpr const char* trench = R"(
[domain]
mode = "2d"
spacing = "20 nm"
extent = ["800 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "400 nm"
depth = "800 nm"
[flux]
target_error = 0.005
[[step]]
duration = "1 s"
material = "SiO2"
)";

std::string precursor(const std::string& order) {
  return "[[step.precursor]]\ngrowth_rate = \"1 nm/s\"\nsticking = 0.2\norder = " + order + "\n";
}

struct Covered {
  Survey survey;
  std::vector<float> speeds;

  explicit Covered(const Recipe& recipe) {
    State state = start_state(recipe.domain.frame, recipe.start);
    begin_step(state, recipe.steps);
    survey = scarp::survey(state, recipe);
    speeds = facet_speeds(state, survey);
  }

  /// The mean speed of the floor over that of the field.
  double step_coverage() const {
    const std::vector<double> areas = facet_areas(survey.facets);
    double floor = 0;
    double field = 0;
    double floor_area = 0;
    double field_area = 0;
    for (std::size_t f = 0; f < areas.size(); ++f) {
      const Triangle& t = survey.facets.triangles[f];
      const auto is_at = [&](float z) {
        return std::ranges::all_of(
            t, [&](std::uint32_t v) { return std::abs(survey.facets.vertices[v].z - z) < 1; });
      };
      if (is_at(-800)) {
        floor += areas[f] * speeds[f];
        floor_area += areas[f];
      } else if (is_at(0)) {
        field += areas[f] * speeds[f];
        field_area += areas[f];
      }
    }
    return floor / floor_area / (field / field_area);
  }
};

// Of the first order there is nothing but a constant sticking, as in single_particle, to the bit.
TEST(Teos, OfTheFirstOrderIsASingleParticle) {
  const Covered teos(read_text(trench + std::string("model = \"teos\"\n") + precursor("1")));
  const Covered single(read_text(
      trench +
      std::string("model = \"single_particle\"\ngrowth_rate = \"1 nm/s\"\nsticking = 0.2\n")));
  EXPECT_EQ(teos.speeds, single.speeds);
}

// Flux and coverage fit on every facet, theta = min(F, 1); with half the order what is covered less
// takes up more, so less arrives at the floor, but growth falls with its root.
TEST(Teos, CoverageFitsTheFluxOnEveryFacet) {
  for (const std::string order : {"0.5", "2"}) {
    const Recipe recipe = read_text(trench + std::string("model = \"teos\"\n") + precursor(order));
    const Covered found(recipe);
    EXPECT_TRUE(found.survey.coverage_fit.reached);
    const Tally& tally = found.survey.flux.front().arrivals();
    const std::vector<float>& flux = tally.mean;
    for (std::size_t f = 0; f < flux.size(); ++f)
      EXPECT_NEAR(found.survey.coverages[0][f], std::min(1.0F, flux[f]),
                  2 * recipe.flux.coverages.tolerance);
    // Again with the sticking that follows, by itself.
    Species fixed = recipe.steps[0].model->species().front();
    fixed.sticking.clear();
    TriMesh facets = found.survey.facets;
    for (std::size_t f = 0; f < flux.size(); ++f) {
      facets.materials[f] = static_cast<MaterialId>(f);
      fixed.sticking.push_back(static_cast<float>(
          std::min(1.0, 0.2 * std::pow(found.survey.coverages[0][f], std::stod(order) - 1))));
    }
    FluxOptions options = recipe.flux.options;
    options.target_error = 0.003;
    const FluxField again = solve_flux(facets, {&fixed, 1}, options).front();
    double off = 0;
    double stated = 0;
    for (std::size_t f = 0; f < flux.size(); ++f) {
      off += std::abs(again.arrivals().mean[f] - flux[f]) / flux[f];
      stated += std::hypot(again.arrivals().std_error[f], tally.std_error[f]) / flux[f];
    }
    const auto count = static_cast<double>(flux.size());
    EXPECT_LT(off / count, 0.02) << order;
    EXPECT_LT(off, 1.2 * stated + recipe.flux.coverages.tolerance * count) << order;
  }
}

// Half a film of a precursor that hardly sticks evens out the other half.
TEST(Teos, TwoPrecursorsHaveTheMeanOfTheirStepCoverages) {
  const auto coverage = [](const std::string& precursors) {
    return Covered(read_text(trench + std::string("model = \"teos\"\n") + precursors))
        .step_coverage();
  };
  const std::string sticks = "[[step.precursor]]\ngrowth_rate = \"1 nm/s\"\nsticking = 0.5\n";
  const std::string hardly = "[[step.precursor]]\ngrowth_rate = \"1 nm/s\"\nsticking = 1e-4\n";
  const double low = coverage(sticks);
  const double high = coverage(hardly);
  EXPECT_LT(low, 0.5);
  EXPECT_NEAR(high, 1, 0.01);
  EXPECT_NEAR(coverage(sticks + hardly), 0.5 * (low + high), 0.02);
}

}  // namespace
}  // namespace scarp

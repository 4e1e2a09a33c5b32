// Coverages and fluxes through a cycle, where one equation tells both for all times.

#include "apps/simulator/coverage_cycle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace scarp {
namespace {

constexpr double rate = 2;    // of the coverage where all arrives
constexpr double hides = 50;  // how much less arrives where all is bare
constexpr double leaves = 0.3;

/// One gas that arrives the less the barer the surface, F = 1 / (1 + hides (1 - theta)), and covers
/// it with the rate F (1 - theta); then what covers it leaves.
class Filling final : public CycledCoverages {
 public:
  explicit Filling(std::vector<double> phases) : phases_(std::move(phases)) {}

  std::vector<std::string> coverage_names() const override { return {"gas"}; }
  std::vector<double> phases() const override { return phases_; }
  std::vector<std::vector<float>> coverages_after(
      double seconds, std::size_t phase, const SurfacePoints& points,
      std::span<const std::span<const float>> flux) const override {
    std::vector<float> after;
    for (std::size_t p = 0; p < points.material.size(); ++p) {
      const double theta = points.coverages[0][p];
      after.push_back(
          static_cast<float>(phase == 0 ? 1 - (1 - theta) * std::exp(-rate * flux[0][p] * seconds)
                                        : theta * std::exp(-leaves * seconds)));
    }
    return {after};
  }
  std::vector<std::vector<float>> covered_sticking(
      const SurfacePoints&, std::span<const std::vector<float>> coverages) const override {
    std::vector<float> sticking;
    for (const float theta : coverages[0]) sticking.push_back(1 - theta);
    return {sticking};
  }

 private:
  std::vector<double> phases_;
};

/// t(theta) of the first phase.
double time_to(double theta) { return (hides * theta - std::log(1 - theta)) / rate; }

struct Cycled {
  double theta = 0;
  CoverageFit fit;
};

TriMesh one_facet() {
  TriMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.materials = {0};
  return mesh;
}

// The flux at the sticking that was asked for, as long as there are questions.
void solve(StickingFeedback& feedback) {
  std::vector<float> flux{1};
  std::vector<std::vector<float>> sticking{{1}};
  const auto ask = [&] {
    const std::vector<std::span<const float>> tallies{flux};
    return feedback.update(tallies, sticking);
  };
  while (ask()) flux[0] = static_cast<float>(1 / (1 + hides * sticking[0][0]));
}

Cycled cycle(const std::vector<double>& phases, const CoverageOptions& options) {
  const Filling model(phases);
  const TriMesh mesh = one_facet();
  CoverageCycle cycle(model, mesh, options);
  StickingFeedback feedback = cycle.feedback();
  EXPECT_EQ(feedback.species, std::vector<bool>{true});
  solve(feedback);
  return {cycle.coverages()[0][0], cycle.fit()};
}

TEST(CoverageCycleTest, FollowsTheExactSolutionAsCloselyAsAsked) {
  for (const double theta : {0.3, 0.9, 0.99}) {
    int fewest = 0;
    for (const double tolerance : {1e-3, 1e-4, 1e-5}) {
      const Cycled found = cycle({time_to(theta)}, {.tolerance = tolerance});
      EXPECT_TRUE(found.fit.reached);
      EXPECT_LE(found.fit.change, tolerance);
      // The tolerance is that of a step.
      EXPECT_NEAR(found.theta, theta, found.fit.iterations * tolerance) << tolerance;
      EXPECT_GT(found.fit.iterations, fewest);
      fewest = found.fit.iterations;
    }
    // A tenth of the error of a step of third order takes 2.2 times as many.
    EXPECT_LT(fewest, 100) << theta;
  }
}

TEST(CoverageCycleTest, GoesThroughAllPhases) {
  const Cycled found = cycle({time_to(0.8), 2, 0.5}, {});
  EXPECT_NEAR(found.theta, 0.8 * std::exp(-leaves * 2.5), 4e-4);
  EXPECT_TRUE(found.fit.reached);
}

// Also with fewer solutions than it takes: then it tells the error.
TEST(CoverageCycleTest, ComesToTheEndInAnyNumberOfSteps) {
  for (const int most : {1, 2, 5, 9}) {
    const Cycled found = cycle({time_to(0.9), 1}, {.tolerance = 1e-6, .most_iterations = most});
    EXPECT_FALSE(found.fit.reached);
    EXPECT_GT(found.fit.change, 1e-6);
    EXPECT_GT(found.theta, 0);
    EXPECT_LE(found.theta, 1);
    EXPECT_LE(found.fit.iterations, most + 3);
  }
}

// With every number of rays it is a cycle of its own.
TEST(CoverageCycleTest, BeginsAnewWithEveryNumberOfRays) {
  const Filling model({time_to(0.9)});
  const TriMesh mesh = one_facet();
  CoverageCycle cycle(model, mesh, {});
  StickingFeedback feedback = cycle.feedback();
  solve(feedback);
  const float first = cycle.coverages()[0][0];
  const int iterations = cycle.fit().iterations;
  solve(feedback);
  EXPECT_EQ(cycle.coverages()[0][0], first);
  EXPECT_EQ(cycle.fit().iterations, 2 * iterations);
}

}  // namespace
}  // namespace scarp

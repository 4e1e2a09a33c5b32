#include "flux/rays/shots.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/running_statistics.h"
#include "flux/engines/view.h"
#include "flux/solve.h"
#include "tests/flux/shape_problem.h"

namespace scarp {
namespace {

/// From a trench so deep that its lower part aims at the sky.
class Shots : public ::testing::TestWithParam<bool>, protected exact::ShapeProblem {
 protected:
  // Leans to a side, so that rays along its lobe have images.
  Shots()
      : ShapeProblem(exact::trench(15),
                     {.name = "gas", .source = {.cosine_power = 20, .direction = {0.6, 0, -0.8}}},
                     GetParam()) {
    aim_at_sky(problem, plan_);
    plan_.grow(8, 1'000'000);
  }

  std::vector<Shot> shots(const Shooter& shooter, std::uint32_t first) const {
    return shooter.shoot(0, plan_.size(), [first](std::size_t) { return first; });
  }

  static void expect_same(const Shot& a, const Shot& b) {
    EXPECT_EQ(a.ray.r, b.ray.r);
    EXPECT_EQ(a.ray.u, b.ray.u);
    EXPECT_EQ(a.ray.from, b.ray.from);
    EXPECT_EQ(a.u, b.u);
    EXPECT_EQ(a.weight, b.weight);
  }

  RayPlan plan_{scene, elements};
};

TEST_P(Shots, AreTheSameByTheirNames) {
  for (const auto law : {Shooter::Law::lambert, Shooter::Law::lobe}) {
    const Shooter shooter(problem, plan_, law);
    std::size_t weighed = 0;
    std::size_t images = 0;
    for (const Shot& shot : shots(shooter, 0)) {
      expect_same(shooter.shot(shot.name), shot);
      weighed += shot.weight != 1 ? 1 : 0;
      images += shot.name.image != 0 ? 1 : 0;
    }
    EXPECT_GT(weighed, 100U);
    EXPECT_EQ(images > 100, law == Shooter::Law::lobe);
  }
}

TEST_P(Shots, GoOnWhereTheyWere) {
  constexpr std::uint32_t first = 3;
  const Shooter shooter(problem, plan_, Shooter::Law::lambert);
  const std::vector<Shot> later = shots(shooter, first);
  std::size_t k = 0;
  for (const Shot& shot : shots(shooter, 0)) {
    if (shot.name.index < first) continue;
    ASSERT_LT(k, later.size());
    expect_same(later[k++], shot);
  }
  EXPECT_EQ(k, later.size());
}

// Rays of both kinds are in the gas, and their weights have the mean of those that all go by
// Lambert's law: what is aimed into the solid counts 0.
TEST_P(Shots, StandForWholeViews) {
  const Shooter shooter(problem, plan_, Shooter::Law::lambert);
  std::vector<double> sums(plan_.size());
  for (const Shot& shot : shots(shooter, 0)) {
    EXPECT_GT(dot(shot.u, problem.normal(shot.ray.from)), 0);
    sums[shot.name.rank] += static_cast<double>(shot.weight);
  }
  RunningStatistics aimed;
  for (std::size_t rank = 0; rank < plan_.size(); ++rank) {
    const double mean = sums[rank] / (set_count * static_cast<double>(plan_.rays(rank)));
    if (plan_.block_of(rank).aims_at_sky) {
      aimed.add(mean);
    } else {
      EXPECT_EQ(mean, 1);
    }
  }
  EXPECT_GT(aimed.count(), 20U);
  EXPECT_NEAR(aimed.mean(), 1, 4 * aimed.std_error());
}

// Between parallel strips: what the bottom sees of the opening is sqrt(1 + A^2) - A.
TEST_P(Shots, FindTheSkyFromTheBottomOfADeepTrench) {
  const double seen = std::sqrt(1 + 15.0 * 15.0) - 15;
  const Species sticky{.name = "gas"};
  RunningStatistics flux;
  for (std::uint64_t seed = 1; seed <= 48; ++seed) {
    FluxOptions gathering = options;
    gathering.engine = FluxOptions::Engine::gather;
    gathering.spacing = 1;
    gathering.rays = 1 << 13;
    gathering.seed = seed;
    const FluxField field = solve_flux(shape.mesh, {&sticky, 1}, gathering).front();
    double sum = 0;
    double area = 0;
    for (std::size_t f = 0; f < scene.facet_count(); ++f) {
      const auto [a, b, c] = corners(shape.mesh, f);
      if (std::max({a.z, b.z, c.z}) > -299) continue;
      sum += scene.area(f) * static_cast<double>(field.arrivals().mean[f]);
      area += scene.area(f);
    }
    flux.add(sum / area);
  }
  EXPECT_NEAR(flux.mean(), seen, 4 * flux.std_error());
  EXPECT_LT(flux.std_error(), 0.02 * seen);
}

INSTANTIATE_TEST_SUITE_P(TwoDimensional, Shots, ::testing::Bool());

}  // namespace
}  // namespace scarp

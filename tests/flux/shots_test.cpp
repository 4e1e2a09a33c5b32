#include "flux/shots.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/running_statistics.h"
#include "flux/solve.h"
#include "flux/view.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using exact::Shape;

/// From a trench so deep that its lower part aims at the sky.
class Shots : public ::testing::TestWithParam<bool> {
 protected:
  Shots() {
    aim_at_sky(problem_, plan_);
    plan_.grow(8, 1'000'000);
  }

  std::vector<Shot> shots(const Shooter& shooter, std::uint32_t first) const {
    std::vector<Shot> all;
    for (std::size_t rank = 0; rank < plan_.size(); ++rank) shooter.shoot(rank, first, all);
    return all;
  }

  static void expect_same(const Shot& a, const Shot& b) {
    EXPECT_EQ(a.ray.r, b.ray.r);
    EXPECT_EQ(a.ray.u, b.ray.u);
    EXPECT_EQ(a.ray.from, b.ray.from);
    EXPECT_EQ(a.u, b.u);
    EXPECT_EQ(a.weight, b.weight);
  }

  Shape shape_ = exact::trench(15);
  RayScene scene_{shape_.mesh, shape_.sides, 1};
  Patches patches_{shape_.mesh, scene_};
  std::vector<float> sticking_ = std::vector<float>(scene_.facet_count(), 0.5F);
  // Leans to a side, so that rays along its lobe have images.
  Species species_{.name = "gas", .source = {.cosine_power = 20, .direction = {0.6, 0, -0.8}}};
  FluxOptions options_{.sides = shape_.sides, .two_dimensional = GetParam()};
  FluxProblem problem_{.mesh = shape_.mesh,
                       .scene = scene_,
                       .patches = patches_,
                       .sticking = sticking_,
                       .species = species_,
                       .options = options_};
  Elements elements_{scene_, longest_element_edge};
  RayPlan plan_{scene_, elements_};
};

TEST_P(Shots, AreTheSameByTheirNames) {
  for (const auto law : {Shooter::Law::lambert, Shooter::Law::lobe}) {
    const Shooter shooter(problem_, plan_, law);
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
  const Shooter shooter(problem_, plan_, Shooter::Law::lambert);
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
  const Shooter shooter(problem_, plan_, Shooter::Law::lambert);
  std::vector<double> sums(plan_.size());
  for (const Shot& shot : shots(shooter, 0)) {
    EXPECT_GT(dot(shot.u, problem_.normal(shot.ray.from)), 0);
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
  for (std::uint64_t seed = 1; seed <= 32; ++seed) {
    FluxOptions options = options_;
    options.engine = FluxOptions::Engine::gather;
    options.spacing = 1;
    options.rays = 1 << 13;
    options.seed = seed;
    const FluxField field = solve_flux(shape_.mesh, {&sticky, 1}, options).front();
    double sum = 0;
    double area = 0;
    for (std::size_t f = 0; f < scene_.facet_count(); ++f) {
      const auto [a, b, c] = corners(shape_.mesh, f);
      if (std::max({a.z, b.z, c.z}) > -299) continue;
      sum += scene_.area(f) * static_cast<double>(field.arrivals().mean[f]);
      area += scene_.area(f);
    }
    flux.add(sum / area);
  }
  EXPECT_NEAR(flux.mean(), seen, 4 * flux.std_error());
  EXPECT_LT(flux.std_error(), 0.02 * seen);
}

INSTANTIATE_TEST_SUITE_P(TwoDimensional, Shots, ::testing::Bool());

}  // namespace
}  // namespace scarp

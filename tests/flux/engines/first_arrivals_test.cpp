#include "flux/engines/first_arrivals.h"

#include <gtest/gtest.h>

#include "tests/flux/ion_traces.h"
#include "tests/flux/shape_problem.h"

namespace scarp {
namespace {

using exact::degree;

class FirstArrivalsTest : public ::testing::Test, protected exact::ShapeProblem {
 protected:
  FirstArrivalsTest() : ShapeProblem(exact::trench(2), exact::plasma_ions()) {}
  FirstArrivals look_with(const RayPlan& plan, const FirstArrivals& earlier) const {
    return look_for_source(problem, plan, earlier);
  }
};

TEST_F(FirstArrivalsTest, OfASecondLookAreThoseOfOne) {
  RayPlan plan(scene, elements);
  plan.grow(4, 1'000'000);
  const FirstArrivals first = look_with(plan, {});
  plan.grow(15, 1'000'000);
  const FirstArrivals two = look_with(plan, first);
  const FirstArrivals one = look_with(plan, {});  // with the same rays
  EXPECT_LT(first.flights, one.flights);
  EXPECT_EQ(two.flights, one.flights);
  EXPECT_EQ(two.lit.size(), one.lit.size());
  for (std::size_t k = 1; k < two.lit.size(); ++k)
    ASSERT_LE(two.lit[k - 1].name.rank, two.lit[k].name.rank);
  for (std::size_t q = 0; q < one.sums.size(); ++q)
    for (std::size_t k = 0; k < one.sums[q].size(); ++k)
      EXPECT_NEAR(two.sums[q][k], one.sums[q][k], 1e-12 * one.sums[q][k]);
  EXPECT_EQ(two.rays, one.rays);
}

// The rays that started particles are found again.
TEST_F(FirstArrivalsTest, NameTheRaysThatMetTheSource) {
  species.source.direction = {std::sin(20 * degree), 0, -std::cos(20 * degree)};
  RayPlan plan(scene, elements);
  plan.grow(4, 1'000'000);
  const FirstArrivals found = look_with(plan, {});
  const Shooter shooter(problem, plan, Shooter::Law::lobe);
  double goes_on = 0;
  for (const FirstArrivals::Lit& lit : found.lit) {
    const Shot shot = shooter.shot(lit.name);
    EXPECT_TRUE(shooter.meets_source(shot, scene.fly(shot.ray)));
    const double cosine = dot(shot.u, problem.normal(shot.ray.from));
    const double sticks = species.ions->sticking.at(AngleTable::half_sine(cosine));
    EXPECT_NEAR(lit.goes_on, cosine / shot.u.z * (1 - 0.5 * sticks), 1e-6);
    goes_on += lit.goes_on;
  }
  double sum = 0;
  for (const double part : found.sums.back()) sum += part;
  EXPECT_NEAR(goes_on, sum, 1e-9 * sum);
  EXPECT_GT(sum, 0);
}

TEST_F(FirstArrivalsTest, KnowWhetherAllStick) {
  EXPECT_FALSE(sticks_at_once(problem));
  std::fill(sticking.begin(), sticking.end(), 1.0F);
  EXPECT_FALSE(sticks_at_once(problem));  // not at glancing angles
  species.ions->sticking = AngleTable(1);
  EXPECT_TRUE(sticks_at_once(problem));
  sticking.back() = 0.9F;
  EXPECT_FALSE(sticks_at_once(problem));
}

}  // namespace
}  // namespace scarp

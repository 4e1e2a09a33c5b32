#include "flux/engines/onward.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <set>

#include "tests/flux/ion_traces.h"
#include "tests/flux/shape_problem.h"

namespace scarp {
namespace {

class OnwardParticlesTest : public ::testing::Test, protected exact::ShapeProblem {
 protected:
  OnwardParticlesTest() : ShapeProblem(exact::trench(2), exact::plasma_ions()) {
    plan.grow(8, 1'000'000);
    arrivals = look_for_source(problem, plan, {});
  }

  RayPlan plan{scene, elements};
  FirstArrivals arrivals;
};

// Each batch has its own part of the arrivals, close together in it by turns: equal shares. No two
// particles have the same random numbers, in no round.
TEST_F(OnwardParticlesTest, OfABatchFollowEachOtherAndHaveNumbersOfTheirOwn) {
  constexpr std::uint64_t wanted = 3200;
  std::set<std::uint64_t> rays;
  std::uint64_t first = 0;
  for (int round = 0; round < 2; ++round) {
    const OnwardParticles particles(problem, plan, arrivals, wanted, first);
    EXPECT_NEAR(static_cast<double>(particles.count()), wanted, batch_count);
    std::array<int, batch_count> of_batch{};
    std::uint64_t before = 0;
    for (std::uint64_t k = 0; k < particles.count(); ++k) {
      const Particle particle = particles.start(k);
      const std::uint64_t batch = particle.ray % batch_count;
      ASSERT_LE(before, batch);
      before = batch;
      ++of_batch[batch];
      EXPECT_TRUE(rays.insert(particle.ray).second);
    }
    for (const int count : of_batch) EXPECT_NEAR(count, 100, 10);
    first += particles.count();
  }
}

// As they arrive, with the weight of a start and an energy of the source.
TEST_F(OnwardParticlesTest, HaveArrivedWhereTheyStart) {
  const OnwardParticles particles(problem, plan, arrivals, 500, 0);
  for (std::uint64_t k = 0; k < particles.count(); ++k) {
    const Particle particle = particles.start(k);
    ASSERT_LT(particle.facet, scene.facet_count());
    const Vec3d n = scene.normal(particle.facet);
    EXPECT_LT(dot(Vec3d(particle.u), n), 0);
    EXPECT_NEAR(dot(particle.r - Vec3d(scene.corners(particle.facet)[0]), n), 0, 1e-5);
    EXPECT_EQ(particle.weight, Particle::unit_weight);
    EXPECT_GT(particle.energy, 0);
    EXPECT_GT(particle.block, 0U);  // that of the energy is used
  }
}

}  // namespace
}  // namespace scarp

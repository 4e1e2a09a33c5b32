#include "flux/view.h"

#include <gtest/gtest.h>

#include "core/parallel.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

class Views : public ::testing::Test {
 protected:
  FluxProblem problem() const {
    return {.mesh = shape_.mesh,
            .scene = scene_,
            .patches = patches_,
            .sticking = sticking_,
            .species = species_,
            .options = options_};
  }
  View look_with(const RayPlan& plan, const View& earlier) const {
    const FluxProblem one = problem();
    return look({&one, 1}, plan, earlier);
  }

  exact::Shape shape_ = exact::trench(2);
  RayScene scene_{shape_.mesh, shape_.sides, 1};
  Patches patches_{shape_.mesh, scene_};
  std::vector<float> sticking_ = std::vector<float>(scene_.facet_count(), 0.5F);
  Species species_{.name = "gas", .source = {.cosine_power = 2}};
  FluxOptions options_;
  Elements elements_{scene_, 3};
};

TEST_F(Views, AreTheSameInOneLookAndInTwo) {
  RayPlan plan(scene_, elements_);
  plan.grow(2, 1'000'000);
  const View first = look_with(plan, {});
  plan.grow(7, 1'000'000);
  const View two = look_with(plan, first);
  const View one = look_with(plan, {});
  EXPECT_EQ(two.matrix.first, one.matrix.first);
  EXPECT_EQ(two.matrix.hits, one.matrix.hits);
  for (std::size_t k = 0; k < one.direct[0].size(); ++k)
    EXPECT_NEAR(two.direct[0][k], one.direct[0][k], 1e-5 * one.direct[0][k]);
  EXPECT_EQ(two.flights, one.flights);
}

TEST_F(Views, DoNotDependOnTheNumberOfThreads) {
  RayPlan plan(scene_, elements_);
  plan.grow(7, 1'000'000);
  std::vector<View> views;
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    views.push_back(look_with(plan, {}));
  }
  EXPECT_EQ(views[0].matrix.hits, views[1].matrix.hits);
  EXPECT_EQ(views[0].direct, views[1].direct);
}

// The facets of an element share its rays by area.
TEST(JoinedViews, SendRaysFromAllFacetsOfAnElement) {
  const exact::Shape shape = exact::flat_wafer(16, 16);
  const RayScene scene = scene_of(shape);
  const Patches patches(shape.mesh, scene);
  const std::vector<float> sticking(scene.facet_count(), 1);
  const Species gas{.name = "gas"};
  const FluxOptions options{.sides = shape.sides};
  const FluxProblem problem{.mesh = shape.mesh,
                            .scene = scene,
                            .patches = patches,
                            .sticking = sticking,
                            .species = gas,
                            .options = options};
  Elements elements(scene, longest_element_edge);
  elements.join(shape.mesh);
  RayPlan plan(scene, elements);
  plan.grow(64, 1'000'000);
  const Shooter shooter(problem, plan, Shooter::Law::lambert);
  std::vector<Shot> shots;
  for (std::size_t rank = 0; rank < plan.size(); ++rank) shooter.shoot(rank, 0, shots);
  std::vector<double> rays(scene.facet_count());
  for (const Shot& shot : shots) {
    ++rays[shot.ray.from];
    const auto& [a, b, c] = scene.corners(shot.ray.from);
    const Box box{{std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y}), 0},
                  {std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y}), 0}};
    EXPECT_GE(shot.ray.r.x, box.lower.x - 1e-9);
    EXPECT_LE(shot.ray.r.x, box.upper.x + 1e-9);
    EXPECT_GE(shot.ray.r.y, box.lower.y - 1e-9);
    EXPECT_LE(shot.ray.r.y, box.upper.y + 1e-9);
  }
  // A scrambled net puts as many points as its size tells in each part, but for one or two at ends.
  for (const double count : rays) EXPECT_NEAR(count, 32, 6);
}

// What a row sees of another, area_i K_ij = area_j K_ji: on average over the two walls.
TEST_F(Views, AreReciprocal) {
  RayPlan plan(scene_, elements_);
  plan.grow(200, 1'000'000);
  const View view = look_with(plan, {});
  const auto group_of = [&](std::size_t rank) {
    const std::uint32_t facet =
        elements_.piece(elements_.pieces_of(plan.element_at(rank)).front()).facet;
    const Vec3d n = scene_.normal(facet);
    const bool is_bottom = scene_.corners(facet)[0].z < 0 && n.z > 0.5;
    return is_bottom ? 0 : n.x > 0.5 ? 1 : n.x < -0.5 ? 2 : 3;
  };
  std::array<std::array<double, 4>, 4> exchange{};
  for (std::size_t i = 0; i < view.matrix.size(); ++i) {
    const auto rays = static_cast<double>(view.matrix.first[i + 1] - view.matrix.first[i]);
    for (std::uint64_t k = view.matrix.first[i]; k < view.matrix.first[i + 1]; ++k) {
      if (view.matrix.hits[k] >= view.matrix.size()) continue;
      exchange[group_of(i)][group_of(view.matrix.hits[k])] +=
          elements_.area(plan.element_at(i)) / rays;
    }
  }
  // View factors of a trench of width 20 and depth 40 per length of 8: bottom to wall by strings.
  const double bottom_to_wall = 8 * (20 + 40 - std::sqrt(20.0 * 20 + 40 * 40)) / 2;
  EXPECT_NEAR(exchange[0][1], bottom_to_wall, 0.02 * bottom_to_wall);
  EXPECT_NEAR(exchange[1][0], bottom_to_wall, 0.02 * bottom_to_wall);
  EXPECT_NEAR(exchange[0][1], exchange[2][0], 0.02 * bottom_to_wall);
  EXPECT_EQ(exchange[3][3], 0);
}

}  // namespace
}  // namespace scarp

#include "flux/engines/view.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "core/running_statistics.h"
#include "tests/flux/shape_problem.h"

namespace scarp {
namespace {

class Views : public ::testing::Test, protected exact::ShapeProblem {
 protected:
  Views() : ShapeProblem(exact::trench(2), {.name = "gas", .source = {.cosine_power = 2}}) {}

  View look_with(const RayPlan& plan, const View& earlier) const {
    return look({&problem, 1}, plan, earlier);
  }
};

TEST_F(Views, AreTheSameInOneLookAndInTwo) {
  RayPlan plan(scene, elements);
  plan.grow(2, 1'000'000);
  const View first = look_with(plan, {});
  plan.grow(7, 1'000'000);
  const View two = look_with(plan, first);
  const View one = look_with(plan, {});
  EXPECT_EQ(two.matrix.first, one.matrix.first);
  EXPECT_EQ(two.matrix.rays, one.matrix.rays);
  for (std::size_t k = 0; k < one.direct[0].size(); ++k)
    EXPECT_NEAR(two.direct[0][k], one.direct[0][k], 1e-5 * one.direct[0][k]);
  EXPECT_EQ(two.flights, one.flights);
}

TEST_F(Views, DoNotDependOnTheNumberOfThreads) {
  RayPlan plan(scene, elements);
  plan.grow(7, 1'000'000);
  std::vector<View> views;
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    views.push_back(look_with(plan, {}));
  }
  EXPECT_EQ(views[0].matrix.rays, views[1].matrix.rays);
  EXPECT_EQ(views[0].direct, views[1].direct);
}

// On a wall that sees the sky between the elevation a of the other wall's edge and the vertical,
// the flux is (1 - sin a) / 2 and grows by cos(a) / 2 for each radian that it leans back; rays
// closer to the wall than a cosine of 0.2 count less, which is 0.2 / pi.
TEST(ChangeWithNormal, IsThatOfTheSkyAboveAWall) {
  const exact::ShapeProblem trench(exact::trench(2), {.name = "gas"});
  RayPlan plan(trench.scene, trench.elements);
  plan.grow(64, 4'000'000);
  const View view = look({&trench.problem, 1}, plan, {});
  std::vector<double> flux(plan.size());
  for (std::size_t i = 0; i < flux.size(); ++i)
    flux[i] = static_cast<double>(view.direct[0][2 * i] + view.direct[0][2 * i + 1]) /
              static_cast<double>(view.matrix.row(i).size());
  const std::vector<Vec3d> change = change_with_normal(view, 0, flux);
  RunningStatistics off;
  for (std::size_t i = 0; i < flux.size(); ++i) {
    const std::uint32_t e = plan.element_at(i);
    const double depth = trench.scene.source_height() - 1 - trench.elements.middle(e).z;
    if (std::abs(trench.elements.normal(e).x) < 0.9 || depth < 10 || depth > 30) continue;
    const double cosine = 1 / std::hypot(1.0, depth / 20);
    off.add(change[i].z - (cosine / 2 - 0.2 / std::numbers::pi));
  }
  EXPECT_GT(off.count(), 50U);
  EXPECT_LT(off.std_error(), 0.003);
  EXPECT_NEAR(off.mean(), 0, 4 * off.std_error());
}

/// A pit six times as deep as wide.
class DeepViews : public ::testing::Test, protected exact::ShapeProblem {
 protected:
  DeepViews() : ShapeProblem(exact::hole(6, 11, 3, 24), {.name = "gas"}) {
    aim_at_sky(problem, plan_);
  }

  View view(const View& earlier = {}) const { return look({&problem, 1}, plan_, earlier); }
  double depth(std::size_t rank) const {
    return scene.source_height() - 1 - elements.middle(plan_.element_at(rank)).z;
  }
  double mean_depth(const RayPlan::Window& window) const {
    double sum = 0;
    for (std::size_t rank = window.front().begin; rank < window.back().end; ++rank)
      sum += depth(rank);
    return sum / (window.back().end - window.front().begin);
  }

  RayPlan plan_{scene, elements};
};

TEST_F(DeepViews, AimAtTheSkyFromDeepDownOnly) {
  int deep = 0;
  for (const RayPlan::Window& window : plan_.windows()) {
    const double z = mean_depth(window);
    if (z > 10 && z < 90) continue;
    EXPECT_EQ(window.front().aims_at_sky, z > 90) << z;
    deep += z > 90 ? 1 : 0;
  }
  EXPECT_GT(deep, 2);
}

// What an element sees of others, of the sky and of nothing makes up a whole, unless one of its
// sets met nothing but the sky.
TEST_F(DeepViews, AreWhole) {
  plan_.grow(4, 1'000'000);
  const View seen = view();
  std::size_t scaled = 0;
  for (std::size_t i = 0; i < plan_.size(); ++i) {
    const SetSums sums = seen.sums[i];
    if (sums[0].others == 0 || sums[1].others == 0) continue;
    scaled += sums[0].lacking != 0 || sums[1].lacking != 0 ? 1 : 0;
    double whole = 0;
    seen.matrix.for_each_part(i, [&](std::size_t hit, double part) {
      if (hit != seen.matrix.size() + to_sky) whole += part;
    });
    for (const WeightSums& of_set : sums)
      whole += of_set.sky / static_cast<double>(seen.matrix.row(i).size());
    EXPECT_NEAR(whole, 1, 1e-6);
  }
  EXPECT_GT(4 * scaled, plan_.size());
}

TEST_F(DeepViews, DoNotDependOnTheNumberOfThreads) {
  plan_.grow(2, 1'000'000);
  std::vector<View> views;
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    views.push_back(view());
  }
  EXPECT_EQ(views[0].matrix.rays, views[1].matrix.rays);
  EXPECT_EQ(views[0].matrix.scale, views[1].matrix.scale);
  EXPECT_EQ(views[0].direct, views[1].direct);
}

// What the rays of a set stand for is what they found and what those of the other set lack: taken
// from themselves, what they lack would be small where they found much.
TEST_F(DeepViews, TakeWhatASetLacksFromTheOther) {
  plan_.grow(4, 1'000'000);
  const View seen = view();
  for (std::size_t i = 0; i < plan_.size(); ++i) {
    const SetSums sums = seen.sums[i];
    const auto rays = seen.matrix.row(i);
    std::array<double, set_count> stands_for{};
    for (std::size_t k = 0; k < rays.size(); ++k)
      if (rays[k].hit != plan_.size() + to_sky)
        stands_for[k % set_count] +=
            seen.matrix.scale[i][k % set_count] * static_cast<double>(rays[k].weight);
    for (std::size_t set = 0; set < set_count; ++set) {
      if (sums[set].others == 0) continue;
      const double wanted = sums[set].others + sums[1 - set].lacking;
      EXPECT_NEAR(stands_for[set], wanted / static_cast<double>(rays.size()), 1e-9);
    }
  }
}

// A few rays at once or many in two rounds: neither finds more of the sky than there is above the
// bottom, (R / d)^2 / (1 + (R / d)^2) from its middle, nor more or fewer of the upper half of the
// walls.
TEST_F(DeepViews, AreRightOnAverageHoweverFewTheRaysAre) {
  std::array<RunningStatistics, 2> sky;
  std::array<RunningStatistics, 2> upper_half;
  RayPlan first_round(scene, elements);
  aim_at_sky(problem, first_round);
  first_round.grow(2, 1'000'000);
  for (const std::size_t many : {0U, 1U}) {
    plan_.grow(many != 0 ? 6 : 0, 1'000'000);
    for (options.seed = 1; options.seed <= (many != 0 ? 16U : 64U); ++options.seed) {
      const View seen = view(many != 0 ? look({&problem, 1}, first_round, {}) : View{});
      double area = 0;
      double of_sky = 0;
      double of_upper_half = 0;
      for (std::size_t i = 0; i < plan_.size(); ++i) {
        if (depth(i) < 119.9) continue;
        const double a = elements.area(plan_.element_at(i));
        area += a;
        for (const WeightSums& sums : seen.sums[i])
          of_sky += a * sums.sky / static_cast<double>(seen.matrix.row(i).size());
        seen.matrix.for_each_part(i, [&](std::size_t hit, double part) {
          if (hit < plan_.size() && depth(hit) < 60) of_upper_half += a * part;
        });
      }
      sky[many].add(of_sky / area);
      upper_half[many].add(of_upper_half / area);
    }
  }
  const auto expect_same = [](const std::array<RunningStatistics, 2>& of) {
    const double error = std::hypot(of[0].std_error(), of[1].std_error());
    EXPECT_NEAR(of[0].mean(), of[1].mean(), 4 * error);
    EXPECT_LT(error, 0.1 * of[1].mean());
  };
  expect_same(sky);
  expect_same(upper_half);
  // Of a disk facing another of the same size at 12 radii.
  const double x = 2 + 12.0 * 12;
  EXPECT_NEAR(sky[1].mean(), (x - std::sqrt(x * x - 4)) / 2, 4 * sky[1].std_error() + 1e-5);
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
  Elements elements(scene, longest_piece_edge);
  elements.join(shape.mesh, 2);
  RayPlan plan(scene, elements);
  plan.grow(64, 1'000'000);
  const Shooter shooter(problem, plan, Shooter::Law::lambert);
  const std::vector<Shot> shots = shooter.shoot(0, plan.size(), [](std::size_t) { return 0U; });
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
  RayPlan plan(scene, elements);
  plan.grow(200, 1'000'000);
  const View view = look_with(plan, {});
  const auto group_of = [&](std::size_t rank) {
    const std::uint32_t facet =
        elements.piece(elements.pieces_of(plan.element_at(rank)).front()).facet;
    const Vec3d n = scene.normal(facet);
    const bool is_bottom = scene.corners(facet)[0].z < 0 && n.z > 0.5;
    return is_bottom ? 0 : n.x > 0.5 ? 1 : n.x < -0.5 ? 2 : 3;
  };
  std::array<std::array<double, 4>, 4> exchange{};
  for (std::size_t i = 0; i < view.matrix.size(); ++i) {
    view.matrix.for_each_part(i, [&](std::size_t hit, double part) {
      if (hit < view.matrix.size())
        exchange[group_of(i)][group_of(hit)] += elements.area(plan.element_at(i)) * part;
    });
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

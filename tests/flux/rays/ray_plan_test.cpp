#include "flux/rays/ray_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"
#include "flux/rays/spatial_order.h"
#include "flux/revolution.h"
#include "flux/sampling/sobol.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

TEST(RayPlan, GrowsToTheWantedNumberOfRays) {
  const exact::Shape shape = exact::trench(2);
  const RayScene scene(shape.mesh, shape.sides, 1);
  const Elements elements(scene, longest_piece_edge);
  RayPlan plan(scene, elements);
  double surface = 0;
  for (std::size_t f = 0; f < scene.facet_count(); ++f) surface += scene.area(f);
  EXPECT_EQ(plan.surface(), surface);
  for (const double rays : {20'000.0, 50'000.0, 120'000.0}) {
    plan.grow(rays / surface, 1'000'000);
    EXPECT_NEAR(static_cast<double>(plan.total()), rays, 0.1 * rays);
  }
  std::vector<std::uint32_t> before;
  for (std::size_t rank = 0; rank < plan.size(); ++rank) before.push_back(plan.rays(rank));
  plan.grow(1e6 / surface, 200'000);
  EXPECT_LE(plan.total(), 200'000U);
  EXPECT_GT(plan.total(), 180'000U);
  for (std::size_t rank = 0; rank < plan.size(); ++rank) {
    EXPECT_GE(plan.rays(rank), before[rank]);
    EXPECT_EQ(plan.rank_of(plan.element_at(rank)), rank);
  }
  const std::uint64_t full = plan.total();
  plan.grow(1e6 / surface, full - 1);
  EXPECT_EQ(plan.total(), full);
}

// What sees only the sky has nothing in common with the bottom of a trench.
TEST(RayPlan, FloorsAndTopsAreOfDifferentBlocks) {
  const exact::Shape shape = exact::fine_trench(20, 7);
  const RayScene scene = scene_of(shape);
  const Elements elements(scene, longest_piece_edge);
  const RayPlan plan(scene, elements);
  for (const RayPlan::Window& window : plan.windows()) {
    const auto height = [&](std::uint32_t rank) {
      return elements.middle(plan.element_at(rank)).z;
    };
    for (const RayPlan::Block& block : window) {
      if (block.main_direction < 4) continue;
      for (std::uint32_t rank = block.begin; rank < block.end; ++rank)
        EXPECT_EQ(height(rank), height(window.front().begin));
    }
  }
}

// However few elements a floor has.
TEST(RayPlan, SmallFloorsAreOfTheirOwnWindows) {
  const exact::Shape shape = exact::trench(2, 8, 16, 10);
  const RayScene scene = scene_of(shape);
  Elements elements(scene, longest_piece_edge);
  elements.join(shape.mesh, 4);
  const RayPlan plan(scene, elements);
  std::size_t of_floor = 0;
  for (const RayPlan::Window& window : plan.windows()) {
    if (window.front().main_direction < 4) continue;
    const double height = elements.middle(plan.element_at(window.front().begin)).z;
    if (height > scene.lowest() + 1) continue;
    for (std::uint32_t rank = window.front().begin; rank < window.back().end; ++rank, ++of_floor)
      EXPECT_EQ(elements.middle(plan.element_at(rank)).z, height);
  }
  EXPECT_GT(of_floor, 8U);
  EXPECT_LT(of_floor, 32U);
}

// A wall of 36 rings: neighbours see nearly the same, so that those of two blocks alone would tell
// little of their errors.
TEST(RayPlan, RowsOfRingsHaveFourBlocks) {
  const Vec3d y{0, 1, 0};
  exact::Builder builder;
  builder.grid({0, 0, -36}, {6, 0, 0}, 6, y, 1);
  builder.grid({6, 0, -36}, {0, 0, 36}, 36, y, 1);
  builder.grid({6, 0, 0}, {6, 0, 0}, 6, y, 1);
  const Revolution revolution(builder.mesh, {.lower = {0, 0}, .upper = {12, 1}});
  const RayScene scene(revolution.mesh(), revolution.sides(), 1);
  Elements elements(scene, std::numeric_limits<double>::infinity(), true);
  elements.join_rings(revolution.rings());
  const RayPlan plan(scene, elements);
  std::vector<std::uint32_t> of_wall;
  for (const RayPlan::Window& window : plan.windows())
    for (const RayPlan::Block& block : window)
      if (std::abs(elements.normal(plan.element_at(block.begin)).z) < 0.5)
        of_wall.push_back(block.size());
  EXPECT_EQ(of_wall, (std::vector<std::uint32_t>{8, 8, 8, 8, 4}));
}

TEST(RayPlan, SendsRaysByTheDensitiesOfWindows) {
  const exact::Shape shape = exact::trench(2);
  const RayScene scene(shape.mesh, shape.sides, 1);
  const Elements elements(scene, longest_piece_edge);
  RayPlan plan(scene, elements);
  std::vector<double> densities(plan.windows().size(), 1);
  densities[1] = 4;
  densities[2] = 0.25;
  plan.weigh(densities);
  plan.grow(40, 10'000'000);
  const auto per_area = [&](std::size_t window) {
    double rays = 0;
    double area = 0;
    const RayPlan::Window& blocks = plan.windows()[window];
    for (std::uint32_t rank = blocks.front().begin; rank < blocks.back().end; ++rank) {
      rays += plan.rays(rank);
      area += elements.area(plan.element_at(rank));
    }
    return set_count * rays / area;
  };
  EXPECT_NEAR(per_area(0), 40, 4);
  EXPECT_NEAR(per_area(1), 160, 16);
  EXPECT_NEAR(per_area(2), 10, 2);
}

TEST(RayPlan, IsFullWhereNoElementSendsMore) {
  const exact::Shape shape = exact::trench(1, 4, 4, 4);
  const RayScene scene(shape.mesh, shape.sides, 1);
  const Elements elements(scene, longest_piece_edge);
  RayPlan plan(scene, elements);
  const auto grow = [&](double rays) { plan.grow(rays / plan.surface(), std::uint64_t{1} << 40); };
  grow(1e5);
  EXPECT_FALSE(plan.is_full());
  grow(1e12);
  EXPECT_TRUE(plan.is_full());
  const std::uint64_t total = plan.total();
  grow(1e13);
  EXPECT_EQ(plan.total(), total);
}

// Each element of a block takes the first points of its share, those that it took before as well.
TEST(RayPlan, BlocksShareOutOneSequence) {
  const exact::Shape shape = exact::trench(2);
  const RayScene scene(shape.mesh, shape.sides, 1);
  const Elements elements(scene, longest_piece_edge);
  RayPlan plan(scene, elements);
  for (const double rays_per_area : {20.0, 30.0, 70.0}) {
    plan.grow(rays_per_area, 1'000'000);
    std::size_t next = 0;
    for (const RayPlan::Window& window : plan.windows())
      for (const RayPlan::Block& block : window) {
        EXPECT_EQ(block.begin, next);
        EXPECT_LE(block.size(), share_count);
        next = block.end;
        for (std::size_t rank = block.begin; rank < block.end; ++rank) {
          EXPECT_EQ(&plan.block_of(rank), &block);
          const auto facet =
              elements.piece(elements.pieces_of(plan.element_at(rank)).front()).facet;
          EXPECT_EQ(main_direction(scene.normal(facet)), block.main_direction);
          for (std::uint32_t index = 0; index < plan.rays(rank); ++index) {
            const RayPlan::Place place = plan.place(rank, index);
            EXPECT_FALSE(place.is_skyward);
            EXPECT_EQ(place.share, rank - block.begin);
            EXPECT_EQ(place.index, index);
          }
        }
      }
    EXPECT_EQ(next, plan.size());
  }
}

// Both kinds of a block that aims at the sky are numbered without gaps, whatever the rounds.
TEST(RayPlan, AimsEveryFourthRayOfABlockAtTheSky) {
  const exact::Shape shape = exact::trench(2);
  const RayScene scene(shape.mesh, shape.sides, 1);
  const Elements elements(scene, longest_piece_edge);
  RayPlan plan(scene, elements);
  const RayPlan::Window aimed = plan.windows()[2];
  plan.aim_at_sky(aimed);
  for (const double rays_per_area : {20.0, 50.0}) {
    plan.grow(rays_per_area, 1'000'000);
    for (const RayPlan::Window& window : plan.windows())
      for (const RayPlan::Block& block : window) {
        EXPECT_EQ(block.aims_at_sky,
                  block.begin >= aimed.front().begin && block.end <= aimed.back().end);
        for (std::size_t rank = block.begin; rank < block.end; ++rank) {
          std::array<std::uint32_t, 2> numbers{};
          for (std::uint32_t index = 0; index < plan.rays(rank); ++index) {
            const RayPlan::Place place = plan.place(rank, index);
            EXPECT_EQ(place.share, rank - block.begin);
            EXPECT_EQ(place.index, numbers[place.is_skyward ? 1 : 0]++);
          }
          EXPECT_EQ(4 * numbers[1], block.aims_at_sky ? plan.rays(rank) : 0);
        }
      }
  }
}

TEST(RayPlan, SendsTwiceTheLeastSetsWhereFacetsAreJoined) {
  const exact::Shape shape = exact::flat_wafer(16, 16);
  const RayScene scene(shape.mesh, shape.sides, 1);
  Elements elements(scene, longest_piece_edge);
  EXPECT_EQ(RayPlan(scene, elements).least_total(), 4 * elements.count());
  elements.join(shape.mesh, 2);
  RayPlan plan(scene, elements);
  EXPECT_EQ(plan.least_total(), 8 * elements.count());
  plan.grow(0, 1);
  EXPECT_EQ(plan.total(), plan.least_total());
}

TEST(RayPlan, IsLimitedByOptionsAndMemory) {
  const auto limit = [](const FluxOptions& options) { return ray_limit(options, 400, 16); };
  EXPECT_EQ(limit({.max_rays = 5000, .memory_limit = 80'000}).rays, 5000U);
  EXPECT_EQ(limit({.rays = 4500, .max_rays = 100, .memory_limit = 80'000}).rays, 4500U);
  EXPECT_EQ(limit({.rays = 10, .memory_limit = 80'000}).rays, 4096U);
  EXPECT_EQ(limit({.rays = 10, .memory_limit = 80'000}).cap, RayCap::rays);
  EXPECT_EQ(limit({.memory_limit = 8000}).rays, 500U);
  EXPECT_EQ(limit({.memory_limit = 8000}).cap, RayCap::memory);
  EXPECT_THAT([] { ray_limit({.memory_limit = 6399}, 400, 16); },
              ::testing::ThrowsMessage<InputError>(::testing::HasSubstr("at least 6400 bytes")));
}

}  // namespace
}  // namespace scarp

#include "flux/facet_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <vector>

#include "core/random.h"
#include "core/tri_mesh.h"
#include "flux/nearest_facet.h"

namespace scarp {
namespace {

using Facet = FacetGrid::Facet;

constexpr double padding = 1e-3;
const Vec3d lower{-3, 2, -10};
const Vec3d upper{37, 32, 60};

Vec3d random_point(RandomStream& random) {
  const auto between = [&](double a, double b) { return a + (b - a) * random.uniform_double(); };
  return {between(lower.x + 1, upper.x - 1), between(lower.y + 1, upper.y - 1),
          between(lower.z + 1, upper.z - 1)};
}

Vec3d random_direction(RandomStream& random) {
  const auto number = [&] { return 2 * random.uniform_double() - 1; };
  return normalized(Vec3d{number(), number(), number()});
}

// Small and large ones, some of them slivers.
std::vector<Facet> random_facets(int count, RandomStream& random) {
  std::vector<Facet> facets;
  for (int f = 0; f < count; ++f) {
    const Vec3d a = random_point(random);
    const double size = f % 10 == 0 ? 1 : 0.05;
    const Vec3d b = a + size * (random_point(random) - a);
    const Vec3d c = a + (f % 7 == 0 ? 0.01 : 1) * size * (random_point(random) - a);
    const Vec3d n = normalized(cross(b - a, c - a));
    facets.push_back({{Vec3f(a), Vec3f(b), Vec3f(c)}, n});
  }
  return facets;
}

double end_of(Vec3d r, Vec3d u) {
  double t_end = 1e9;
  for (int axis = 0; axis < 3; ++axis) {
    const double side = u[axis] > 0 ? upper[axis] : lower[axis];
    if (u[axis] != 0) t_end = std::min(t_end, (side - r[axis]) / u[axis]);
  }
  return t_end;
}

/// The facets of all cells on a flight that it may meet.
struct Passed {
  std::set<std::uint32_t> facets;
  std::set<std::uint32_t> candidates;
  int steps = 0;
};

Passed facets_along(const FacetGrid& grid, Vec3d r, Vec3d u, double t_end) {
  NearestFacet nearest;
  nearest.start(grid, {.r = r, .u = u}, t_end);
  const auto walks = std::make_unique<FacetGrid::Walks>();
  std::array<std::uint32_t, FacetGrid::Walks::capacity> ended;
  walks->start(grid, 0, r, u, t_end);
  Passed passed;
  for (std::size_t ended_count = 0; ended_count == 0; ++passed.steps) {
    walks->look(grid, 1);
    const bool may_meet = walks->has_facets(0) && walks->may_meet(grid, 0);
    const FacetGrid::Block* block = may_meet ? walks->blocks(grid, 0) : nullptr;
    for (bool is_last = block == nullptr; !is_last; ++block) {
      is_last = block->is_last;
      const unsigned candidates = nearest.candidates(*block);
      for (std::size_t k = 0; k < FacetGrid::block_size; ++k) {
        if (block->facets[k] == Ray::no_facet) continue;
        passed.facets.insert(block->facets[k]);
        if ((candidates >> k) & 1U) passed.candidates.insert(block->facets[k]);
      }
    }
    ended_count = walks->go_on(1, ended);
  }
  return passed;
}

// Whatever the exact test takes, the walk has passed and the filter has let through; the filter
// keeps nearly all others away.
TEST(FacetGrid, WalksPassEveryFacetThatIsMet) {
  RandomStream random({.seed = 1});
  const std::vector<Facet> facets = random_facets(3000, random);
  const FacetGrid grid(facets, lower, upper, padding);
  int met = 0;
  std::size_t candidates = 0;
  for (int i = 0; i < 400; ++i) {
    const Vec3d r = random_point(random);
    Vec3d u = random_direction(random);
    if (i % 4 == 0) u = Vec3d{i % 3 == 0 ? 1.0 : 0, i % 3 == 1 ? -1.0 : 0, i % 3 == 2 ? 1.0 : 0};
    const double t_end = end_of(r, u);
    const Passed passed = facets_along(grid, r, u, t_end);
    for (std::uint32_t f = 0; f < facets.size(); ++f) {
      NearestFacet nearest;
      nearest.start(grid, {.r = r, .u = u}, t_end);
      nearest.test(facets[f].corners, facets[f].normal, f);
      if (nearest.front().facet != f && nearest.back().facet != f) continue;
      ++met;
      EXPECT_TRUE(passed.facets.contains(f)) << f << " on flight " << i;
      EXPECT_TRUE(passed.candidates.contains(f)) << f << " on flight " << i;
    }
    candidates += passed.candidates.size();
  }
  EXPECT_GT(met, 400);
  EXPECT_LT(candidates, 2U * static_cast<unsigned>(met));
}

// So many cells in a row that single precision hardly tells where in its cell a walk is: a strip
// with ridges, along which flights graze it.
TEST(FacetGrid, WalksPassEveryFacetThatIsMetFarAway) {
  constexpr int length = 12'000;
  std::vector<Facet> facets;
  for (int i = 0; i < length; ++i) {
    const auto at = [&](int x, int y) {
      return Vec3f{static_cast<float>(x), static_cast<float>(y), x % 500 == 0 ? 0.1F : 0};
    };
    const auto add = [&](Vec3f a, Vec3f b, Vec3f c) {
      facets.push_back({{a, b, c}, normalized(cross(Vec3d(b) - Vec3d(a), Vec3d(c) - Vec3d(a)))});
    };
    add(at(i, 0), at(i + 1, 0), at(i, 1));
    add(at(i + 1, 1), at(i, 1), at(i + 1, 0));
  }
  const FacetGrid grid(facets, {-1, -1, -1}, {length + 1.0, 2, 3}, 1e-7);
  RandomStream random({.seed = 4});
  int met = 0;
  for (int i = 0; i < 80; ++i) {
    const double x = length * random.uniform_double();
    const double to = length * random.uniform_double();
    const Vec3d r{x, 0.1 + 0.8 * random.uniform_double(), 2.5 * random.uniform_double()};
    const Vec3d away{to - x, i % 3 == 0 ? 0 : 0.1 - 0.2 * random.uniform_double(),
                     (i % 2 == 0 ? 0.05 : -0.5) - r.z};
    const Vec3d u = normalized(away);
    const Passed passed = facets_along(grid, r, u, scarp::length(away));
    EXPECT_LT(passed.steps, 4 * length);
    for (std::uint32_t f = 0; f < facets.size(); ++f) {
      NearestFacet nearest;
      nearest.start(grid, {.r = r, .u = u}, scarp::length(away));
      nearest.test(facets[f].corners, facets[f].normal, f);
      if (nearest.front().facet != f && nearest.back().facet != f) continue;
      ++met;
      EXPECT_TRUE(passed.candidates.contains(f)) << f << " on flight " << i;
    }
  }
  EXPECT_GT(met, 40);
}

// A flight through corners and along edges of cells does not lose its way: at its end is a facet.
TEST(FacetGrid, WalksAlongDiagonalsArrive) {
  constexpr double far = 63.99;
  for (const Vec3d u : {Vec3d{1, 1, 1}, Vec3d{1, 1, 0}, Vec3d{1, 0, 0}, Vec3d{1, 1e-9, 1}}) {
    const Vec3f end(far * u);
    const std::vector<Facet> facets{
        {{end, end - Vec3f{0, 1, 0}, end - Vec3f{0, 0, 1}}, {-1, 0, 0}}};
    const FacetGrid grid(facets, {-2, -2, -2}, {64, 64, 64}, padding);
    EXPECT_EQ(facets_along(grid, {0, 0, 0}, normalized(u), far * length(u)).facets.size(), 1U);
    EXPECT_EQ(facets_along(grid, far * u, -normalized(u), far * length(u)).facets.size(), 1U);
  }
}

// Where a flight stays above all that lies in a cell, nothing of it is tested.
TEST(FacetGrid, WalksLookAtNoFacetsThatTheyStayAbove) {
  const Vec3d n = normalized(Vec3d{0.3, -0.2, 1});
  const auto on_slope = [&](double x, double y) {
    return Vec3f(Vec3d{x, y, -(n.x * x + n.y * y) / n.z});
  };
  std::vector<Facet> facets;
  for (int x = 0; x < 30; ++x)
    for (int y = 0; y < 30; ++y)
      facets.push_back({{on_slope(x, y), on_slope(x + 1, y), on_slope(x, y + 1)}, n});
  const FacetGrid grid(facets, {-1, -1, -20}, {32, 32, 20}, padding);
  const Vec3d along = normalized(Vec3d(on_slope(20, 10)) - Vec3d(on_slope(2, 3)));
  const auto looked_at = [&](double height, Vec3d u) {
    const Vec3d start = Vec3d(on_slope(2, 3)) + height * n;
    return facets_along(grid, start, normalized(u), 20).facets.size();
  };
  EXPECT_EQ(looked_at(0.01, along), 0U);
  EXPECT_EQ(looked_at(0.01, along + 0.1 * n), 0U);
  EXPECT_GT(looked_at(0, along), 10U);
  EXPECT_GT(looked_at(0.01, along - 0.1 * n), 0U);
  EXPECT_LT(looked_at(1, along - 0.1 * n), looked_at(0, along) / 2);
}

// One step across a space without facets, whatever the number of cells.
TEST(FacetGrid, EmptySpaceIsCrossedInFewSteps) {
  RandomStream random({.seed = 2});
  std::vector<Facet> facets;
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 40; ++j) {
      const float x = static_cast<float>(i);
      const float y = static_cast<float>(j);
      facets.push_back({{Vec3f{x, y, 0}, Vec3f{x + 1, y, 0}, Vec3f{x, y + 1, 0}}, {0, 0, 1}});
      facets.push_back(
          {{Vec3f{x + 1, y + 1, 0}, Vec3f{x, y + 1, 0}, Vec3f{x + 1, y, 0}}, {0, 0, 1}});
    }
  }
  const FacetGrid grid(facets, {-1, -1, -1}, {41, 41, 41}, padding);
  const Passed down = facets_along(grid, {20.3, 20.4, 40}, {0, 0, -1}, 40);
  EXPECT_LE(down.steps, 6);
  EXPECT_TRUE(std::ranges::any_of(down.facets, [](std::uint32_t f) { return f / 2 == 820; }));
  const Passed up = facets_along(grid, {20.3, 20.4, 0}, {0, 0, 1}, 40);
  EXPECT_LE(up.steps, 4);
}

}  // namespace
}  // namespace scarp

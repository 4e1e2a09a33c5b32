#include "flux/engines/radiosity.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/flux/shape_problem.h"

namespace scarp {
namespace {

/// What elements of one size find in a trench twenty spacings wide and five times as deep.
struct Found {
  double constants = 0;  ///< the mean flux over the walls
  double planes = 0;
  double steepest = 0;  ///< slope over flux
  double greatest = 0;  ///< flux anywhere
};

struct Rays {
  float reemitted = 0.9F;
  float off_middle = 1;  ///< how many times as far from the middles as it is they seem to arrive
};

class Widths : public ::testing::Test, protected exact::ShapeProblem {
 protected:
  Widths() : ShapeProblem(exact::trench(5, 4, 16, 40), {.name = "gas", .sticking = {0.1F}}) {}

  Found find(double width, Rays rays = {}) const {
    Elements joined(scene, std::min(width, longest_piece_edge));
    joined.join(problem.mesh, width);
    const FacetValues values(problem.mesh, joined);
    RayPlan plan(scene, joined);
    plan.grow(2e6 / plan.surface(), 4'000'000);
    View view = look({&problem, 1}, plan, {});
    for (Vec3f& moment : view.moments) moment = rays.off_middle * moment;
    const std::vector<float> reemitted(plan.size(), rays.reemitted);
    const std::vector<double> emission(plan.size());
    const ExchangeSolver exchange(view.rows, reemitted);
    std::vector<double> first(plan.size());
    for (std::size_t i = 0; i < first.size(); ++i)
      first[i] = static_cast<double>(view.direct[0][2 * i] + view.direct[0][2 * i + 1]) /
                 static_cast<double>(view.matrix.row(i).size());
    Radiosity radiosity(plan, values, view, reemitted, emission, exchange, first);
    radiosity.solve(1e-7);
    radiosity.solve_constants();
    Found found;
    double area = 0;
    for (std::size_t rank = 0; rank < plan.size(); ++rank) {
      const std::uint32_t e = plan.element_at(rank);
      found.greatest = std::max(found.greatest, radiosity.flux()[rank]);
      if (std::abs(joined.normal(e).x) < 0.9) continue;
      area += joined.area(e);
      found.constants += joined.area(e) * radiosity.flux_of_constants()[rank];
      found.planes += joined.area(e) * radiosity.flux()[rank];
      found.steepest =
          std::max(found.steepest, length(radiosity.slopes()[rank]) / radiosity.flux()[rank]);
    }
    found.constants /= area;
    found.planes /= area;
    return found;
  }
};

// Against elements of a spacing.
TEST_F(Widths, OfPlanesHardlyMatterAsThoseOfConstantsDo) {
  const Found fine = find(1);
  const Found wide = find(8);
  EXPECT_GT(wide.steepest, 0.01);
  EXPECT_GT(std::abs(wide.constants - fine.planes), 0.003 * fine.planes);
  EXPECT_LT(std::abs(wide.planes - fine.planes), 0.3 * std::abs(wide.constants - fine.planes));
}

// Few rays may show an element the better half of another one alone. Two of that kind would send
// each other more and more.
TEST_F(Widths, OfPlanesThatDoNotSettleAreThoseOfConstants) {
  const Found found = find(8, {.off_middle = 200});
  EXPECT_LT(found.greatest, 1.1);
  EXPECT_NEAR(found.planes, found.constants, 0.1 * found.constants);
}

TEST_F(Widths, AsFineAsTheGridHaveConstants) {
  const Found found = find(0.5);
  EXPECT_EQ(found.steepest, 0);
  EXPECT_EQ(found.planes, found.constants);
}

// On a flat wafer nothing is seen twice: the flux is that of the source, here one that rises along
// x from nothing.
TEST(Radiosity, PlanesDoNotGoBelowZero) {
  exact::ShapeProblem wafer(exact::flat_wafer(32, 32), {.name = "gas"});
  Elements joined(wafer.scene, longest_piece_edge);
  joined.join(wafer.shape.mesh, 4);
  const FacetValues values(wafer.shape.mesh, joined);
  RayPlan plan(wafer.scene, joined);
  plan.grow(16, 1'000'000);
  const View view = look({&wafer.problem, 1}, plan, {});
  constexpr float part = 0.5F;
  constexpr double rise = 0.1;
  const std::vector<float> reemitted(plan.size(), part);
  const std::vector<double> emission(plan.size());
  std::vector<double> first(plan.size());
  for (std::size_t rank = 0; rank < plan.size(); ++rank)
    first[rank] = std::max(0.0, rise * (joined.middle(plan.element_at(rank)).x - 4));
  const ExchangeSolver exchange(view.rows, reemitted);
  Radiosity radiosity(plan, values, view, reemitted, emission, exchange, first);
  radiosity.solve(1e-6);
  int flatter = 0;
  for (std::size_t rank = 0; rank < plan.size(); ++rank) {
    const double root = std::sqrt(joined.area(plan.element_at(rank)));
    const double slope = length(radiosity.slopes()[rank]);
    EXPECT_EQ(radiosity.flux()[rank], first[rank]);
    EXPECT_LE(slope * root, 1.000001 * part * first[rank]);
    const double x = joined.middle(plan.element_at(rank)).x;
    // The ridge takes a little.
    if (x > 9 && x < 28) {
      EXPECT_NEAR(slope, part * rise, 0.1 * part * rise);
    }
    if (first[rank] > 0 && first[rank] < rise * root) {
      EXPECT_NEAR(slope * root, part * first[rank], 1e-6) << "as steep as may be";
      ++flatter;
    }
  }
  EXPECT_GT(flatter, 4);
}

}  // namespace
}  // namespace scarp

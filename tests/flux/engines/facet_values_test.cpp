#include "flux/engines/facet_values.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "flux/engines/facet_flux.h"
#include "tests/flux/shape_problem.h"

namespace scarp {
namespace {

class OnAWafer : public ::testing::Test {
 protected:
  OnAWafer() { elements_.join(shape_.mesh, 2); }

  double on_facet(const FacetValues& values, std::uint32_t f, Vec3d slope) const {
    const auto of_element = [&](std::uint32_t e) { return 3 + dot(slope, elements_.middle(e)); };
    double value = 0;
    for (const FacetValues::Part& part : values.parts_of(f)) {
      value += static_cast<double>(part.share) * of_element(part.element);
      values.for_each_beyond(part, [&](std::uint32_t element, double weight) {
        value += weight * of_element(element);
      });
    }
    return value;
  }
  Vec3d middle(std::uint32_t f) const {
    const auto& [a, b, c] = scene_.corners(f);
    return (Vec3d(a) + Vec3d(b) + Vec3d(c)) / 3.0;
  }

  exact::Shape shape_ = exact::flat_wafer(16, 16);
  RayScene scene_ = scene_of(shape_);
  Elements elements_{scene_, 3};
};

TEST_F(OnAWafer, AConstantStaysOne) {
  const FacetValues values(shape_.mesh, elements_);
  for (std::uint32_t f = 0; f < scene_.facet_count(); ++f)
    EXPECT_NEAR(on_facet(values, f, {}), 3, 1e-6);
}

// But for the part that the ridge takes: 0.03 of what one neighbour in its direction would tell.
TEST_F(OnAWafer, ASlopeIsKept) {
  const FacetValues values(shape_.mesh, elements_);
  const Vec3d slope{0.3, -0.2, 0};
  for (std::uint32_t f = 0; f < scene_.facet_count(); ++f) {
    const Vec3d from_middle = middle(f) - elements_.middle(elements_.element_of(f));
    EXPECT_NEAR(on_facet(values, f, slope), 3 + dot(slope, middle(f)),
                0.03 / 1.03 * length(slope) * length(from_middle) + 1e-6);
  }
}

TEST_F(OnAWafer, TheMeanOfAnElementIsKept) {
  const FacetValues values(shape_.mesh, elements_);
  const Vec3d slope{0.3, -0.2, 0};
  for (std::uint32_t e = 0; e < elements_.count(); ++e) {
    const double mean =
        elements_.mean(e, [&](std::uint32_t f) { return on_facet(values, f, slope); });
    EXPECT_NEAR(mean, 3 + dot(slope, elements_.middle(e)), 1e-6);
  }
}

// The plane of an element that gets little beside one that gets much would go below zero: it is as
// steep as it may be, and the mean stays.
TEST(FacetFlux, IsNowhereNegativeAndKeepsTheMeanOfElements) {
  exact::ShapeProblem wafer(exact::flat_wafer(32, 32), {.name = "gas"});
  Elements joined(wafer.scene, longest_piece_edge);
  joined.join(wafer.shape.mesh, 4);
  const FacetValues values(wafer.shape.mesh, joined);
  RayPlan plan(wafer.scene, joined);
  plan.grow(16, 1'000'000);
  const View view = look({&wafer.problem, 1}, plan, {});
  std::vector<double> flux(plan.size());
  for (std::size_t rank = 0; rank < plan.size(); ++rank) {
    const double x = joined.middle(plan.element_at(rank)).x;
    flux[rank] = x < 12 ? 0.02 : 0.2 * (x - 11);
  }
  const FacetFlux of_facets(wafer.problem, 0, plan, values, view, flux);
  double least = 1;
  for (std::size_t rank = 0; rank < plan.size(); ++rank) {
    const std::uint32_t e = plan.element_at(rank);
    const double mean = joined.mean(e, [&](std::uint32_t f) {
      least = std::min(least, of_facets.of(f));
      return of_facets.of(f);
    });
    EXPECT_NEAR(mean, flux[rank], 1e-6) << joined.middle(e).x;
  }
  EXPECT_GE(least, 0);
  EXPECT_LT(least, 0.005);
}

// Elements are then parts of one facet, or of few.
TEST(FacetValues, KeepASlopeWithinLongFacets) {
  const exact::Shape shape = exact::flat_wafer(64, 2);
  const RayScene scene = scene_of(shape);
  Elements elements(scene, 3);
  elements.join(shape.mesh, 4);
  const FacetValues values(shape.mesh, elements);
  const Vec3d slope{0.3, -0.2, 0};
  for (std::size_t e = 0; e < elements.count(); ++e) {
    const Vec3d found =
        values.slope(e, [&](std::size_t other) { return 3 + dot(slope, elements.middle(other)); });
    EXPECT_LT(length(found - slope), 0.03 * length(slope)) << e;
  }
}

// Over the seam of a period neighbours are as near as elsewhere.
TEST(FacetValues, GoOnOverPeriodicSides) {
  exact::Shape shape = exact::flat_wafer(16, 16);
  const RayScene scene = scene_of(shape, Boundary::periodic);
  Elements elements(scene, 3);
  elements.join(shape.mesh, 4);
  const FacetValues values(shape.mesh, elements);
  const auto wave = [&](std::size_t e) {
    return std::cos(2 * std::numbers::pi * elements.middle(e).x / 16);
  };
  const auto slope_of = [&](std::size_t e) { return values.slope(e, wave).x; };
  // By differences over two cells.
  for (std::size_t e = 0; e < elements.count(); ++e) {
    const double x = elements.middle(e).x;
    const auto at = [&](double there) { return std::cos(2 * std::numbers::pi * there / 16); };
    EXPECT_NEAR(slope_of(e), (at(x + 4) - at(x - 4)) / 8, 0.02) << x;
    for (const std::uint32_t p : elements.pieces_of(e))
      EXPECT_EQ(values.off_in_strips(elements.piece(p).facet), 0);
  }
}

// Between two ends neighbours lie all around; at an end they are on the side of the middle.
TEST(FacetValues, KnowOnWhichSideTheNeighboursAre) {
  const exact::Shape shape = exact::flat_wafer(32, 32);
  const RayScene scene = scene_of(shape);
  Elements elements(scene, 3);
  elements.join(shape.mesh, 4);
  const FacetValues values(shape.mesh, elements);
  const auto is_inside = [](double x) { return x > 5 && x < 27; };
  for (std::size_t e = 0; e < elements.count(); ++e) {
    const Vec3d middle = elements.middle(e);
    const Vec3d side = values.one_side(e);
    EXPECT_EQ(side.z, 0);
    for (int axis = 0; axis < 2; ++axis) {
      if (is_inside(middle[axis])) {
        EXPECT_NEAR(side[axis], 0, 0.2) << e;
      } else {
        EXPECT_GT(side[axis] * (16 - middle[axis]), 0) << e;
        EXPECT_GT(std::abs(side[axis]), 0.4) << e;
      }
    }
    EXPECT_LE(length(side), 1 + 1e-6);
  }
}

// On the wall of a hole all lie towards its axis, too; at the mouth what counts is that they are
// below.
TEST(FacetValues, SeeNoSideInThatTheSurfaceBends) {
  const exact::Shape shape = exact::hole(2, 14, 5, 24);
  const RayScene scene = scene_of(shape);
  Elements elements(scene, 3);
  elements.join(shape.mesh, 4);
  const FacetValues values(shape.mesh, elements);
  int at_mouth = 0;
  for (std::size_t e = 0; e < elements.count(); ++e) {
    const Vec3d n = elements.normal(e);
    if (std::abs(n.z) > 0.1) continue;
    EXPECT_LT(std::abs(dot(values.one_side(e), n)), 1e-6) << e;
    const double depth = scene.source_height() - elements.middle(e).z - 1;
    if (depth > 4 || elements.area(e) < 4) continue;
    ++at_mouth;
    EXPECT_LT(values.one_side(e).z, -0.8) << e;
  }
  EXPECT_EQ(at_mouth, 4);
}

// The floor between two walls has neighbours along the trench only.
TEST(FacetValues, KnowElementsWithoutNeighboursAcross) {
  exact::Builder builder;
  builder.grid({0, 0, 0}, {0, 0, -8}, 8, {0, 16, 0}, 16);
  builder.grid({0, 0, -8}, {4, 0, 0}, 4, {0, 16, 0}, 16);
  builder.grid({4, 0, -8}, {0, 0, 8}, 8, {0, 16, 0}, 16);
  const exact::Shape shape{builder.mesh, {.lower = {0, 0}, .upper = {4, 16}}};
  const RayScene scene = scene_of(shape);
  Elements elements(scene, 3);
  elements.join(shape.mesh, 4);
  const FacetValues values(shape.mesh, elements);
  for (std::size_t f = 0; f < shape.mesh.triangles.size(); ++f)
    EXPECT_FLOAT_EQ(static_cast<float>(values.off_in_strips(f)),
                    scene.normal(f).z > 0.5 ? 0.02F : 0)
        << f;
}

// Nothing is smoothed across an edge.
TEST(FacetValues, OfAnElementAtAnEdgeDoNotKnowTheOtherSide) {
  exact::Builder builder;
  builder.grid({0, 0, 0}, {4, 0, 0}, 4, {0, 4, 0}, 4);
  builder.grid({4, 0, 0}, {0, 0, -4}, 4, {0, 4, 0}, 4);
  const exact::Shape shape{builder.mesh, {.lower = {0, 0}, .upper = {4, 4}}};
  const RayScene scene = scene_of(shape);
  Elements elements(scene, 3);
  elements.join(shape.mesh, 2);
  const FacetValues values(shape.mesh, elements);
  for (std::uint32_t f = 0; f < scene.facet_count(); ++f) {
    for (const FacetValues::Part& part : values.parts_of(f)) {
      values.for_each_beyond(part, [&](std::uint32_t element, double) {
        const std::uint32_t other = elements.piece(elements.pieces_of(element).front()).facet;
        EXPECT_EQ(scene.normal(other).z, scene.normal(f).z);
      });
    }
  }
}

}  // namespace
}  // namespace scarp

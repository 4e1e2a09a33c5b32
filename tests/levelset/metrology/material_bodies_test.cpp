#include "levelset/metrology/material_bodies.h"

#include <gtest/gtest.h>

#include <numbers>

#include "core/error.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/operations/layer_steps.h"
#include "levelset/surface/connectivity.h"
#include "tests/levelset/surfaces.h"
#include "tests/levelset/wafers.h"

namespace scarp {
namespace {

constexpr double bottom = -60;

void expect_watertight(const TriMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t n = 0; n < 3; ++n) ++edges[{t[n], t[(n + 1) % 3]}];
  int faults = 0;
  for (const auto& [edge, count] : edges)
    faults += count != 1 || !edges.contains({edge.second, edge.first}) ? 1 : 0;
  EXPECT_EQ(faults, 0) << "of " << edges.size() << " directed edges";
}

/// Each body is closed and holds the volume of its material.
void expect_bodies_of(const Layers& layers, std::size_t count) {
  const std::vector<MaterialBody> bodies = material_bodies(layers, bottom);
  ASSERT_EQ(bodies.size(), count);
  const std::vector<double> volumes = material_volumes(layers);
  for (const MaterialBody& body : bodies) {
    SCOPED_TRACE(body.material);
    expect_watertight(body.surface);
    double wanted = body.material == 0 ? -bottom * layers.frame.sides().area() : 0;
    for (std::size_t k = 0; k < volumes.size(); ++k)
      if (layers.stack[k].material == body.material) wanted += volumes[k];
    EXPECT_NEAR(enclosed_volume(body.surface), wanted, 1e-4 * wanted);
  }
}

class Bodies : public ::testing::TestWithParam<Boundary> {
 protected:
  Frame frame() const {
    return {.spacing = 1, .cells = {40, 24}, .boundary = {GetParam(), GetParam()}};
  }
};
INSTANTIATE_TEST_SUITE_P(Sides, Bodies,
                         ::testing::Values(Boundary::reflective, Boundary::periodic));

TEST_P(Bodies, AFlatWaferIsABox) {
  const Layers layers = build_layers(frame(), std::vector<Shape>{WaferShape{}});
  const std::vector<MaterialBody> bodies = material_bodies(layers, -5);
  ASSERT_EQ(bodies.size(), 1U);
  expect_watertight(bodies[0].surface);
  // Start geometries are dilated by a thousandth of a spacing.
  EXPECT_NEAR(enclosed_volume(bodies[0].surface), 40 * 24 * (5 + dilation), 1e-2);
}

TEST_P(Bodies, FilmsInATrenchThatTheSidesCut) {
  const Layers layers = trench_with_films(frame());
  expect_bodies_of(layers, 3);
}

TEST_P(Bodies, AMaskOverUndercutSilicon) {
  const Layers layers = mask_over_undercut_silicon(frame());
  expect_bodies_of(layers, 2);
}

TEST_P(Bodies, AVoidUnderAFilmThatHasClosed) {
  const Layers layers = void_under_a_film(frame());
  ASSERT_EQ(open_gas(layers).voids.size(), 1U);
  expect_bodies_of(layers, 2);
}

TEST_P(Bodies, FilmsThatEndWhereTheyWereEtchedThrough) {
  const Layers layers = films_etched_through(frame());
  expect_bodies_of(layers, 3);
}

TEST(MaterialBodies, AHoleHasTheVolumeOfACylinder) {
  const Frame frame{.spacing = 1, .cells = {40, 40}};
  const Layers layers = build_layers(
      frame, std::vector<Shape>{WaferShape{}, HoleShape{.radius = 12.3, .cut = {.depth = 25.2}}});
  const double exact = 40 * 40 * 60 - std::numbers::pi * 12.3 * 12.3 * 25.2;
  const std::vector<MaterialBody> bodies = material_bodies(layers, bottom);
  EXPECT_NEAR(enclosed_volume(bodies[0].surface), exact, 0.001 * exact);
}

TEST(MaterialBodies, TheSliceOfACrossSectionIsClosed) {
  const Frame frame{.spacing = 1, .cells = {40, 1}, .two_dimensional = true};
  Layers layers = build_layers(
      frame, std::vector<Shape>{WaferShape{}, TrenchShape{.width = 14, .cut = {.depth = 20}}});
  add_layer(layers, 1);
  coat(layers, 2.5);
  expect_bodies_of(layers, 2);
}

TEST(MaterialBodies, ABottomAboveTheSurfaceIsRefused) {
  const Layers layers =
      build_layers({.spacing = 1, .cells = {10, 10}}, std::vector<Shape>{WaferShape{}});
  EXPECT_THROW(material_bodies(layers, 1), InputError);
  EXPECT_LT(default_bottom(layers), 0);
}

}  // namespace
}  // namespace scarp

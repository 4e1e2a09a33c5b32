#include "levelset/metrology/view_from_above.h"

#include <gtest/gtest.h>

#include "levelset/surface/extract_surface.h"
#include "tests/levelset/contours.h"

namespace scarp {
namespace {

TEST(ViewFromAbove, SeesTheUppermostOfOverhangingSurfaces) {
  const Frame frame{.spacing = 0.5, .cells = {40, 12}};
  // A jar: its shoulder lies over its belly.
  const ContourPoints jar = symmetric({{-4, 0}, {-4, -5}, {-12, -9}, {-12, -20}});
  const TriMesh surface = extract_surface(solid_below(frame, jar, {0.3, 0.2}));
  const ViewFromAbove view(surface);
  const auto height = [&](double x, double y) { return view.at({x, y})->height; };
  for (const double y : {-3.0, -1.37, 0.0, 3.0}) {
    EXPECT_NEAR(height(0.15, y), -9.9, 0.01);
    EXPECT_NEAR(height(-4, y), 0.1, 0.01);
    EXPECT_NEAR(height(10, y), 0.1, 0.01);
  }
  // Beyond the sides, as a rounded side may lie: that of the side.
  EXPECT_EQ(height(10.3, 0), height(10, 0));
}

TEST(ViewFromAbove, SeesEveryPlaceOfASlopeAndItsMaterial) {
  TriMesh mesh;
  mesh.vertices = {{0, 0, 0}, {4, 0, 4}, {4, 2, 4}, {0, 2, 0}, {9, 0, 4}, {9, 2, 4}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}};
  mesh.materials = {1, 1, 2, 3};
  const ViewFromAbove view(mesh);
  for (const double x : {0.0, 0.5, 2.0, 3.99}) {
    for (const double y : {0.0, 0.25, 1.0, 2.0}) {
      ASSERT_TRUE(view.at({x, y})) << x << " " << y;
      EXPECT_NEAR(view.at({x, y})->height, x, 1e-12);
      EXPECT_EQ(view.at({x, y})->material, 1);
    }
  }
  EXPECT_EQ(view.at({8, 0.1})->material, 2);
  EXPECT_EQ(view.at({5, 1.9})->material, 3);
  // Where facets meet at the same height, the first one counts.
  EXPECT_EQ(view.at({4, 1})->material, 1);
}

TEST(ViewFromAbove, SeesNothingOfWhatIsUprightOrFacesDown) {
  TriMesh mesh;
  mesh.vertices = {{0, 0, 0}, {4, 0, 0}, {4, 0, 4}, {0, 4, 1}, {4, 4, 1}};
  mesh.triangles = {{0, 1, 2}, {1, 0, 3}};
  EXPECT_FALSE(ViewFromAbove(mesh).at({1, 1}));
  EXPECT_FALSE(ViewFromAbove(TriMesh{}).at({0, 0}));
}

}  // namespace
}  // namespace scarp

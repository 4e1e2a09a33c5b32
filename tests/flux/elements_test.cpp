#include "flux/elements.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "flux/sampling.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

TEST(Elements, CoverTheirFacetsAndAreShort) {
  const RayScene scene = scene_of(exact::hole(5));
  const Elements elements(scene, 3);
  EXPECT_GT(elements.count(), scene.facet_count());
  for (std::size_t f = 0; f < scene.facet_count(); ++f) {
    double area = 0;
    for (std::uint32_t e = elements.first_of(f); e < elements.first_of(f + 1); ++e) {
      EXPECT_EQ(elements.facet_of(e), f);
      const auto& [a, b, c] = elements.corners(e);
      EXPECT_LE(std::max({length(b - a), length(c - b), length(a - c)}), 3);
      // Places are rounded to 1e-5 of a spacing, 100 spacings from the middle.
      EXPECT_NEAR(length(cross(b - a, c - a)) / 2, elements.area(e), 1e-5 * 3);
      EXPECT_GT(dot(cross(b - a, c - a), scene.normal(f)), 0);
      area += elements.area(e);
    }
    EXPECT_NEAR(area, scene.area(f), 1e-12 * area);
  }
}

TEST(Elements, AreFacetsWhereTheseAreShort) {
  const RayScene scene = scene_of(exact::flat_wafer(20, 10));
  const Elements elements(scene, 3);
  EXPECT_EQ(elements.count(), scene.facet_count());
  EXPECT_EQ(elements.at(17, {0, 0, 0}), 17U);
}

TEST(Elements, AreFoundFromAPlaceOnTheFacet) {
  const RayScene scene = scene_of(exact::flat_wafer(100, 2));
  const Elements elements(scene, 3);
  RandomStream random({.seed = 1});
  for (std::uint32_t f = 0; f < scene.facet_count(); ++f) {
    for (int i = 0; i < 500; ++i) {
      const Vec3d w = sample_triangle({random.uniform_double(), random.uniform_double()});
      const auto& [a, b, c] = scene.corners(f);
      const Vec3d r = w.x * Vec3d(a) + w.y * Vec3d(b) + w.z * Vec3d(c);
      const auto& [p, q, s] = elements.corners(elements.at(f, r));
      const Vec3d n = scene.normal(f);
      EXPECT_GE(dot(n, cross(q - p, r - p)), -1e-9);
      EXPECT_GE(dot(n, cross(s - q, r - q)), -1e-9);
      EXPECT_GE(dot(n, cross(p - s, r - s)), -1e-9);
    }
  }
}

}  // namespace
}  // namespace scarp

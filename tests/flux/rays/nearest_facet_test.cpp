#include "flux/rays/nearest_facet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace scarp {
namespace {

// Upwards, at a height, one of the halves of the unit square.
SceneFacet half_square(float height, bool upper_half) {
  const Vec3f a{upper_half ? 1.0F : 0.0F, upper_half ? 1.0F : 0.0F, height};
  const Vec3f b{upper_half ? 0.0F : 1.0F, upper_half ? 1.0F : 0.0F, height};
  const Vec3f c{upper_half ? 1.0F : 0.0F, upper_half ? 0.0F : 1.0F, height};
  return {{a, b, c}, {0, 0, 1}};
}

NearestFacet nearest_of(const std::vector<SceneFacet>& facets, const Ray& ray) {
  NearestFacet nearest(ray, 100, 1e-5);
  for (std::uint32_t f = 0; f < facets.size(); ++f) nearest.test(facets[f], f);
  return nearest;
}

TEST(NearestFacet, TellsFrontFromBack) {
  const std::vector<SceneFacet> facets{half_square(1, false), half_square(3, false)};
  const NearestFacet down = nearest_of(facets, {.r = {0.2, 0.3, 7}, .u = {0, 0, -1}});
  EXPECT_TRUE(down.is_at_front());
  EXPECT_EQ(down.front().facet, 1U);
  EXPECT_EQ(down.front().t, 4);
  const NearestFacet up = nearest_of(facets, {.r = {0.2, 0.3, -1}, .u = {0, 0, 1}});
  EXPECT_FALSE(up.is_at_front());
  EXPECT_EQ(up.back().facet, 0U);
  EXPECT_EQ(up.t_nearest(), 2);
}

TEST(NearestFacet, OfTheSameDistanceTheLowerIndexCounts) {
  const std::vector<SceneFacet> facets{half_square(1, true), half_square(1, false),
                                       half_square(1, true)};
  const NearestFacet on_edge = nearest_of(facets, {.r = {0.5, 0.5, 7}, .u = {0, 0, -1}});
  EXPECT_EQ(on_edge.front().facet, 0U);
  const NearestFacet inside = nearest_of(facets, {.r = {0.2, 0.2, 7}, .u = {0, 0, -1}});
  EXPECT_EQ(inside.front().facet, 1U);
}

TEST(NearestFacet, TheFacetOfTheStartIsNoCandidate) {
  const std::vector<SceneFacet> facets{half_square(3, false), half_square(1, false)};
  const NearestFacet nearest = nearest_of(facets, {.r = {0.2, 0.3, 7}, .u = {0, 0, -1}, .from = 0});
  EXPECT_EQ(nearest.front().facet, 1U);
}

TEST(NearestFacet, ASharpRidgeIsMetOnItsFront) {
  std::vector<SceneFacet> ridge{half_square(1, false),
                                {half_square(1.000001F, false).corners, {0, 0, -1}}};
  std::swap(ridge[1].corners[1], ridge[1].corners[2]);  // looks down
  const NearestFacet nearest = nearest_of(ridge, {.r = {0.2, 0.3, 7}, .u = {0, 0, -1}});
  EXPECT_EQ(nearest.back().facet, 1U);
  EXPECT_LT(nearest.back().t, nearest.front().t);
  EXPECT_TRUE(nearest.is_at_front());
}

TEST(NearestFacet, BehindTheStartNothingIsMet) {
  const NearestFacet nearest =
      nearest_of({half_square(1, false)}, {.r = {0.2, 0.3, 0}, .u = {0, 0, -1}});
  EXPECT_EQ(nearest.front().facet, Ray::no_facet);
  EXPECT_EQ(nearest.back().facet, Ray::no_facet);
  EXPECT_EQ(nearest.t_nearest(), 100);
}

// Upright, met at 10 by an oblique ray; its normal is wrong, as a sliver's may be, and tells of 6.
TEST(NearestFacet, ASliverIsMetWhereItIs) {
  const float x = std::sqrt(50.0F);
  const std::vector<SceneFacet> sliver{{{Vec3f{x, -1, -2}, {x, -1, -12}, {x, 1, -7}}, {0, 0, 1}}};
  const NearestFacet nearest =
      nearest_of(sliver, {.r = {0, 0, 0}, .u = normalized(Vec3d{1, 0, -1})});
  EXPECT_EQ(std::min(nearest.front().facet, nearest.back().facet), 0U);
  EXPECT_NEAR(nearest.t_nearest(), 10, 1e-5);
}

}  // namespace
}  // namespace scarp

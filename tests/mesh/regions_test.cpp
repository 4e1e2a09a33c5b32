#include "mesh/regions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

class Regions : public testing::Test {
 protected:
  Regions() : mesh_(noisy_plane(12, 0), {}), is_feature_(mesh_.r.size(), false) {
    // A line of features along y in the middle.
    for (std::size_t v = 0; v < mesh_.r.size(); ++v) is_feature_[v] = mesh_.r[v].x == 0;
  }

  /// The longest edge between vertices in columns a and b that is still wanted, over one more.
  bool wanted(const RegionOrder& order, int a, int b, double length) const {
    for (std::uint32_t h = 0; h < mesh_.topology.half_edge_count(); ++h) {
      if (mesh_.r[mesh_.topology.origin(h)].x == a && mesh_.r[mesh_.topology.target(h)].x == b) {
        return order.wanted(mesh_, h, length * length);
      }
    }
    ADD_FAILURE() << "no edge from column " << a << " to " << b;
    return false;
  }

  CollapseMesh mesh_;
  std::vector<bool> is_feature_;
};

TEST_F(Regions, SizesGrowRingByRing) {
  RegionOrder order(is_feature_, {}, {.l0 = 0.5, .step_length = 1, .l_max = 3});
  EXPECT_TRUE(wanted(order, 3, 4, 0.49));
  EXPECT_FALSE(wanted(order, 3, 4, 0.51));

  ASSERT_TRUE(order.coarsen());  // 1.5 outside
  EXPECT_FALSE(wanted(order, 0, 0, 0.51)) << "between features";
  EXPECT_FALSE(wanted(order, 0, 1, 0.51)) << "next to a feature: the finer one counts";
  EXPECT_TRUE(wanted(order, 1, 2, 1.49));
  EXPECT_FALSE(wanted(order, 1, 2, 1.51));

  ASSERT_TRUE(order.enclose_ring(mesh_));
  ASSERT_TRUE(order.coarsen());  // 2.5 outside
  EXPECT_FALSE(wanted(order, 1, 1, 1.51)) << "the first ring keeps its size";
  EXPECT_FALSE(wanted(order, 1, 2, 1.51));
  EXPECT_TRUE(wanted(order, 2, 3, 2.49));

  ASSERT_TRUE(order.enclose_ring(mesh_));
  ASSERT_TRUE(order.coarsen());  // 3, not 3.5
  EXPECT_TRUE(wanted(order, 3, 4, 2.99));
  EXPECT_FALSE(wanted(order, 3, 4, 3.01));
  EXPECT_FALSE(order.coarsen()) << "l_max is reached";
}

TEST_F(Regions, RingsEndAtTheRimAndWithoutFeaturesThereIsNone) {
  RegionOrder order(is_feature_, {}, {.l0 = 0.5, .step_length = 1, .l_max = 0});
  int rings = 0;
  while (order.coarsen() && order.enclose_ring(mesh_)) ++rings;
  EXPECT_EQ(rings, 6);
  RegionOrder flat(std::vector<bool>(mesh_.r.size(), false), {},
                   {.l0 = 0.5, .step_length = 1, .l_max = 0});
  EXPECT_FALSE(flat.enclose_ring(mesh_));
  flat.release_rest();
  EXPECT_TRUE(wanted(flat, 0, 1, 1e6));
}

TEST_F(Regions, AMergedVertexIsAFeatureIfEitherWas) {
  RegionOrder order(is_feature_, {}, {.l0 = 0.5, .step_length = 1, .l_max = 0});
  order.coarsen();
  std::uint32_t plain = 0;
  std::uint32_t feature = 0;
  for (std::uint32_t v = 0; v < mesh_.r.size(); ++v) {
    if (mesh_.r[v].x == 3 && mesh_.r[v].y == 0) plain = v;
    if (mesh_.r[v].x == 0 && mesh_.r[v].y == 0) feature = v;
  }
  const std::uint32_t h = mesh_.topology.outgoing(plain);
  EXPECT_TRUE(order.wanted(mesh_, h, 1));
  order.merged(plain, feature);
  EXPECT_FALSE(order.wanted(mesh_, h, 1));
}

TEST_F(Regions, TheSizeLimitOfAVertexHolds) {
  std::vector<float> limit(mesh_.r.size(), 100);
  for (std::size_t v = 0; v < limit.size(); ++v) limit[v] = mesh_.r[v].x > 2 ? 0.7F : 100;
  RegionOrder order(is_feature_, limit, {.l0 = 0.5, .step_length = 1, .l_max = 0});
  order.coarsen();
  EXPECT_TRUE(wanted(order, 3, 4, 0.69));
  EXPECT_FALSE(wanted(order, 3, 4, 0.71));
  EXPECT_TRUE(wanted(order, 1, 2, 1.49));
}

TEST_F(Regions, RaisingLiftsOnlySmallerSizes) {
  RegionOrder order(is_feature_, {}, {.l0 = 0.5, .step_length = 1, .l_max = 0});
  order.coarsen();
  order.raise(1);
  EXPECT_TRUE(wanted(order, 0, 0, 0.99));
  EXPECT_FALSE(wanted(order, 0, 0, 1.01));
  EXPECT_TRUE(wanted(order, 1, 2, 1.49));
}

TEST_F(Regions, TheMeanEdgeOfTheFeaturesIsTheirs) {
  EXPECT_DOUBLE_EQ(mean_feature_edge(mesh_, is_feature_), 1) << "edges along y";
  const double all = mean_feature_edge(mesh_, std::vector<bool>(mesh_.r.size(), false));
  EXPECT_GT(all, 1.1) << "a third are diagonals";
  EXPECT_LT(all, 1.2);
}

TEST(FindFeatures, TakesThoseAboveTheThresholdAndNotTooMany) {
  const std::vector<double> kappa{0.1, -0.5, 0.2, 0.05, -0.3};
  EXPECT_EQ(find_features(kappa, 0.15, 5), (std::vector<bool>{false, true, true, false, true}));
  EXPECT_EQ(find_features(kappa, 0.15, 2), (std::vector<bool>{false, true, false, false, true}));
  EXPECT_EQ(find_features(kappa, 0.15, 0), std::vector<bool>(5, false));
}

}  // namespace
}  // namespace scarp

#include "mesh/simplify/regions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

class RegionsOfALine : public testing::Test {
 protected:
  RegionsOfALine() : mesh_(noisy_plane(12, 0), {}), is_feature_(mesh_.r.size(), false) {
    // A line of features along y in the middle.
    for (std::size_t v = 0; v < mesh_.r.size(); ++v) is_feature_[v] = mesh_.r[v].x == 0;
  }

  /// Whether an edge of that length is collapsed between vertices in columns a and b.
  bool wanted(const Regions& regions, int a, int b, double length) const {
    const std::vector<float> sizes = regions.sizes();
    return length < std::min(sizes[in_column(a)], sizes[in_column(b)]);
  }

  std::uint32_t in_column(int x) const {
    for (std::uint32_t v = 0; v < mesh_.r.size(); ++v) {
      if (mesh_.r[v].x == x) return v;
    }
    ADD_FAILURE() << "no vertex in column " << x;
    return 0;
  }

  CollapseMesh mesh_;
  std::vector<bool> is_feature_;
};

TEST_F(RegionsOfALine, SizesGrowRingByRing) {
  Regions regions(is_feature_, {}, {.l0 = 0.5, .step_length = 1, .l_max = 3});
  EXPECT_TRUE(wanted(regions, 3, 4, 0.49));
  EXPECT_FALSE(wanted(regions, 3, 4, 0.51));

  ASSERT_TRUE(regions.coarsen());  // 1.5 outside
  EXPECT_FALSE(wanted(regions, 0, 0, 0.51)) << "between features";
  EXPECT_FALSE(wanted(regions, 0, 1, 0.51)) << "next to a feature: the finer one counts";
  EXPECT_TRUE(wanted(regions, 1, 2, 1.49));
  EXPECT_FALSE(wanted(regions, 1, 2, 1.51));

  ASSERT_TRUE(regions.enclose_ring(mesh_));
  ASSERT_TRUE(regions.coarsen());  // 2.5 outside
  EXPECT_FALSE(wanted(regions, 1, 1, 1.51)) << "the first ring keeps its size";
  EXPECT_FALSE(wanted(regions, 1, 2, 1.51));
  EXPECT_TRUE(wanted(regions, 2, 3, 2.49));

  ASSERT_TRUE(regions.enclose_ring(mesh_));
  ASSERT_TRUE(regions.coarsen());  // 3, not 3.5
  EXPECT_TRUE(wanted(regions, 3, 4, 2.99));
  EXPECT_FALSE(wanted(regions, 3, 4, 3.01));
  EXPECT_FALSE(regions.coarsen()) << "l_max is reached";
}

TEST_F(RegionsOfALine, RingsEndAtTheRimAndWithoutFeaturesThereIsNone) {
  Regions regions(is_feature_, {}, {.l0 = 0.5, .step_length = 1, .l_max = 0});
  int rings = 0;
  while (regions.coarsen() && regions.enclose_ring(mesh_)) ++rings;
  EXPECT_EQ(rings, 6);
  Regions flat(std::vector<bool>(mesh_.r.size(), false), {},
               {.l0 = 0.5, .step_length = 1, .l_max = 0});
  EXPECT_FALSE(flat.enclose_ring(mesh_));
  flat.release_rest();
  EXPECT_TRUE(wanted(flat, 0, 1, 1e6));
}

TEST_F(RegionsOfALine, AMergedVertexIsAFeatureIfOneOfThemWas) {
  Regions regions(is_feature_, {}, {.l0 = 0.5, .step_length = 1, .l_max = 0});
  regions.coarsen();
  std::vector<std::uint32_t> merged_into(mesh_.r.size());
  std::iota(merged_into.begin(), merged_into.end(), 0U);
  const std::uint32_t last = in_column(3);
  EXPECT_EQ(regions.sizes()[last], 1.5F);
  // By way of one that comes before it.
  std::uint32_t feature = 0;
  for (std::uint32_t v = 0; v < mesh_.r.size(); ++v) feature = mesh_.r[v].x == 0 ? v : feature;
  ASSERT_LT(in_column(2), feature);
  merged_into[feature] = in_column(2);
  merged_into[in_column(2)] = last;
  regions.merge(merged_into);
  EXPECT_EQ(regions.sizes()[last], 0.5F);
  EXPECT_EQ(regions.sizes()[in_column(4)], 1.5F);
}

TEST_F(RegionsOfALine, TheSizeLimitOfAVertexHolds) {
  std::vector<float> limit(mesh_.r.size(), 100);
  for (std::size_t v = 0; v < limit.size(); ++v) limit[v] = mesh_.r[v].x > 2 ? 0.7F : 100;
  Regions regions(is_feature_, limit, {.l0 = 0.5, .step_length = 1, .l_max = 0});
  regions.coarsen();
  EXPECT_TRUE(wanted(regions, 3, 4, 0.69));
  EXPECT_FALSE(wanted(regions, 3, 4, 0.71));
  EXPECT_TRUE(wanted(regions, 1, 2, 1.49));
}

TEST_F(RegionsOfALine, RaisingLiftsOnlySmallerSizes) {
  Regions regions(is_feature_, {}, {.l0 = 0.5, .step_length = 1, .l_max = 0});
  regions.coarsen();
  regions.raise(1);
  EXPECT_TRUE(wanted(regions, 0, 0, 0.99));
  EXPECT_FALSE(wanted(regions, 0, 0, 1.01));
  EXPECT_TRUE(wanted(regions, 1, 2, 1.49));
}

TEST_F(RegionsOfALine, TheMeanEdgeOfTheFeaturesIsTheirs) {
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

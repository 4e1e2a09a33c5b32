#include "mesh/simplify/blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

class BlocksOfAPass : public testing::TestWithParam<int> {
 protected:
  CollapseMesh mesh_{noisy_plane(150, 0.05), {}};
  Blocks blocks_{mesh_, GetParam()};
  VerticesByBlock vertices_{mesh_, blocks_};
};

TEST_P(BlocksOfAPass, HoldEveryVertexOnce) {
  std::set<std::uint32_t> seen;
  int full = 0;
  for (std::uint32_t block = 0; block < blocks_.count(); ++block) {
    full += vertices_.of(block).empty() ? 0 : 1;
    for (const std::uint32_t v : vertices_.of(block)) {
      EXPECT_TRUE(seen.insert(v).second);
      EXPECT_TRUE(blocks_.holds(block, v));
      EXPECT_EQ(blocks_.of(v), block);
    }
  }
  EXPECT_EQ(seen.size(), mesh_.live_vertices);
  EXPECT_GE(full, 4);
}

TEST_P(BlocksOfAPass, AreVisitedOnceWithTheirVerticesTheLargestFirst) {
  const ThreadLimit one(1);
  std::vector<std::size_t> sizes;
  std::set<std::uint32_t> seen;
  vertices_.for_each_block([&](std::uint32_t block, std::span<const std::uint32_t> vertices) {
    EXPECT_TRUE(seen.insert(block).second);
    EXPECT_EQ(vertices.data(), vertices_.of(block).data());
    sizes.push_back(vertices.size());
  });
  EXPECT_TRUE(std::is_sorted(sizes.rbegin(), sizes.rend()));
  EXPECT_GT(sizes.back(), 0U);
  EXPECT_EQ(std::accumulate(sizes.begin(), sizes.end(), std::size_t{0}), mesh_.live_vertices);
}

TEST_P(BlocksOfAPass, LocalStarsOfDifferentBlocksShareNoFacetAndMostAreLocal) {
  std::vector<std::uint32_t> owner(mesh_.normals.size(), HalfEdges::none);
  int local = 0;
  for (std::uint32_t block = 0; block < blocks_.count(); ++block) {
    for (const std::uint32_t v : vertices_.of(block)) {
      Star star;
      ASSERT_TRUE(star.gather_vertex(mesh_.topology, v));
      if (!blocks_.holds(block, star)) continue;
      ++local;
      for (int i = 0; i < star.count; ++i) {
        EXPECT_TRUE(owner[star.facet[i]] == HalfEdges::none || owner[star.facet[i]] == block);
        owner[star.facet[i]] = block;
      }
    }
  }
  EXPECT_GT(local, 0.9 * mesh_.live_vertices);
  EXPECT_LT(local, mesh_.live_vertices) << "a seam";
}
INSTANTIATE_TEST_SUITE_P(Passes, BlocksOfAPass, testing::Range(0, 5));

TEST(Blocks, OppositePeriodicSidesLieInTheSameBlocks) {
  const Grid grid{.cells = {150, 150, 4}, .noise = 0.05, .periodic = true};
  const CollapseMesh mesh(polygonised(grid, [](Vec3d r) { return r.z - 1.77; }), grid.sides());
  for (int pass = 0; pass < 5; ++pass) {
    const Blocks blocks(mesh, pass);
    const VerticesByBlock vertices(mesh, blocks);
    int pairs = 0;
    int together = 0;
    int full = 0;
    for (std::uint32_t block = 0; block < blocks.count(); ++block) {
      full += vertices.of(block).empty() ? 0 : 1;
      for (const std::uint32_t v : vertices.of(block)) {
        Star here;
        Star there;
        if (mesh.twin[v] == HalfEdges::none) continue;
        ASSERT_TRUE(here.gather_vertex(mesh.topology, v));
        ASSERT_TRUE(there.gather_vertex(mesh.topology, mesh.twin[v]));
        ++pairs;
        together += blocks.holds(block, here) && blocks.holds(block, there) ? 1 : 0;
      }
    }
    EXPECT_EQ(pairs, 4 * 149);
    EXPECT_GT(together, 0.9 * pairs) << "pass " << pass;
    EXPECT_GE(full, 4);
  }
}

TEST(Blocks, CutElsewhereInTheNextPass) {
  const CollapseMesh mesh(noisy_plane(150, 0.05), {});
  std::vector<bool> is_local(mesh.r.size(), false);
  for (int pass = 0; pass < 3; ++pass) {
    const Blocks blocks(mesh, pass);
    const VerticesByBlock vertices(mesh, blocks);
    for (std::uint32_t block = 0; block < blocks.count(); ++block) {
      for (const std::uint32_t v : vertices.of(block)) {
        Star star;
        ASSERT_TRUE(star.gather_vertex(mesh.topology, v));
        if (blocks.holds(block, star)) is_local[v] = true;
      }
    }
  }
  // One cut crosses another at a few places.
  EXPECT_LT(std::count(is_local.begin(), is_local.end(), false), 0.002 * mesh.r.size());
}

TEST(Blocks, OfTheWholeMeshAreOneThatHoldsEveryStar) {
  const CollapseMesh mesh(noisy_plane(150, 0.05), {});
  const Blocks blocks = Blocks::whole(mesh);
  const VerticesByBlock vertices(mesh, blocks);
  ASSERT_EQ(blocks.count(), 1U);
  EXPECT_EQ(vertices.of(0).size(), mesh.live_vertices);
  Star star;
  ASSERT_TRUE(star.gather_vertex(mesh.topology, vertices.of(0).back()));
  EXPECT_TRUE(blocks.holds(0, star));
}

TEST(Blocks, OfASmallMeshAreOne) {
  const CollapseMesh mesh(octahedral_sphere(5, 4), {});
  EXPECT_LE(Blocks(mesh, 0).count(), 2U);
}

}  // namespace
}  // namespace scarp

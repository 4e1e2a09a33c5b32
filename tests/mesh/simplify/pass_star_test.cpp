#include "mesh/simplify/pass_star.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "mesh/simplify/collapse.h"
#include "mesh/simplify/facet_shape.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

const TriMesh& landscape() {
  static const Grid grid{.cells = {24, 24, 24}, .noise = 0.05, .seed = 7};
  static const TriMesh mesh = polygonised(grid, random_landscape(grid.cells, grid.seed));
  return mesh;
}

/// Calls visit(h, place) for inner edges between inner vertices, with places near their middles.
template <class Visit>
void for_each_free_edge(const CollapseMesh& mesh, const Visit& visit) {
  RandomStream random({.seed = 4});
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); ++h) {
    const std::uint32_t u = mesh.topology.origin(h);
    const std::uint32_t v = mesh.topology.target(h);
    if (!mesh.topology.is_edge(h) || mesh.topology.on_boundary(u) || mesh.topology.on_boundary(v)) {
      continue;
    }
    const double size = random.uniform();
    const Vec3d shift{size * (random.uniform() - 0.5), size * (random.uniform() - 0.5),
                      size * (random.uniform() - 0.5)};
    visit(h, mesh.rounded(0.5 * (mesh.r[u] + mesh.r[v]) + shift));
  }
}

TEST(PassStar, DecidesAboutFacetsAndFoldsAsTheChecksOfTheOtherMethods) {
  const CollapseMesh mesh(landscape(), {});
  const FloatMesh floats(mesh);
  CollapseChecks checks(mesh, {}, 1);
  PassStar star;
  int allowed = 0;
  int refused = 0;
  for_each_free_edge(mesh, [&](std::uint32_t h, Vec3d r) {
    const bool is_gathered = star.gather(mesh.topology, h);
    const bool expected = checks.gather(mesh, h, r) && checks.keeps_surface(mesh, h);
    if (is_gathered) star.place_at(floats, floats.place(r));
    const bool found = is_gathered && star.keeps_facets(mesh) && star.makes_no_fold(mesh, floats);
    EXPECT_EQ(found, expected) << h;
    ++(found ? allowed : refused);
  });
  EXPECT_GT(allowed, 300);
  EXPECT_GT(refused, 300);
}

TEST(PassStar, ExceedsWhatTheBoundRefusesAndHardlyAnythingElse) {
  const CollapseMesh mesh(landscape(), {});
  const FloatMesh floats(mesh);
  constexpr double limit = 0.1;
  CollapseChecks checks(mesh, {limit}, 1);
  PassStar star;
  int refused = 0;
  int missed = 0;
  int wrong = 0;
  for_each_free_edge(mesh, [&](std::uint32_t h, Vec3d r) {
    if (!star.gather(mesh.topology, h) || !checks.gather(mesh, h, r)) return;
    star.place_at(floats, floats.place(r));
    if (!star.keeps_facets(mesh)) return;
    const bool exceeds = star.exceeds(floats, floats.length(limit));
    const bool keeps = checks.keeps_bound(mesh);
    // The bound may know a lower number from how far the vertices go.
    wrong += exceeds && keeps ? 1 : 0;
    refused += exceeds ? 1 : 0;
    missed += !exceeds && !keeps ? 1 : 0;
  });
  EXPECT_GT(refused, 100);
  EXPECT_LT(missed, 0.3 * refused);
  EXPECT_LT(wrong, 0.01 * refused);
}

TEST(PassStar, KnowsEdgesThatGetTooLong) {
  const CollapseMesh mesh(noisy_plane(8, 0), {});
  const FloatMesh floats(mesh);
  PassStar star;
  for_each_free_edge(mesh, [&](std::uint32_t h, Vec3d) {
    ASSERT_TRUE(star.gather(mesh.topology, h));
    const Vec3d u = mesh.r[mesh.topology.origin(h)];
    star.place_at(floats, floats.place(u));
    double longest = 0;
    for (int i = 0; i < star.star().count; ++i) {
      if (star.star().at_target[i]) {
        longest = std::max(longest, length(mesh.r[star.star().ring[i]] - u));
      }
    }
    const float shorter = floats.length(0.99 * longest);
    const float longer = floats.length(1.01 * longest);
    EXPECT_FALSE(star.keeps_length(shorter));
    EXPECT_TRUE(star.keeps_length(longer));
    EXPECT_FALSE(star.keeps_lengths(std::vector<float>(PassStar::capacity, shorter)));
    EXPECT_TRUE(star.keeps_lengths(std::vector<float>(PassStar::capacity, longer)));
    // Those that were as long before may stay so.
    EXPECT_TRUE(star.keeps_length(longer));
  });
}

TEST(PassStar, KnowsHowFarTheEndsWillBeAndHowShapesGrow) {
  const CollapseMesh mesh(landscape(), {});
  const FloatMesh floats(mesh);
  CollapseChecks checks(mesh, {}, 1);
  PassStar star;
  int count = 0;
  int nearer = 0;
  for_each_free_edge(mesh, [&](std::uint32_t h, Vec3d r) {
    if (!star.gather(mesh.topology, h) || !checks.gather(mesh, h, r)) return;
    star.place_at(floats, floats.place(r));
    if (!star.keeps_facets(mesh)) return;
    ++count;
    double twice_area = 0;
    for (const Vec3d n : checks.normals().first(star.star().count)) twice_area += length(n);
    const double mean = floats.scale * floats.scale * twice_area / (star.star().count + 2);
    const double shapes = shape_growth(mesh, star.star(), r, checks.normals());
    EXPECT_NEAR(star.shape_growth(floats), mean * shapes, 1e-4) << h;

    double squares = 0;
    for (const std::uint32_t v : {star.star().u, star.star().v}) {
      squares += checks.fan(mesh).nearest(mesh.r[v]).squared_distance;
    }
    // A height along the mean normal is no less than the distance.
    const double found = star.squared_heights_of_ends(floats) / (floats.scale * floats.scale);
    nearer += found < 0.99 * squares - 1e-6 ? 1 : 0;
    EXPECT_LT(found, 4 * squares + 1e-4) << h;
  });
  EXPECT_GT(count, 300);
  EXPECT_LT(nearer, 0.05 * count) << "where it is no height field";
}

TEST(PassStar, DecidesAlikeInAnyUnit) {
  // Volumes to the sixth power of a length of nanometres in metres are none that floats have.
  TriMesh small = landscape();
  constexpr float unit = 0x1p-30F;
  for (Vec3f& r : small.vertices) r = unit * r;
  const CollapseMesh mesh(landscape(), {});
  const CollapseMesh small_mesh(small, {});
  const FloatMesh floats(mesh);
  const FloatMesh small_floats(small_mesh);
  EXPECT_EQ(small_floats.length(unit), floats.length(1));
  for (std::size_t f = 0; f < mesh.normals.size(); ++f) {
    ASSERT_EQ(small_floats.normals[f].x, floats.normals[f].x);
  }
}

TEST(PassStar, GathersNoEdgeWhoseEndsShareMoreThanItsApexes) {
  // Two tetrahedra on one facet: its edges may not be collapsed, their ends share three vertices.
  const TriMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3F, 0.3F, 1}, {0.3F, 0.3F, -1}},
                     {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {1, 0, 4}, {2, 1, 4}, {0, 2, 4}},
                     {}};
  const CollapseMesh work(mesh, {});
  PassStar star;
  for (std::uint32_t h = 0; h < work.topology.half_edge_count(); ++h) {
    EXPECT_EQ(star.gather(work.topology, h), work.topology.can_collapse(h)) << h;
  }
}

}  // namespace
}  // namespace scarp

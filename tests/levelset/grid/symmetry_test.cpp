#include "levelset/grid/symmetry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "levelset/grid/band.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"
#include "mesh/diagonal_cut.h"
#include "mesh/distance.h"
#include "mesh/surface_fault.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

constexpr MirrorPlanes both{.across = {true, true}};

// Halves of 10 and of 13 cells: leaves begin elsewhere than in the whole.
const Frame frame{.spacing = 2, .cells = {20, 26}};

double ring(Vec3d r) {
  const double moat = std::abs(std::hypot(r.x, 0.7 * r.y) - 9.3) - 3.1;
  return std::max(r.z, -std::max(moat, -20 - r.z));
}

Layers two_layers(const Frame& of, double shift = 0) {
  const std::vector<Shape> shapes{WaferShape{.material = 0},
                                  LayerShape{.material = 3, .thickness = 5}};
  Layers layers = build_layers(of, shapes);
  const LevelSet hollow(
      of,
      [=](Vec3d r) {
        return ring(r - Vec3d{shift, 0, 0});
      },
      -40, 20);
  for (Layer& layer : layers.stack) cut(layer.phi, hollow);
  return layers;
}

TEST(MirrorImages, AHalfAndItsImagesAreTheWholeToTheLastBit) {
  const Layers whole = two_layers(frame);
  for (const MirrorPlanes& planes :
       {MirrorPlanes{{true, false}}, MirrorPlanes{{false, true}}, both}) {
    const Layers part = part_of(whole, planes);
    EXPECT_EQ(part.frame.cells[0], planes.across[0] ? 10 : 20);
    EXPECT_EQ(part.frame.sides().lower[1], planes.across[1] ? 0 : -26);
    EXPECT_EQ(hash(WholeLayers(part).get()), hash(whole));
    EXPECT_EQ(whole_of(part.frame), frame);
  }
  EXPECT_EQ(&WholeLayers(whole).get(), &whole);
}

TEST(MirrorImages, OfAHalfIsWhatWouldBeBuiltThere) {
  const Layers part = part_of(two_layers(frame), both);
  EXPECT_EQ(hash(part), hash(two_layers(part_of(frame, both))));
  EXPECT_EQ(part.top().distance({3, -5, -4}), part.top().distance({3, 5, -4}));
}

TEST(MirrorImages, IsFoundToTheLastBit) {
  const Layers layers = two_layers(frame);
  EXPECT_TRUE(is_mirror_symmetric(layers, 0));
  EXPECT_TRUE(is_mirror_symmetric(layers, 1));
  const Layers shifted = two_layers(frame, 1e-5);
  EXPECT_FALSE(is_mirror_symmetric(shifted, 0));
  EXPECT_TRUE(is_mirror_symmetric(shifted, 1));
}

const Frame square{.spacing = 2, .cells = {24, 24}};
constexpr MirrorPlanes all{.across = {true, true}, .diagonal = true};

Layers round_layers(double shift = 0) {
  return single_layer(
      square,
      [=](Vec3d r) {
        const double wall = 9.3 - std::hypot(r.x, r.y) + shift * r.x;
        return std::max(r.z, -std::max(-wall, -20 - r.z));
      },
      -40, 20);
}

TEST(MirrorImages, AcrossTheDiagonalIsFoundToTheLastBit) {
  EXPECT_TRUE(is_diagonally_symmetric(round_layers()));
  EXPECT_FALSE(is_diagonally_symmetric(round_layers(1e-6)));
}

TEST(MirrorImages, OfAnEighthKeepTheNodesOfTheQuarter) {
  const Layers whole = round_layers();
  const Layers part = part_of(whole, all);
  EXPECT_EQ(part.frame.images(), 4);
  EXPECT_EQ(part.frame.facet_images(), 8);
  EXPECT_TRUE(part.frame.sides().diagonal);
  EXPECT_EQ(hash(WholeLayers(part).get()), hash(whole));
  EXPECT_EQ(whole_of(part.frame), square);
}

TEST(MirrorImages, NodesBeyondTheDiagonalTakeWhatTheirImagesHave) {
  const Layers part = part_of(round_layers(), all);
  const Band& band = part.top().band();
  std::vector<float> values(band.leaves().size() * leaf_size);
  const auto number = [](int i, int j, int k) {
    return static_cast<float>(i + 100 * j + 10000 * k);
  };
  const auto for_each_node = [&](const auto& use) {
    for (std::size_t n = 0; n < band.leaves().size(); ++n) {
      const auto [x, y, z] = band.leaves()[n].origin;
      for (int i = x; i < x + leaf_edge; ++i)
        for (int j = y; j < y + leaf_edge; ++j)
          for (int k = z; k < z + leaf_edge; ++k)
            use(values[n * leaf_size + static_cast<std::size_t>(leaf_offset(i, j, k))], i, j, k);
    }
  };
  for_each_node([&](float& value, int i, int j, int k) { value = j > i ? -1 : number(i, j, k); });
  mirror_across_diagonal(band, values);
  for_each_node([&](float value, int i, int j, int k) {
    EXPECT_EQ(value, number(std::max(i, j), std::min(i, j), k));
  });
}

// The largest distance from a vertex to the next one of the other mesh.
double apart(const TriMesh& mesh, const TriMesh& other) {
  double largest = 0;
  for (const Vec3f& r : mesh.vertices) {
    double nearest = 1e300;
    for (const Vec3f& s : other.vertices) nearest = std::min(nearest, length(Vec3d(r) - Vec3d(s)));
    largest = std::max(largest, nearest);
  }
  return largest;
}

Vec3d area_vector_of(const TriMesh& mesh) {
  Vec3d sum;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) sum += area_vector(mesh, f);
  return sum;
}

// The whole surface is seen from above as the domain, and nothing is seen from the side.
TEST(MirrorImages, TheSurfaceOfAHalfAndItsImagesIsThatOfTheWhole) {
  const Layers whole = two_layers(frame);
  const TriMesh surface = extract_surface(whole);
  const Layers part = part_of(whole, both);
  const TriMesh with_all = with_images(extract_surface(part), part.frame);
  EXPECT_EQ(with_all.vertices.size(), surface.vertices.size());
  EXPECT_LT(apart(with_all, surface), 1e-5);
  EXPECT_EQ(with_all.triangles.size(), surface.triangles.size());
  EXPECT_EQ(with_all.materials.size(), with_all.triangles.size());
  const Vec3d area = area_vector_of(with_all);
  EXPECT_NEAR(area.x, 0, 1e-3);
  EXPECT_NEAR(area.y, 0, 1e-3);
  EXPECT_NEAR(area.z, 40 * 52, 1e-3);
  const std::vector<float> values{1, 2, 3};
  EXPECT_EQ(with_images(values, part.frame),
            (std::vector<float>{1, 2, 3, 1, 2, 3, 1, 2, 3, 1, 2, 3}));
}

TEST(MirrorImages, TheSurfaceOfAnEighthAndItsImagesIsThatOfTheWhole) {
  const TriMesh surface = extract_surface(round_layers());
  const Layers part = part_of(round_layers(), all);
  const TriMesh eighth = below_diagonal(extract_surface(part), part.frame.sides(), 2);
  EXPECT_EQ(surface_fault(eighth, part.frame.sides()), std::nullopt);
  const TriMesh with_all = with_images(eighth, part.frame);
  EXPECT_EQ(with_all.triangles.size(), 8 * eighth.triangles.size());
  EXPECT_EQ(with_all.materials.size(), with_all.triangles.size());
  EXPECT_EQ(surface_fault(with_all, square.sides()), std::nullopt);
  // Two facets of a cell may meet in the other diagonal of what they fill.
  const SurfaceDistance distance = surface_distance(with_all, surface, 2);
  EXPECT_LT(std::max(distance.forward.mean, distance.reverse.mean), 2e-3);
  const Vec3d area = area_vector_of(with_all);
  EXPECT_NEAR(area.x, 0, 1e-3);
  EXPECT_NEAR(area.y, 0, 1e-3);
  EXPECT_NEAR(area.z, 48 * 48, 1e-3);
  EXPECT_EQ(with_images(std::vector<float>{1, 2}, part.frame).size(), 16U);
}

// One bubble on both planes, two on one of them, four beside them.
TEST(MirrorImages, VoidsOfAHalfAreCountedAndMeasuredAsThoseOfTheWhole) {
  const Frame domain{.spacing = 1, .cells = {80, 80}};
  const auto bubbles = [](Vec3d r) {
    const Vec3d q{std::abs(r.x), std::abs(r.y), r.z + 15};
    const double nearest = std::min(
        {length(q) - 5.2, length(q - Vec3d{20, 0, 0}) - 6.3, length(q - Vec3d{22, 24, 0}) - 7.4});
    return std::max(r.z - 0.2, -nearest);
  };
  const Layers whole = single_layer(domain, bubbles, -30, 4);
  const Layers part = part_of(whole, both);
  const auto measured = [](const Layers& layers) {
    std::vector<double> volumes;
    for (const Region& region : open_gas(layers).voids)
      volumes.insert(volumes.end(), static_cast<std::size_t>(region.images), region.volume);
    std::ranges::sort(volumes);
    return volumes;
  };
  const std::vector<double> of_whole = measured(whole);
  const std::vector<double> of_part = measured(part);
  ASSERT_EQ(of_whole.size(), 7U);
  ASSERT_EQ(of_part.size(), 7U);
  for (std::size_t n = 0; n < 7; ++n) EXPECT_NEAR(of_part[n], of_whole[n], 1e-3 * of_whole[n]);
}

}  // namespace
}  // namespace scarp

#include "apps/report/cut_face.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "levelset/start/shapes.h"

namespace scarp {
namespace {

// Oxide on silicon, with a trench through both whose corners lie between nodes.
struct CutTrench {
  static constexpr double half_width = 52;
  static constexpr double floor = -43;
  static constexpr double top = 80;

  Layers layers = build_layers(
      {.spacing = 10, .cells = {30, 20}},
      std::vector<Shape>{WaferShape{.material = 0}, LayerShape{.material = 2, .thickness = top},
                         TrenchShape{.width = 2 * half_width, .cut = {.depth = top - floor}}});

  std::optional<MaterialId> material(double x, double z) const {
    if (z > top || (std::abs(x) < half_width && z > floor)) return std::nullopt;
    return z > 0 ? MaterialId{2} : MaterialId{0};
  }

  // By symmetry of the right half: floor, wall, interface and top.
  static double to_border(double x, double z) {
    const double beyond = std::max(std::abs(x) - half_width, 0.0);
    const double before = std::max(half_width - std::abs(x), 0.0);
    const double outside = std::max({floor - z, z - top, 0.0});
    return std::min({std::hypot(beyond, z - floor), std::hypot(std::abs(x) - half_width, outside),
                     std::hypot(before, z), std::hypot(before, z - top)});
  }
};

// At edges the mesh is sharp within a small part of a spacing, and phi between nodes is not.
TEST(CutFace, ShowsMaterialsWithSharpCorners) {
  const CutTrench trench;
  const CutFace face(trench.layers, layer_surfaces(trench.layers), 1, 3, 0.1);
  std::size_t places = 0;
  for (double x = -149.5; x < 150; x += 1.7) {
    for (double z = -99.5; z < 100; z += 1.3) {
      if (trench.to_border(x, z) < 0.4) continue;
      const FacePlace place = face.at(x, z);
      EXPECT_EQ(place.material, trench.material(x, z)) << x << ' ' << z;
      EXPECT_LE(place.clearance, trench.to_border(x, z) + 0.4) << x << ' ' << z;
      ++places;
    }
  }
  EXPECT_GT(places, 20'000U);
}

TEST(CutFace, ALayerThatAddsNothingIsNotSeen) {
  CutTrench trench;
  add_layer(trench.layers, 5);
  const CutFace face(trench.layers, layer_surfaces(trench.layers), 0, 0, 0.1);
  for (double z = -99.5; z < 100; z += 0.1) EXPECT_NE(face.at(1, z).material, MaterialId{5}) << z;
}

TEST(CutFace, ReachesTheSidesAndKnowsItsBorders) {
  const CutTrench trench;
  const CutFace face(trench.layers, layer_surfaces(trench.layers), 1, -100, 0.5);
  EXPECT_EQ(face.at(-150, 40).material, MaterialId{2});
  EXPECT_EQ(face.at(150, -40).material, MaterialId{0});
  EXPECT_LT(face.at(100, 0.3).clearance, 0);
  EXPECT_NEAR(face.at(100, 4).clearance, 3.5, 0.1);
  EXPECT_FALSE(face.at(0, 40).material.has_value());
}

}  // namespace
}  // namespace scarp

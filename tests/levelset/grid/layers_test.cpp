#include "levelset/grid/layers.h"

#include <gtest/gtest.h>

#include "levelset/metrology/cross_section.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

const Frame frame{.spacing = 1, .cells = {16, 12}};

Layers two_films() {
  return build_layers(frame, std::vector<Shape>{WaferShape{.material = 0},
                                                LayerShape{.material = 1, .thickness = 2.4},
                                                LayerShape{.material = 2, .thickness = 3.3}});
}

TEST(Layers, DepositionAddsALayerOnlyForANewMaterial) {
  Layers layers = two_films();
  add_layer(layers, 2);
  EXPECT_EQ(layers.stack.size(), 3U);
  add_layer(layers, 1);
  ASSERT_EQ(layers.stack.size(), 4U);
  EXPECT_EQ(layers.stack[3].phi.hash(), layers.stack[2].phi.hash());
  move(layers, 2, 0.5, [](Vec3d, MaterialId) { return 1.0; });
  const std::vector<double> volumes = material_volumes(layers);
  const double area = 16 * 12;
  EXPECT_NEAR(volumes[1] / area, 2.4, 1e-3);
  EXPECT_NEAR(volumes[2] / area, 3.3, 1e-3);
  EXPECT_NEAR(volumes[3] / area, 2, 2e-3);
}

TEST(Layers, EtchingCutsLowerLayersAndEmptyOnesGo) {
  Layers layers = two_films();
  move(layers, 4.5, 0.5, [](Vec3d, MaterialId) { return -1.0; });
  remove_empty_layers(layers);
  ASSERT_EQ(layers.stack.size(), 2U);
  EXPECT_EQ(layers.stack[1].material, 1);
  EXPECT_NEAR(material_volumes(layers)[1] / (16 * 12), 5.7 - 4.5, 2e-3);
  EXPECT_NEAR(layers.stack[0].phi.distance({0, 0, 0}), -1e-3, 1e-3);

  move(layers, 3, 0.5, [](Vec3d, MaterialId) { return -1.0; });
  remove_empty_layers(layers);
  ASSERT_EQ(layers.stack.size(), 1U);
  EXPECT_EQ(layers.stack[0].material, 0);
  EXPECT_NEAR(layers.top().distance({0, 0, -1.8}), 0, 2e-3);
}

TEST(Layers, HashDependsOnMaterialsAndOrder) {
  Layers layers = two_films();
  const std::uint64_t before = hash(layers);
  EXPECT_EQ(hash(layers.copy()), before);
  layers.stack[1].material = 5;
  EXPECT_NE(hash(layers), before);
}

// A film that is left on a patch of the wafer alone, over 49 nodes of 1681.
TEST(RemoveResidues, TakesWhatIsThinAndCoversLittleAndTellsItsVolume) {
  constexpr double h = 2;
  const Frame wafer{.spacing = h, .cells = {40, 40}};
  const auto removed = [&](double thickness, double half_width, bool is_etched = true) {
    Layers layers{.frame = wafer, .stack = {}};
    layers.stack.push_back({0, LevelSet(
                                   wafer, [](Vec3d r) { return r.z - 0.3 * h; }, -4 * h, 4 * h)});
    layers.stack.push_back({1, LevelSet(
                                   wafer,
                                   [=](Vec3d r) {
                                     const bool is_covered =
                                         std::max(std::abs(r.x), std::abs(r.y)) < half_width * h;
                                     return r.z - 0.3 * h - (is_covered ? thickness * h : 0);
                                   },
                                   -4 * h, 4 * h)});
    const double volume = remove_residues(layers, {false, is_etched});
    EXPECT_EQ(layers.stack.size(), volume > 0 ? 1U : 2U);
    return volume / (h * h * h);
  };
  EXPECT_NEAR(removed(0.03, 3.5), 49 * 0.03, 1e-3);
  EXPECT_NEAR(removed(0.049, 3.5), 49 * 0.049, 1e-3);
  EXPECT_EQ(removed(0.051, 3.5), 0);
  EXPECT_EQ(removed(0.03, 5.5), 0) << "it covers 121 nodes";
  EXPECT_EQ(removed(0.03, 3.5, false), 0);
}

}  // namespace
}  // namespace scarp

#include "apps/report/packed_volume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "levelset/start/shapes.h"

namespace scarp {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr Frame frame{.spacing = 10, .cells = {30, 20}};
const Box block{.lower = {-150, -100, -200}, .upper = {150, 100, 80}};

/// Distances to the border of a layer, in nm; x first.
std::vector<double> distances_of(const PackedVolume& packed, std::size_t layer) {
  const auto count = static_cast<std::size_t>(packed.nodes[0] * packed.nodes[1] * packed.nodes[2]);
  uLongf size = count * (packed.materials.size() - 1);
  std::vector<unsigned char> codes(size);
  EXPECT_EQ(uncompress(codes.data(), &size, reinterpret_cast<const Bytef*>(packed.bytes.data()),
                       packed.bytes.size()),
            Z_OK);
  EXPECT_EQ(size, codes.size());
  std::vector<double> found;
  for (std::size_t n = 0; n < count; ++n)
    found.push_back((codes[layer * count + n] - 128) * 10 / 63.0);
  return found;
}

TEST(PackedVolume, KnowsTheDistanceToEachBorder) {
  const Layers layers =
      build_layers(frame, std::vector<Shape>{WaferShape{.material = 0},
                                             LayerShape{.material = 2, .thickness = 35},
                                             LayerShape{.material = 6, .thickness = 40}});
  const PackedVolume packed = pack_volume(layers, block);
  EXPECT_THAT(packed.materials, ElementsAre(0, 2, 6));
  EXPECT_THAT(packed.nodes, ElementsAre(31, 21, 29));
  for (const auto& [layer, height] : {std::pair{0, 0.0}, std::pair{1, 35.0}}) {
    const std::vector<double> distances = distances_of(packed, static_cast<std::size_t>(layer));
    for (std::size_t k = 0; k < 29; ++k) {
      const double distance = -200 + 10 * static_cast<double>(k) - height;
      const double found = distances[(k * 21 + 7) * 31 + 13];
      // Start geometries are off the nodes by .001 spacings.
      if (std::abs(distance) < 20) {
        EXPECT_NEAR(found, distance, 0.5 * 10 / 63 + 0.03) << k;
      } else if (std::abs(distance) > 20.1) {
        EXPECT_EQ(std::signbit(found), std::signbit(distance)) << k;
      }
    }
  }
}

TEST(PackedVolume, HasNoMoreNodesThanTheViewerNeeds) {
  const Frame fine{.spacing = 1, .cells = {300, 200}};
  const Layers layers = build_layers(
      fine,
      std::vector<Shape>{WaferShape{.material = 0}, LayerShape{.material = 2, .thickness = 20}});
  const PackedVolume packed = pack_volume(layers, block);
  EXPECT_LE(packed.nodes[0] * packed.nodes[1] * packed.nodes[2], 70 * 64 * 64);
  EXPECT_LT(packed.bytes.size(), 20'000U);
}

TEST(PackedVolume, OneMaterialNeedsNoNumbers) {
  const PackedVolume packed =
      pack_volume(build_layers(frame, std::vector<Shape>{WaferShape{.material = 0}}), block);
  EXPECT_THAT(packed.materials, ElementsAre(0));
  EXPECT_LT(packed.bytes.size(), 20U);
}

TEST(PackedVolume, ManyLayersAreNotToldApart) {
  std::vector<Shape> shapes{WaferShape{.material = 0}};
  for (MaterialId material = 1; material < 6; ++material)
    shapes.push_back(LayerShape{.material = material, .thickness = 10});
  EXPECT_THAT(pack_volume(build_layers(frame, shapes), block).materials, IsEmpty());
}

}  // namespace
}  // namespace scarp

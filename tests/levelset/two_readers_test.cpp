#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "levelset/grid/band.h"
#include "levelset/metrology/metrology.h"
#include "levelset/motion/extend.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"
#include "tests/levelset/speeds.h"

namespace scarp {
namespace {

// Who has a constant band gets nothing to write to.
static_assert(
    std::is_same_v<decltype(std::declval<const Band&>().leaves()[0].phi + 0), const float*>);
static_assert(std::is_same_v<decltype(std::declval<Band&>().leaves()[0].phi + 0), float*>);

/// A waved mask that stands still on silicon that is etched.
Layers masked_waves() {
  const Frame frame{.spacing = 2, .cells = {40, 24}};
  const auto wave = [](Vec3d r) { return r.z - 6 * std::sin(0.1 * r.x) * std::cos(0.15 * r.y); };
  Layers layers{.frame = frame, .stack = {}};
  layers.stack.push_back({0, LevelSet(frame, wave, -20, 20)});
  const auto mask = [&](Vec3d r) { return std::min(wave(r), std::max(wave(r) - 5, r.x)); };
  layers.stack.push_back({1, LevelSet(frame, mask, -20, 30)});
  return layers;
}

/// All that a step of some speed reads off the layers.
std::vector<float> read(const Layers& layers, float speed) {
  const OpenGas gas = open_gas(layers);
  const TriMesh surface = extract_surface(layers, gas);
  const std::size_t count = surface.triangles.size();
  const std::vector<CornerSpeeds> speeds{CornerSpeeds(count, {-speed, -speed, -speed}),
                                         CornerSpeeds(count)};
  std::vector<float> values = extend_speeds(layers, gas, surface, speeds, 0.5).speed;
  for (const Vec3f& r : surface.vertices) {
    values.push_back(static_cast<float>(layers.top().distance(Vec3d(r))));
    values.push_back(static_cast<float>(layers.top().normal(Vec3d(r)).z));
  }
  const Metrology metrology = measure(layers);
  values.push_back(static_cast<float>(metrology.openings.size()));
  values.push_back(static_cast<float>(hash(layers) % 4093));
  return values;
}

TEST(TwoReaders, OfOneLevelSetFindWhatOneFindsAlone) {
  const Layers layers = masked_waves();
  const std::vector<std::vector<float>> alone{read(layers, 1), read(layers, 3)};
  ASSERT_NE(alone[0], alone[1]);

  std::vector<int> differ(2);
  {
    std::vector<std::jthread> readers;
    for (const std::size_t n : {0U, 1U})
      readers.emplace_back([&, n] {
        for (int turn = 0; turn < 20; ++turn)
          differ[n] += read(layers, n == 0 ? 1 : 3) != alone[n] ? 1 : 0;
      });
  }

  EXPECT_EQ(differ, std::vector<int>(2));
}

}  // namespace
}  // namespace scarp

// Layers that stop or slow an etch, down to a fiftieth of a spacing thick.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "levelset/metrology/cross_section.h"
#include "tests/levelset/speeds.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

constexpr MaterialId silicon = 0;
constexpr MaterialId oxide = 1;
constexpr MaterialId film = 2;
constexpr MaterialId poly = 3;
constexpr MaterialId mask = 4;

constexpr double dt = 0.4;

/// Oxide on silicon up to a height, a film and a layer of poly ten spacings thick above it, a mask
/// with an opening of 16 spacings.
Layers stack(const Frame& frame, double height, double thickness) {
  MaskShape shape{.material = mask, .thickness = 5};
  if (frame.two_dimensional) {
    shape.outline = SlotOutline{.width = 16};
  } else {
    shape.outline = CircleOutline{.radius = 8};
  }
  return build_layers(frame,
                      std::vector<Shape>{WaferShape{.material = silicon},
                                         LayerShape{.material = oxide, .thickness = height},
                                         LayerShape{.material = film, .thickness = thickness},
                                         LayerShape{.material = poly, .thickness = 10}, shape});
}

Frame frame_of(bool two_dimensional) {
  Frame frame{.spacing = 1, .cells = {two_dimensional ? 64 : 40, two_dimensional ? 1 : 40}};
  frame.two_dimensional = two_dimensional;
  return frame;
}

void etch(Layers& layers, double time, const std::vector<double>& rates, Scheme scheme) {
  const auto steps = static_cast<int>(std::ceil(time / dt));
  const auto speed = [&](Vec3d, MaterialId material) { return -rates[material]; };
  for (int step = 0; step < steps; ++step) {
    advect(layers, prescribe_speeds(layers, speed, time / steps), time / steps, scheme);
  }
}

class ThinLayer : public testing::TestWithParam<Scheme> {};

INSTANTIATE_TEST_SUITE_P(Schemes, ThinLayer,
                         testing::Values(Scheme::first_order, Scheme::eno2, Scheme::weno5));

// An undercut creeps along the film while the middle is over-etched by its whole depth: behind the
// film nodes moved on with the layer above it, and what lies below was reached.
TEST_P(ThinLayer, AFilmOfRateZeroKeepsItsVolume) {
  for (const bool two_dimensional : {true, false}) {
    for (const double thickness : {0.02, 0.1, 0.2, 0.45, 1.3}) {
      for (const double offset : {0.0, 0.3, 0.55, 0.8}) {
        if (!two_dimensional && offset != 0.3) continue;
        const Frame frame = frame_of(two_dimensional);
        Layers layers = stack(frame, 6 + offset, thickness);
        const double volume = material_volumes(layers)[film];
        etch(layers, 20, {1, 1, 0, 1, 0}, GetParam());
        EXPECT_NEAR(material_volumes(layers)[film], volume, 0.01 * volume)
            << thickness << " " << offset << " " << two_dimensional;
      }
    }
  }
}

/// How thick the film is in the middle of the opening.
double thickness_in_the_middle(const Layers& layers) {
  const auto height = [&](const LevelSet& phi) {
    double lower = 0;
    double upper = 30;
    while (upper - lower > 1e-5) {
      const double middle = 0.5 * (lower + upper);
      (phi.distance({0, 0, middle}) < 0 ? lower : upper) = middle;
    }
    return lower;
  };
  return height(layers.stack[film].phi) - height(layers.stack[oxide].phi);
}

TEST_P(ThinLayer, ASlowFilmGoesInThicknessOverRate) {
  for (const double rate : {0.01, 0.001}) {
    for (const double thickness : {0.1, 0.3}) {
      for (const double offset : {0.0, 0.3, 0.7}) {
        const Frame frame = frame_of(true);
        Layers layers = stack(frame, 6 + offset, thickness);
        constexpr double part = 0.6;
        etch(layers, 10 + part * thickness / rate, {0, 1, rate, 1, 0}, GetParam());
        const double gone = (thickness - thickness_in_the_middle(layers)) / (part * thickness);
        EXPECT_NEAR(gone, 1, 0.05) << rate << " " << thickness << " " << offset;
      }
    }
  }
}

}  // namespace
}  // namespace scarp

// Closed voids: they form in time, and stand as they are to the last bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "levelset/grid/band.h"
#include "levelset/motion/advect.h"
#include "levelset/motion/extend.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"
#include "surfaces.h"
#include "tests/levelset/speeds.h"

namespace scarp {
namespace {

/// A cavity under a neck between thin lips. Lengths in nm.
struct NeckedCavity {
  double neck;
  double cavity;
  double height;
};

Layers cavity_layers(const NeckedCavity& shape, double h) {
  Frame frame{.spacing = h, .cells = {static_cast<int>(std::lround(5 / h)), 1}};
  frame.two_dimensional = true;
  return single_layer(
      frame,
      [=](Vec3d r) {
        const auto box = [&](double half, double lower, double upper) {
          const double dx = std::abs(r.x) - half;
          const double dz = std::max(lower - r.z, r.z - upper);
          return dx > 0 && dz > 0 ? std::hypot(dx, dz) : std::max(dx, dz);
        };
        // The lips of the neck are thin: growth into the cavity starts at its upper edges.
        const double shaft = box(shape.neck / 2, -1, 9);
        const double room = box(shape.cavity / 2, -shape.height - 4 * h, -4 * h);
        return std::max(r.z, -std::min(shaft, room)) - 1e-3 * h;
      },
      -shape.height - 1, 1);
}

/// The largest void; none if there is no void.
std::optional<Region> largest_void(const OpenGas& gas) {
  const auto by_volume = [](const Region& a, const Region& b) { return a.volume < b.volume; };
  const auto found = std::max_element(gas.voids.begin(), gas.voids.end(), by_volume);
  return found == gas.voids.end() ? std::nullopt : std::optional(*found);
}

/// One time step of growth at 1 nm/s of all that open gas reaches.
void grow_open_surface(Layers& layers, const OpenGas& gas, double dt) {
  const TriMesh mesh = extract_surface(layers, gas);
  const CornerSpeeds speeds(mesh.triangles.size(), {1, 1, 1});
  advect(layers, extend_speeds(layers, gas, mesh, speeds), dt);
}

class VoidUnderANeck : public testing::TestWithParam<NeckedCavity> {};

INSTANTIATE_TEST_SUITE_P(Shapes, VoidUnderANeck,
                         testing::Values(NeckedCavity{1, 3, 4}, NeckedCavity{0.5, 2, 2},
                                         NeckedCavity{1, 2, 3}),
                         [](const auto& test) { return "Case" + std::to_string(test.index); });

TEST_P(VoidUnderANeck, ClosesInTimeWithTheExactAreaAndStaysToTheLastBit) {
  const auto& [neck, cavity, height] = GetParam();
  constexpr double h = 1.0 / 60;
  constexpr double dt = 0.25 * h;
  Layers layers = cavity_layers(GetParam(), h);
  OpenGas gas = open_gas(layers);
  double time = 0;
  for (; gas.voids.empty() && time < neck; time += dt) {
    grow_open_surface(layers, gas, dt);
    gas = open_gas(layers);
  }
  // The fronts come from both sides: half a spacing more or less at 1 nm/s, and the time step.
  EXPECT_NEAR(time, neck / 2, h / 2 + dt);
  const double exact =
      (cavity - neck) * (height - neck) + neck * neck * (0.5 - std::numbers::pi / 8);
  const std::optional<Region> closed = largest_void(gas);
  ASSERT_TRUE(closed.has_value());
  EXPECT_NEAR(closed->volume / h, exact, 0.03 * exact);
  EXPECT_NEAR(closed->lower, -height - 4 * h + neck / 2, h);

  const Layers before = layers.copy();
  for (int step = 0; step < 20; ++step) {
    grow_open_surface(layers, gas, dt);
    gas = open_gas(layers, gas.voids);
  }
  EXPECT_EQ(largest_void(gas)->volume, closed->volume);
  EXPECT_EQ(largest_void(open_gas(layers))->volume, closed->volume);
  const auto bottom = static_cast<int>(std::lround(-(height + 1) / h));
  // Below the notch under the neck, where the covering film ends.
  const auto top = static_cast<int>(std::floor(-neck / h)) - 8;
  for (int i = 0; i <= layers.frame.cells[0]; ++i) {
    for (int k = bottom; k < top; ++k) {
      const float was = before.top().node(i, 0, k);
      const bool next_to_surface = (was < 0) != (before.top().node(i + 1, 0, k) < 0) ||
                                   (was < 0) != (before.top().node(i, 0, k + 1) < 0);
      if (next_to_surface) {
        ASSERT_EQ(layers.top().node(i, 0, k), was) << i << " " << k;
      }
    }
  }
}

/// A cavity under a neck, in a wafer 60 nm wide.
Layers necked_cavity(double neck) {
  Frame frame{.spacing = 1, .cells = {60, 1}};
  frame.two_dimensional = true;
  return single_layer(
      frame,
      [neck](Vec3d r) {
        const auto box = [&](double half, double lower, double upper) {
          const double dx = std::abs(r.x) - half;
          const double dz = std::max(lower - r.z, r.z - upper);
          return dx > 0 && dz > 0 ? std::hypot(dx, dz) : std::max(dx, dz);
        };
        return std::max(r.z - 0.01, -std::min(box(neck / 2, -12, 20), box(15.2, -40.3, -10.3)));
      },
      -50, 10);
}

TEST(Void, FreezesBitForBitAndIsCounted) {
  Layers layers = necked_cavity(6.3);
  EXPECT_TRUE(open_gas(layers).voids.empty());
  const auto grow = [&] {
    const TriMesh mesh = extract_surface(layers, open_gas(layers));
    const std::vector<std::array<float, 3>> speeds(mesh.triangles.size(), {1, 1, 1});
    const OpenGas gas = open_gas(layers);
    advect(layers, extend_speeds(layers, gas, mesh, speeds), 0.5);
  };
  for (int step = 0; step < 8; ++step) {
    grow();
  }
  const OpenGas closed = open_gas(layers);
  ASSERT_EQ(closed.voids.size(), 1U);
  const auto in_void = [](const TriMesh& mesh) {
    return std::count_if(mesh.vertices.begin(), mesh.vertices.end(),
                         [](const Vec3f& v) { return v.z < -16; });
  };
  EXPECT_GT(in_void(extract_surface(layers)), 0);
  const auto before = phi_next_to_surface(layers.top(), -50, -16);
  for (int step = 0; step < 8; ++step) {
    grow();
  }
  EXPECT_EQ(phi_next_to_surface(layers.top(), -50, -16), before);
  EXPECT_EQ(open_gas(layers).voids.size(), 1U);
  const TriMesh traced = extract_surface(layers, open_gas(layers));
  EXPECT_EQ(in_void(traced), 0);
  EXPECT_EQ(faults(traced, layers.frame).boundary_off_sides, 0);
}

/// phi of the gas nodes of closed voids and of the solid nodes next to them.
std::vector<float> phi_of_voids(const Layers& layers, const OpenGas& gas) {
  std::vector<float> found;
  const Band& band = layers.top().band();
  for (std::size_t n = 0; n < band.leaves().size(); ++n) {
    for (int offset = 0; offset < leaf_size; ++offset) {
      const Leaf& leaf = band.leaves()[n];
      const auto [i, j, k] = node_at(leaf, offset);
      const bool is_in_domain = i < band.node_count(0) && j < band.node_count(1);
      if (!is_in_domain || leaf.phi[offset] < 0 || gas.is_open(n, offset)) continue;
      found.push_back(leaf.phi[offset]);
      for (const float next : {band.node(i - 1, j, k), band.node(i + 1, j, k),
                               band.node(i, j, k - 1), band.node(i, j, k + 1)})
        if (next < 0) found.push_back(next);
    }
  }
  return found;
}

/// Of the vertices of a mesh, sorted.
std::vector<std::array<float, 3>> places(const TriMesh& mesh) {
  std::vector<std::array<float, 3>> places;
  for (const Vec3f& r : mesh.vertices) places.push_back({r.x, r.y, r.z});
  std::sort(places.begin(), places.end());
  return places;
}

// The tip of a void lies under a ceiling that is thin at first: facets that looked at nodes beyond
// the next ones moved by up to .7 spacings as the open surface left.
class StandingVoid : public testing::TestWithParam<double> {};

INSTANTIATE_TEST_SUITE_P(Necks, StandingVoid, testing::Values(4.2, 5.1, 6.3),
                         [](const auto& test) { return "Case" + std::to_string(test.index); });

TEST_P(StandingVoid, KeepsItsShapeWhileTheSurfaceAboveItGrowsAndIsEtched) {
  Layers layers = necked_cavity(GetParam());
  OpenGas gas = open_gas(layers);
  const auto move = [&](float speed) {
    const TriMesh mesh = extract_surface(layers, gas);
    const CornerSpeeds speeds(mesh.triangles.size(), {speed, speed, speed});
    advect(layers, extend_speeds(layers, gas, mesh, speeds), 0.3);
    gas = open_gas(layers);
  };
  while (gas.voids.empty()) move(1);
  const TriMesh closed = void_surfaces(layers, gas)[0];
  const Region measured = gas.voids[0];
  const std::vector<float> phi = phi_of_voids(layers, gas);
  for (int step = 0; step < 90; ++step) {
    // Up, down again to about two spacings above where the void closed, and up.
    move(step < 30 || step >= 60 ? 1 : -0.8F);
    ASSERT_EQ(gas.voids.size(), 1U);
    ASSERT_EQ(gas.voids[0].volume, measured.volume) << step;
    ASSERT_EQ(gas.voids[0].upper, measured.upper) << step;
    ASSERT_EQ(phi_of_voids(layers, gas), phi) << step;
    ASSERT_EQ(void_surfaces(layers, gas)[0].vertices, closed.vertices) << step;
    ASSERT_TRUE(std::ranges::includes(places(extract_surface(layers)), places(closed))) << step;
  }
}

}  // namespace
}  // namespace scarp

#include "levelset/surface/resample.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/start/shapes.h"
#include "levelset/surface/extract_surface.h"

namespace scarp {
namespace {

constexpr std::array<Boundary, 2> periodic{Boundary::periodic, Boundary::periodic};

Frame frame_of(double spacing, std::array<Boundary, 2> boundary = {}) {
  const int cells = static_cast<int>(std::lround(48 / spacing));
  return {.spacing = spacing, .cells = {cells, cells}, .boundary = boundary};
}

// A ball of radius 15 in the middle of one side, half of it on a flat wafer.
double bump(Vec3d r) {
  const double x = std::min(std::abs(r.x - 24), std::abs(r.x + 24));
  return std::min(r.z, std::hypot(x, r.y, r.z) - 15);
}

Layers bump_on(const Frame& frame) {
  Layers layers{.frame = frame, .stack = {}};
  layers.stack.push_back({3, LevelSet(frame, bump, -10 * frame.spacing, 40)});
  return layers;
}

// What a diagonal of a cell of the coarser grid spans is 3 h^2 / 8R off the ball; the edge at its
// foot is met within half a cell.
TEST(Resampled, HasTheSurfaceOnAFinerAndOnACoarserGrid) {
  for (const auto& boundary : {std::array<Boundary, 2>{}, periodic}) {
    for (const auto& [from, to] : {std::array{3.0, 1.0}, {2.0, 1.0}, {1.0, 2.0}, {1.0, 3.0}}) {
      const Frame frame = frame_of(to, boundary);
      const Layers layers = resampled(bump_on(frame_of(from, boundary)), frame);
      ASSERT_EQ(layers.stack.size(), 1U);
      EXPECT_EQ(layers.stack[0].material, 3);
      EXPECT_EQ(layers.frame, frame);
      const double coarse = std::max(from, to);
      const TriMesh surface = extract_surface(layers);
      EXPECT_GT(surface.triangles.size(), 2 * 48 * 48 / (to * to));
      for (const Vec3f& v : surface.vertices) {
        const Vec3d r(v);
        const bool at_foot = std::abs(std::hypot(24 - std::abs(r.x), r.y) - 15) < coarse;
        EXPECT_LT(std::abs(bump(r)), at_foot ? 0.5 * coarse : 3 * coarse * coarse / (8 * 15))
            << from << " to " << to << " at " << r.x << ' ' << r.y << ' ' << r.z;
      }
    }
  }
}

// phi is a distance in the whole band, not as wide as that of the other grid.
TEST(Resampled, HasAWholeBand) {
  for (const auto& [from, to] : {std::array{2.0, 1.0}, {1.0, 3.0}}) {
    const Frame frame = frame_of(to);
    const LevelSet phi = std::move(resampled(bump_on(frame_of(from)), frame).stack[0].phi);
    for (const double cells : {-3.5, -2.0, 2.0, 3.5})
      EXPECT_NEAR(phi.distance({0, 20, cells * to}), cells * to, 0.01) << from << " to " << to;
  }
}

TEST(Resampled, KeepsThinFilms) {
  const Frame fine{.spacing = 1, .cells = {24, 1}, .two_dimensional = true};
  const Frame coarse{.spacing = 4, .cells = {6, 1}, .two_dimensional = true};
  const Layers start =
      build_layers(fine, std::vector<Shape>{WaferShape{.material = 0},
                                            LayerShape{.material = 1, .thickness = 0.4},
                                            LayerShape{.material = 2, .thickness = 3}});
  const Layers layers = resampled(resampled(start, coarse), fine);
  ASSERT_EQ(layers.stack.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    const double height = std::array{0.0, 0.4, 3.4}[k];
    EXPECT_NEAR(layers.stack[k].phi.distance({1.3, 0, 2}), 2 - height, 0.01) << k;
  }
}

// A ball's cap in a flat wafer, from its section: at its own spacing, and with fewer cells.
TEST(Resampled, ASectionThroughAnAxisBecomesWhatGoesAround) {
  const Frame frame{.spacing = 1, .cells = {48, 1}, .two_dimensional = true, .axisymmetric = true};
  const auto cap = [](Vec3d r) { return std::max(r.z, 15 - std::hypot(r.x, r.y, r.z - 5)); };
  Layers section{.frame = frame, .stack = {}};
  section.stack.push_back({3, LevelSet(frame, cap, -20, 10)});
  for (const int cells : {48, 24}) {
    const Layers layers = revolved(section, cells);
    const double spacing = 48.0 / cells;
    EXPECT_EQ(layers.frame, (Frame{.spacing = spacing, .cells = {cells, cells}}));
    const TriMesh surface = extract_surface(layers);
    EXPECT_GT(surface.triangles.size(), 2U * cells * cells);
    for (const Vec3f& v : surface.vertices) {
      const Vec3d r(v);
      const bool at_edge = std::abs(std::hypot(r.x, r.y) - std::sqrt(200.0)) < spacing;
      EXPECT_LT(std::abs(cap(r)), at_edge ? 0.5 * spacing : 3 * spacing * spacing / (8 * 15))
          << cells << " at " << r.x << ' ' << r.y << ' ' << r.z;
    }
  }
}

}  // namespace
}  // namespace scarp

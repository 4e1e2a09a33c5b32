#include "levelset/metrology/bent_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "levelset/surface/extract_surface.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

using Point = std::array<double, 2>;

const CutPlane plane = CutPlane::across(1, 0.3);

// The largest deviation of points of a line, and of the middles between them, between two heights.
template <class Deviation>
double largest(const std::vector<Polyline>& lines, double lower, double upper,
               const Deviation& deviation) {
  double most = 0;
  for (const Polyline& line : lines) {
    for (std::size_t n = 0; n + 1 < line.points.size(); ++n) {
      const auto& [x, z] = line.points[n];
      const auto& [x1, z1] = line.points[n + 1];
      for (const Point& point : {Point{x, z}, Point{0.5 * (x + x1), 0.5 * (z + z1)}})
        if (point[1] > lower && point[1] < upper) most = std::max(most, deviation(point));
    }
  }
  return most;
}

// Between a post of 3.4 spacings around (x, 0.3) and the lines that facets and arcs have of it.
TEST(BentLines, FollowARoundWall) {
  const Frame frame{.spacing = 1, .cells = {14, 14}};
  for (const double x : {0.0, 0.21, 0.5, 0.83}) {
    const LevelSet post(
        frame,
        [&](Vec3d r) {
          return std::min(std::max(std::hypot(r.x - x, r.y - 0.3) - 3.4, r.z - 5), r.z + 5);
        },
        -6, 6);
    const auto off = [&](const Point& point) { return std::abs(std::abs(point[0] - x) - 3.4); };
    const std::vector<Polyline> facets = cross_section(extract_surface(post), plane);
    EXPECT_GT(largest(facets, -2, 2, off), 0.03);
    EXPECT_LT(largest(bent(facets, plane, post), -2, 2, off), 0.01) << x;
  }
}

// A film of 2.5 spacings on the edge of a step, upright in the plane.
TEST(BentLines, FollowARoundEdge) {
  const Frame frame{.spacing = 1, .cells = {14, 14}};
  for (const double x : {0.0, 0.21, 0.5, 0.83}) {
    const auto distance = [&](Vec3d r) {
      const double dx = std::max(r.x - x, 0.0);
      const double dz = std::max(r.z, 0.0);
      const double inside = std::min(std::max(r.x - x, r.z), 0.0);
      return std::min(std::hypot(dx, dz) + inside - 2.5, r.z + 8);
    };
    const LevelSet film(frame, distance, -9, 3);
    const auto off = [&](const Point& point) {
      return point[0] < x ? 0 : std::abs(std::hypot(point[0] - x, point[1]) - 2.5);
    };
    const std::vector<Polyline> facets = cross_section(extract_surface(film), plane);
    EXPECT_GT(largest(facets, 0, 3, off), 0.05);
    EXPECT_LT(largest(bent(facets, plane, film), 0, 3, off), 0.04) << x;
  }
}

TEST(BentLines, LeaveSharpEdgesAsTheyAre) {
  const Frame frame{.spacing = 1, .cells = {14, 14}};
  for (const double x : {0.0, 0.21, 0.5, 0.83}) {
    const LevelSet step(
        frame, [&](Vec3d r) { return std::min(std::max(r.x - x, r.z), r.z + 5.3); }, -6, 1);
    const auto off = [&](const Point& point) {
      return std::min({std::abs(point[0] - x), std::abs(point[1]), std::abs(point[1] + 5.3)});
    };
    const std::vector<Polyline> facets = cross_section(extract_surface(step), plane);
    EXPECT_LE(largest(bent(facets, plane, step), -6, 1, off), largest(facets, -6, 1, off) + 1e-6)
        << x;
  }
}

}  // namespace
}  // namespace scarp

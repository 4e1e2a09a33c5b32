#include "levelset/start/sheets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "levelset/grid/distance.h"
#include "levelset/start/shapes.h"

namespace scarp {
namespace {

const Frame sheet_frame{.spacing = 1, .cells = {40, 40}};

LevelSet level_set(const std::function<double(Vec3d)>& distance) {
  const auto dilated = [&](Vec3d r) { return distance(r) - dilation; };
  return {sheet_frame, dilated, -20, 20, 2};
}

// Surfaces on nodes and beside them, with edges and tips of all kinds.
TEST(Sheets, SurfacesAreNone) {
  struct Case {
    std::string name;
    std::function<double(Vec3d)> distance;
  };
  const auto wedge = [](double angle, double middle) {
    return [=](Vec3d r) {
      const auto wall = [&](double side) {
        const Vec3d normal{side * std::cos(angle), 0, std::sin(angle)};
        return Distance{dot(r - Vec3d{middle, 0, 6}, normal), normal};
      };
      return intersect(wall(-1), wall(1)).value;
    };
  };
  std::vector<Case> cases{
      {"plane", [](Vec3d r) { return r.z; }},
      {"ball", [](Vec3d r) { return std::min(r.z, length(r) - 10); }},
      {"hole", [](Vec3d r) { return std::max(r.z, std::min(6 - std::hypot(r.x, r.y), r.z + 10)); }},
      {"pillar",
       [](Vec3d r) { return std::min(r.z, std::max(std::hypot(r.x, r.y) - 6, r.z - 10)); }},
      {"box",
       [](Vec3d r) {
         return std::min(r.z, std::max({std::abs(r.x) - 7, std::abs(r.y) - 5, r.z - 9}));
       }},
      {"turned box", [](Vec3d r) {
         const double across = std::max(std::abs(r.x + r.y), std::abs(r.x - r.y)) / std::sqrt(2.0);
         return std::min(r.z, std::max(across - 6 * std::sqrt(2.0), r.z - 9));
       }}};
  for (const double angle : {0.5, 0.8, 1.2})
    for (const double middle : {0.0, 0.3, 0.5})
      cases.push_back(
          {"ridge of " + std::to_string(angle) + " at " + std::to_string(middle),
           [ridge = wedge(angle, middle)](Vec3d r) { return std::min(r.z + 10, ridge(r)); }});
  for (const Case& c : cases) {
    LevelSet phi = level_set(c.distance);
    const std::uint64_t before = phi.hash();
    remove_sheets(phi);
    EXPECT_EQ(phi.hash(), before) << c.name;
  }
}

// Of gas and of solid, on nodes and between them: phi is the distance to what is left.
TEST(Sheets, AreTakenAway) {
  for (const double place : {0.0, 0.3, 0.5}) {
    for (const double side : {1.0, -1.0}) {
      const auto distance = [&](Vec3d r) {
        const double plane = r.z + 10 * side;
        const double sheet = std::abs(r.x - place);
        return side > 0 ? std::min(plane, std::max(sheet, std::abs(r.z) - 8))
                        : std::max(plane, -std::max(sheet, std::abs(r.z) - 8));
      };
      LevelSet phi = level_set(distance);
      remove_sheets(phi);
      for (int i = 0; i <= 40; ++i)
        for (int k = -9; k <= 9; ++k) {
          const double expected = std::clamp(k + 10 * side, -4.0, 4.0);
          EXPECT_NEAR(phi.node(i, 20, k), expected, 0.02) << place << ' ' << side << ' ' << k;
        }
    }
  }
}

}  // namespace
}  // namespace scarp

// What reaches a bottom that takes up a part of what arrives, below walls that give back all:
// aspect-ratio-dependent etching, against exact radiosity for slots and holes.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "flux/solve.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

/// The mean flux at a bottom by its sticking.
std::vector<std::array<double, 2>> reference(const std::string& shape, double aspect_ratio) {
  std::ifstream file(std::string(SCARP_SOURCE_DIR) + "/tests/reference/arde_bottom_flux.csv");
  std::vector<std::array<double, 2>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream row(line);
    std::vector<double> cells;
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(std::stod(cell));
    if (cells[0] == aspect_ratio) rows.push_back({cells[1], cells[shape == "hole" ? 2 : 4]});
  }
  return rows;
}

constexpr MaterialId wall = 0;
constexpr MaterialId bottom = 1;

exact::Shape with_bottom(exact::Shape shape) {
  double lowest = 0;
  for (const Vec3f& r : shape.mesh.vertices) lowest = std::min(lowest, double{r.z});
  for (std::size_t f = 0; f < shape.mesh.triangles.size(); ++f) {
    bool is_bottom = true;
    for (const Vec3d& r : corners(shape.mesh, f)) is_bottom = is_bottom && r.z < lowest + 1e-3;
    shape.mesh.materials.push_back(is_bottom ? bottom : wall);
  }
  return shape;
}

class Arde : public ::testing::TestWithParam<std::tuple<std::string, double>> {
 protected:
  static void expect_reference() {
    const auto& [name, aspect_ratio] = GetParam();
    const exact::Shape shape =
        with_bottom(name == "hole" ? exact::hole(aspect_ratio) : exact::trench(aspect_ratio));
    const std::vector<double> areas = facet_areas(shape.mesh);
    const auto rows = reference(name, aspect_ratio);
    ASSERT_EQ(rows.size(), 4U);
    for (const auto& [sticking, expected] : rows) {
      constexpr int seeds = 16;
      double sum = 0;
      double squares = 0;
      for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        const Species gas{.name = "gas", .sticking = {0, static_cast<float>(sticking)}};
        const FluxOptions options{.engine = FluxOptions::Engine::gather,
                                  .sides = shape.sides,
                                  .spacing = 1,
                                  .rays = 1 << 16,
                                  .seed = seed};
        const FluxField flux = solve_flux(shape.mesh, {&gas, 1}, options).front();
        double arrives = 0;
        double area = 0;
        for (std::size_t f = 0; f < areas.size(); ++f) {
          if (shape.mesh.materials[f] != bottom) continue;
          arrives += areas[f] * flux.arrivals().mean[f];
          area += areas[f];
        }
        sum += arrives / area;
        squares += arrives / area * arrives / area;
      }
      const double mean = sum / seeds;
      const double error = std::sqrt(std::max(0.0, squares / seeds - mean * mean) / (seeds - 1));
      // A prism of 128 sides, re-emission constant on each piece: .3 % too much at the most.
      EXPECT_NEAR(mean, expected, 5 * error + 0.003 * expected) << "sticking " << sticking;
    }
  }
};

TEST_P(Arde, FollowsTheExactSolution) { expect_reference(); }

using SlowArde = Arde;
TEST_P(SlowArde, FollowsTheExactSolution) { expect_reference(); }

INSTANTIATE_TEST_SUITE_P(Cases, Arde,
                         ::testing::Combine(::testing::Values("trench"),
                                            ::testing::Values(1.0, 5.0)));
INSTANTIATE_TEST_SUITE_P(Trench, SlowArde,
                         ::testing::Combine(::testing::Values("trench"),
                                            ::testing::Values(0.5, 2.0, 10.0, 20.0)));
INSTANTIATE_TEST_SUITE_P(Hole, SlowArde,
                         ::testing::Combine(::testing::Values("hole"),
                                            ::testing::Values(0.5, 1.0, 2.0, 5.0, 10.0, 20.0)));

}  // namespace
}  // namespace scarp

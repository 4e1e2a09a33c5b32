// Selective epitaxy in an opening of a mask.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "apps/simulator/simulator.h"
#include "core/error.h"
#include "tests/apps/final_state.h"
#include "tests/apps/recipe_text.h"
#include "tests/levelset/cross_sections.h"

namespace scarp {
namespace {

// The opening is filled from wall to wall: its width times what the plane of the wafer grows by.
TEST(Epitaxy, FillsAnOpeningFromWallToWall) {
  for (const double width : {80.0, 80.6, 81.3, 83.0}) {
    const Recipe recipe = read_text(R"(
[domain]
mode = "2d"
spacing = "2 nm"
extent = ["160 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "SiO2"
thickness = "40 nm"
opening = { shape = "trench", width = ")" +
                                    std::to_string(width) + R"( nm" }
[[step]]
model = "epitaxy"
duration = "30 s"
material = "SiGe"
growth_rate = "1 nm/s"
)");
    const State state = final_state(recipe);
    // In a slice one spacing wide; half a cell at each wall.
    const double area = material_volumes(state.layers).back() / 2;
    EXPECT_NEAR(area, width * 30, 2 * 0.5 * 4) << width;
    for (double x = 0; x < 0.5 * width - 2; x += 1)
      EXPECT_NEAR(state.layers.top().distance({x, 0, 30}), 0, 0.5) << width << ' ' << x;
  }
}

// Above the mask {111} planes become facets, at 54.74 degrees.
TEST(Epitaxy, SpreadsOverTheMaskWithFacets) {
  const Recipe recipe = read_text(R"(
[domain]
mode = "2d"
spacing = "1 nm"
extent = ["160 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "SiO2"
thickness = "10 nm"
opening = { shape = "trench", width = "80 nm" }
[[step]]
model = "epitaxy"
duration = "50 s"
material = "SiGe"
growth_rate = "1 nm/s"
ratio_111 = 0.2
ratio_110 = 0.5
ratio_311 = 0.7
)");
  const State state = final_state(recipe);
  const std::vector<Polyline> film = cross_section(state.layers, 1, 0.0).back();
  double upper = 0;
  double lower = 0;
  for (const Polyline& line : film) {
    for (std::size_t n = 0; n + 1 < line.points.size(); ++n) {
      const auto& a = line.points[n];
      const auto& b = line.points[n + 1];
      if (a[0] < 0) continue;
      const auto at = [&](double level) {
        return (a[1] - level) * (b[1] - level) <= 0 && a[1] != b[1]
                   ? a[0] + (b[0] - a[0]) * (level - a[1]) / (b[1] - a[1])
                   : 0.0;
      };
      upper = std::max(upper, at(40));
      lower = std::max(lower, at(20));
    }
  }
  EXPECT_NEAR(20 / (lower - upper), std::sqrt(2.0), 0.1);
}

/// Where the surface is along a line, which begins in the crystal, by bisection.
double surface_on(const LevelSet& phi, const Vec3d& start, const Vec3d& way) {
  double inner = 0;
  double outer = 1;
  for (int n = 0; n < 40; ++n) {
    const double middle = 0.5 * (inner + outer);
    (phi.distance(start + middle * way) < 0 ? inner : outer) = middle;
  }
  return inner;
}

/// A slot 40 spacings wide whose mask is 6 spacings thick, grown by 18 spacings. lift is how far
/// the wafer lies above nodes, centre the middle of the slot. In spacings.
void expect_facets_from_edges(double lift, double centre) {
  constexpr double thickness = 6;
  constexpr double time = 12;  // since the crystal has grown out of the opening
  const auto nm = [](double length) { return " = \"" + std::to_string(length) + " nm\"\n"; };
  const std::string wafer =
      lift > 0 ? "[[geometry]]\nshape = \"layer\"\nmaterial = \"Si\"\nthickness" + nm(lift) : "";
  const State state = final_state(read_text(R"(
[domain]
mode = "2d"
spacing = "1 nm"
extent = ["80 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
)" + wafer + R"([[geometry]]
shape = "mask"
material = "SiO2"
opening.shape = "trench"
opening.width = "40 nm"
opening.center)" + nm(centre) + "thickness" +
                                            nm(thickness) + R"([[step]]
model = "epitaxy"
duration = "18 s"
material = "SiGe"
growth_rate = "1 nm/s"
ratio_111 = 0.2
ratio_110 = 0.5
ratio_311 = 0.7
)"));
  const LevelSet& phi = state.layers.top();
  const double mask = lift + thickness;
  EXPECT_NEAR(mask - 6 + 30 * surface_on(phi, {centre, 0, mask - 6}, {0, 0, 30}), mask + time,
              0.05);
  const double sine = std::sqrt(2.0 / 3);
  // From the second spacing above the mask to two below the crystal's top.
  for (double height = 1.5; height < time - 2; ++height) {
    std::array<double, 2> reaches{};
    for (const int side : {-1, 1}) {
      const double x = 38 * surface_on(phi, {0, 0, mask + height}, {side * 38.0, 0, 0});
      reaches[side < 0 ? 0 : 1] = x;
      const double edge = 20 + side * centre;
      const double exact = edge + (0.2 * time) / sine - height * std::sqrt(0.5);
      EXPECT_NEAR((x - exact) * sine, 0, 0.1)  // from the plane
          << lift << ' ' << centre << ' ' << side << ' ' << height;
    }
    const double width = 40 + 2 * ((0.2 * time) / sine - height * std::sqrt(0.5));
    EXPECT_NEAR(reaches[0] + reaches[1], width, 0.01 * 40) << lift << ' ' << centre;
  }
}

// The {111} facets begin at the edges of the mask, wherever these lie between nodes, when the
// crystal passes the mask's upper surface. Before, they began 0.6 to 1.8 spacings too far out.
TEST(Epitaxy, FacetsBeginAtTheEdgesOfTheMask) {
  for (const double lift : {0.0, 0.3, 0.5, 0.8})
    for (const double centre : {0.0, 0.2, 0.4}) expect_facets_from_edges(lift, centre);
}

// A cross-section has no sides along y that could mirror the crystal: it is the slice of a periodic
// structure.
TEST(Epitaxy, ACrystalThatIsNotSymmetricAlongTheTrenchGrowsInACrossSection) {
  const auto grown = [](const std::string& domain) {
    const Recipe recipe = read_text("[domain]\nspacing = \"4 nm\"\n" + domain + R"(
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "SiO2"
thickness = "20 nm"
opening = { shape = "trench", width = "80 nm" }
[[step]]
model = "epitaxy"
duration = "60 s"
material = "SiGe"
growth_rate = "1 nm/s"
wafer = "111"
)");
    return material_volumes(final_state(recipe).layers).back();
  };
  const double slice = grown("mode = \"2d\"\nextent = [\"160 nm\"]\n") / 4;
  const double whole =
      grown("extent = [\"160 nm\", \"16 nm\"]\nboundary = [\"reflective\", \"periodic\"]\n") / 16;
  EXPECT_GT(slice, 80 * 25);
  EXPECT_NEAR(slice, whole, 0.02 * whole);
  EXPECT_THROW(grown("extent = [\"160 nm\", \"16 nm\"]\n"), InputError);
}

}  // namespace
}  // namespace scarp

// Film growth in a trench against an independent moving-boundary solution: a string of segments
// with deterministic radiosity in the plane, no level set and no random numbers. The reference is
// good to 1 % (.002 absolute), the gap to .01; units of the trench's width and of the flat film.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "apps/run.h"
#include "levelset/checkpoint.h"
#include "levelset/cross_section.h"
#include "tests/temporary_folder.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

constexpr double width = 4000;  // nm, 40 cells
constexpr double depth = 2 * width;
constexpr double tenth_cell = 0.1 / 40;

using Profile = std::map<std::string, double>;

// Thickness at walls and bottom and the narrowest gap, by time in hundredths.
std::map<int, Profile> reference() {
  std::map<int, Profile> profiles;
  std::ifstream in(fs::path(SCARP_SOURCE_DIR) / "tests/reference/trench_growth.csv");
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line);
    std::string ratio, sticking, time, quantity, coarse, fine, best;
    std::getline(cells, ratio, ',');
    std::getline(cells, sticking, ',');
    std::getline(cells, time, ',');
    std::getline(cells, quantity, ',');
    std::getline(cells, coarse, ',');
    std::getline(cells, fine, ',');
    std::getline(cells, best, ',');
    if (ratio != "2" || sticking != "0.1" || time.empty()) continue;
    profiles[static_cast<int>(std::lround(100 * std::stod(time)))][quantity] = std::stod(best);
  }
  return profiles;
}

// Where a horizontal (axis 1) or vertical (axis 0) line meets the outlines.
std::vector<double> crossings(const std::vector<Polyline>& lines, int axis, double position) {
  std::vector<double> found;
  for (const Polyline& line : lines) {
    for (std::size_t p = 0; p + 1 < line.points.size(); ++p) {
      const auto& a = line.points[p];
      const auto& b = line.points[p + 1];
      const auto along = static_cast<std::size_t>(axis);
      if ((a[along] < position) == (b[along] < position)) continue;
      const double t = (position - a[along]) / (b[along] - a[along]);
      found.push_back(a[1 - along] + t * (b[1 - along] - a[1 - along]));
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

double wall_thickness(const std::vector<Polyline>& lines, double z) {
  const std::vector<double> x = crossings(lines, 1, z);
  if (x.size() != 2) return NAN;
  return 0.5 * (width - (x[1] - x[0])) / width;
}

Profile measured(const Layers& layers) {
  const std::vector<Polyline> lines = cross_section(layers, 1, 0.0).back();
  Profile profile;
  profile["wall_z0"] = wall_thickness(lines, -0.01);
  profile["wall_z0.25A"] = wall_thickness(lines, -0.25 * depth);
  profile["wall_z0.5A"] = wall_thickness(lines, -0.5 * depth);
  profile["wall_z0.75A"] = wall_thickness(lines, -0.75 * depth);
  profile["bottom_centre"] = (crossings(lines, 0, 0.01).front() + depth) / width;
  double gap = 1;
  for (double z = -0.75 * depth; z < 0.25 * width; z += 0.005 * width) {
    gap = std::min(gap, 1 - 2 * wall_thickness(lines, z));
  }
  profile["narrowest_gap"] = gap;
  return profile;
}

class TrenchGrowth : public ::testing::TestWithParam<bool> {};

TEST_P(TrenchGrowth, FollowsTheMovingBoundarySolution) {
  const bool simplified = GetParam();
  const TemporaryFolder folder;
  const Recipe recipe =
      read_recipe(fs::path(SCARP_SOURCE_DIR) / "configs/trench_deposition.toml",
                  {"domain.extent=[\"10 um\", \"1 um\"]",
                   simplified ? "simplify.enabled=true" : "simplify.enabled=false"});
  ASSERT_EQ(run(recipe, folder, {}), RunEnd::complete);

  const auto expected = reference();
  for (int output = 1; output <= 4; ++output) {
    const Checkpoint state =
        read_checkpoint(folder / ("state_000" + std::to_string(output) + ".vdb"));
    const Profile profile = measured(state.layers);
    for (const auto& [quantity, value] : expected.at(10 * output)) {
      EXPECT_NEAR(profile.at(quantity), value, 0.02 * value + tenth_cell)
          << quantity << " at flat thickness " << 0.1 * output;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Mesh, TrenchGrowth, ::testing::Bool(),
                         [](const auto& test) { return test.param ? "Simplified" : "Full"; });

// The same in two dimensions: a slice one cell thick, with rays in the plane.
TEST(TrenchGrowth2d, FollowsTheMovingBoundarySolution) {
  const TemporaryFolder folder;
  const Recipe recipe = read_recipe(
      fs::path(SCARP_SOURCE_DIR) / "configs/trench_deposition.toml",
      {"domain.mode=\"2d\"", "domain.extent=[\"10 um\"]", "domain.boundary=[\"reflective\"]"});
  ASSERT_EQ(run(recipe, folder, {}), RunEnd::complete);
  const Profile profile = measured(read_checkpoint(folder / "state_0004.vdb").layers);
  const Profile expected = reference().at(40);
  for (const auto& [quantity, value] : expected) {
    EXPECT_NEAR(profile.at(quantity), value, 0.02 * value + tenth_cell) << quantity;
  }
}

}  // namespace
}  // namespace scarp

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

#include "apps/run/run.h"
#include "core/system/temporary_folder.h"
#include "levelset/grid/checkpoint.h"
#include "tests/levelset/cross_sections.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

constexpr double width = 4000;  // nm, 40 cells
constexpr double tenth_cell = 0.1 / 40;

using Profile = std::map<std::string, double>;

/// A trench, and a mesh that the flux is solved on.
struct Growing {
  const char* name;
  int aspect;
  const char* sticking;
  std::vector<std::string> changes;  ///< to the recipe

  double depth() const { return aspect * width; }
};

// Thickness at walls and bottom and the narrowest gap, by time in tenths.
std::map<int, Profile> reference(const Growing& growth) {
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
    if (ratio != std::to_string(growth.aspect) || sticking != growth.sticking || time.empty())
      continue;
    profiles[static_cast<int>(std::lround(10 * std::stod(time)))][quantity] = std::stod(best);
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

Profile measured(const Layers& layers, double depth) {
  const std::vector<Polyline> lines = cross_section(layers, 1, 0.0).back();
  Profile profile;
  profile["wall_z0"] = wall_thickness(lines, -0.01);
  profile["wall_z0.25A"] = wall_thickness(lines, -0.25 * depth);
  profile["wall_z0.5A"] = wall_thickness(lines, -0.5 * depth);
  profile["wall_z0.75A"] = wall_thickness(lines, -0.75 * depth);
  profile["bottom_centre"] = (crossings(lines, 0, 0.01).front() + depth) / width;
  double gap = 1;
  for (double z = -0.5 * depth; z < 0.25 * width; z += 0.005 * width) {
    gap = std::min(gap, 1 - 2 * wall_thickness(lines, z));
  }
  profile["narrowest_gap"] = gap;
  return profile;
}

class TrenchGrowth : public ::testing::TestWithParam<Growing> {
 protected:
  // Up to the thickness of half the trench; every tenth of it is an output.
  static void expect_reference(const Growing& growth) {
    const TemporaryFolder folder;
    std::vector<std::string> changes{
        "geometry[1].depth=\"" + std::to_string(4 * growth.aspect) + " um\"",
        std::string("step[0].sticking=") + growth.sticking, "step[0].duration=\"2 min\""};
    changes.insert(changes.end(), growth.changes.begin(), growth.changes.end());
    const Recipe recipe = read_recipe(
        recipe_in(fs::path(SCARP_SOURCE_DIR) / "configs/trench_deposition.toml", changes));
    ASSERT_EQ(run(recipe, folder, {}), RunEnd::complete);

    const auto expected = reference(growth);
    for (int output = 1; output <= 5; ++output) {
      const Checkpoint state =
          read_checkpoint(folder / ("state_000" + std::to_string(output) + ".vdb"));
      const Profile profile = measured(state.layers, growth.depth());
      for (const auto& [quantity, value] : expected.at(output)) {
        // At first that station lies beside an edge that grows round: good to 5 %.
        const double known = quantity == "wall_z0" && output == 1 ? 0.05 * value : 0;
        EXPECT_NEAR(profile.at(quantity), value, 0.02 * value + tenth_cell + known)
            << quantity << " at flat thickness " << 0.1 * output;
      }
    }
  }
};

TEST_P(TrenchGrowth, FollowsTheMovingBoundarySolution) { expect_reference(GetParam()); }

using SlowTrenchGrowth = TrenchGrowth;
TEST_P(SlowTrenchGrowth, FollowsTheMovingBoundarySolution) { expect_reference(GetParam()); }

const std::vector<std::string> strip_settings{"domain.extent=[\"10 um\", \"1 um\"]"};
const std::vector<std::string> full_strip_settings{strip_settings[0], "simplify.enabled=false"};
const std::vector<std::string> plane_settings{"domain.mode=\"2d\"", "domain.extent=[\"10 um\"]",
                                              "domain.boundary=[\"reflective\"]"};

const auto name_of = [](const auto& test) { return std::string(test.param.name); };

INSTANTIATE_TEST_SUITE_P(
    Of, TrenchGrowth,
    ::testing::Values(Growing{"Deep", 2, "0.1", strip_settings},
                      Growing{"DeepFull", 2, "0.1", full_strip_settings},
                      Growing{"DeepInPlane", 2, "0.1", plane_settings},
                      Growing{"DeepHalfSticksInPlane", 2, "0.5", plane_settings},
                      Growing{"DeepAllStickInPlane", 2, "1.0", plane_settings},
                      Growing{"DeepHardlySticksInPlane", 2, "0.001", plane_settings},
                      Growing{"ShallowInPlane", 1, "0.1", plane_settings}),
    name_of);
INSTANTIATE_TEST_SUITE_P(Of, SlowTrenchGrowth,
                         ::testing::Values(Growing{"Shallow", 1, "0.1", strip_settings},
                                           Growing{"DeepHalfSticks", 2, "0.5", strip_settings},
                                           Growing{"DeepAllStick", 2, "1.0", strip_settings}),
                         name_of);

}  // namespace
}  // namespace scarp

// The Bosch process: films of two grid spacings, deposited, opened and etched through.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "apps/run/run.h"
#include "core/system/read_file.h"
#include "core/system/temporary_folder.h"
#include "levelset/grid/checkpoint.h"
#include "levelset/operations/layer_steps.h"
#include "tests/levelset/cross_sections.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

fs::path config(const std::string& name) { return fs::path(SCARP_SOURCE_DIR) / "configs" / name; }

Layers layers_after(const fs::path& folder, int output) {
  return read_checkpoint(folder / ("state_000" + std::to_string(output) + ".vdb")).layers;
}

// One cycle of the recipe on a wafer without a mask. Its fluxes times its volumes per particle make
// 10.3125 nm/s of polymer, which goes at 8.46875 nm/s, and silicon at 101.8125 nm/s.
TEST(Bosch, OfAnOpenWaferIsWhatItsRatesMake) {
  const TemporaryFolder folder;
  const std::string text = read_file(config("bosch_trench.toml"));
  const std::size_t mask = text.find("[[geometry]]\nshape     = \"mask\"");
  const std::size_t rest = text.find("[flux]");
  ASSERT_NE(mask, std::string::npos);
  std::ofstream(folder / "flat.toml") << text.substr(0, mask) << text.substr(rest);
  const Recipe recipe =
      read_recipe(recipe_in(folder / "flat.toml", {"domain.extent=[\"200 nm\"]", "step[0].repeat=1",
                                                   "output.every=\"0 s\""}));
  ASSERT_EQ(run(recipe, folder / "out", {}), RunEnd::complete);

  const double surface = highest_point(layers_after(folder / "out", 0));
  const double film = highest_point(layers_after(folder / "out", 1)) - surface;
  const double depth = surface - highest_point(layers_after(folder / "out", 2));
  const double cleared_after = 5 * 10.3125 / 8.46875;
  EXPECT_NEAR(film, 5 * 10.3125, 0.01 * film);
  EXPECT_NEAR(depth, (11 - cleared_after) * 101.8125, 0.01 * depth);
}

/// The outermost place of a material's surface to the right of the middle, between two heights.
/// Units: nm.
double rightmost(const std::vector<Polyline>& lines, double lower, double upper) {
  double x = 0;
  for (const Polyline& line : lines) {
    for (const auto& [px, pz] : line.points) {
      if (pz > lower && pz < upper) x = std::max(x, px);
    }
  }
  return x;
}

/// The same for where the wall comes nearest to the middle.
double innermost(const std::vector<Polyline>& lines, double lower, double upper) {
  double x = 1e9;
  for (const Polyline& line : lines) {
    for (const auto& [px, pz] : line.points) {
      if (px > 0 && pz > lower && pz < upper) x = std::min(x, px);
    }
  }
  return x;
}

// Around the edge of the open floor, at x = 950 nm, silicon goes in an arc of 500 nm. Upwards the
// etch follows the film on the arc above, a radian far.
TEST(Bosch, LeavesArcsAndCusps) {
  const TemporaryFolder folder;
  const Recipe recipe = read_recipe(
      recipe_in(config("bosch_emulation.toml"), {"step[0].repeat=3", "output.every=\"0 s\""}));
  ASSERT_EQ(run(recipe, folder, {}), RunEnd::complete);
  const Layers layers = read_checkpoint(folder / "state_0012.vdb").layers;
  const std::vector<Polyline> silicon = cross_section(layers, 1, 0.0).front();
  const double spacing = recipe.domain.frame.spacing;
  const double arc = 500;
  for (const double floor : {-500.0, -1000.0}) {
    EXPECT_NEAR(rightmost(silicon, floor - 100, floor + 100), 950 + arc, spacing) << floor;
    EXPECT_NEAR(innermost(silicon, floor + 150, floor + 350), 950 + arc * std::sin(1.0),
                1.2 * spacing)
        << floor;
  }
}

}  // namespace
}  // namespace scarp

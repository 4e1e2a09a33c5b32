// The recipes of configs/, run at a coarse spacing, and what they were expected to take.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "apps/estimate/estimate.h"
#include "apps/run/results.h"
#include "apps/run/run.h"
#include "apps/simulator/symmetry.h"
#include "core/system/temporary_folder.h"
#include "tests/apps/columns.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

const fs::path configs = fs::path(SCARP_SOURCE_DIR) / "configs";

/// What makes each of them quick.
const std::map<std::string, std::vector<std::string>>& quick_overrides() {
  static const std::map<std::string, std::vector<std::string>> overrides{
      {"ald_cavity",
       {"domain.spacing=\"25 nm\"", "step[0].duration=\"2 min\"", "step[1].cycles=200"}},
      {"bosch_emulation", {"domain.spacing=\"25 nm\"", "step[0].repeat=1"}},
      {"bosch_sf6_c4f8",
       {"domain.spacing=\"20 nm\"", "step[0].repeat=1", "step[0].step[1].duration=\"20 s\""}},
      {"bosch_trench", {"step[0].repeat=1", "step[0].step[1].duration=\"7 s\""}},
      {"cf4_o2_recess", {"domain.spacing=\"2 nm\"", "step[0].duration=\"1 s\""}},
      {"contact_module", {"domain.spacing=\"10 nm\""}},
      {"dual_damascene", {"domain.spacing=\"10 nm\""}},
      {"litho_etch_litho_etch", {"domain.spacing=\"10 nm\""}},
      {"sadp_cut", {"domain.spacing=\"10 nm\""}},
      {"epitaxy_source_drain", {"domain.spacing=\"5 nm\""}},
      {"flat_deposition", {"domain.spacing=\"50 nm\""}},
      {"fluorocarbon_stack", {"domain.spacing=\"4 nm\"", "step[0].duration=\"8 s\""}},
      {"hole_directional_etch", {"domain.spacing=\"30 nm\""}},
      {"ion_etch", {"domain.spacing=\"40 nm\"", "step[0].duration=\"20 s\""}},
      {"ion_milling", {"domain.spacing=\"20 nm\"", "step[0].duration=\"1 min\""}},
      {"isotropic_etch", {"domain.spacing=\"80 nm\""}},
      {"koh_pyramid", {"domain.spacing=\"0.125 um\"", "step[0].duration=\"10 s\""}},
      {"langmuir_slots", {"domain.spacing=\"20 nm\"", "step[0].duration=\"5 s\""}},
      {"oxide_regrowth", {"domain.spacing=\"5 nm\"", "step[0].duration=\"4 min\""}},
      {"oxide_opening", {"domain.spacing=\"5 nm\""}},
      {"pecvd_teos_gap", {"domain.spacing=\"5 um\""}},
      {"teos_two_precursors", {"domain.spacing=\"5 um\""}},
      {"sf6_o2_hole", {"domain.spacing=\"75 nm\"", "step[0].duration=\"20 s\""}},
      {"sputter_deposition",
       {"domain.spacing=\"12 nm\"", "step[0].duration=\"10 s\"", "step[1].duration=\"5 s\""}},
      {"trench_deposition", {"domain.spacing=\"0.5 um\""}},
      {"trench_isolation", {"domain.spacing=\"20 nm\""}},
      {"via_liner", {"domain.spacing=\"0.2 um\""}}};
  return overrides;
}

std::vector<std::string> names_of_configs() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(configs)) {
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

bool is_within_a_factor_of_two(double expected, double found) {
  return expected <= 2 * found && found <= 2 * expected;
}

class Configs : public ::testing::TestWithParam<std::string> {};

TEST_P(Configs, RunsAtACoarseSpacing) {
  const auto overrides = quick_overrides().find(GetParam());
  ASSERT_NE(overrides, quick_overrides().end()) << "say above what makes it quick";
  std::vector<std::string> wanted = overrides->second;
  wanted.emplace_back("flux.target_error=0.1");
  const TemporaryFolder folder;
  const Recipe recipe = read_recipe(recipe_in(configs / (GetParam() + ".toml"), wanted));
  const CostEstimate expected =
      estimate_cost(on_part(recipe, mirror_planes(recipe)), {}, write_trial_output);
  ASSERT_EQ(run(recipe, folder, {}), RunEnd::complete);

  const auto columns = columns_of(folder / "metrics.csv");
  ASSERT_FALSE(columns.at("time_s").empty());
  double time = 0;
  bool ends_by_time = true;
  for (const ProcessStep& step : recipe.steps) {
    time += step.duration;
    ends_by_time = ends_by_time && !step.until;
  }
  const double end = std::stod(columns.at("time_s").back());
  EXPECT_LE(end, time * (1 + 1e-9));
  EXPECT_GE(end, ends_by_time ? time * (1 - 1e-9) : 0);
  for (const auto& [name, cells] : columns) {
    for (const std::string& cell : cells) {
      EXPECT_EQ(cell.find("nan"), std::string::npos) << name;
      EXPECT_EQ(cell.find("inf"), std::string::npos) << name;
    }
  }
  // What is counted, of what scarp check says; its seconds are those of the machine.
  const auto time_steps = static_cast<double>(columns.at("time_step").size());
  EXPECT_TRUE(is_within_a_factor_of_two(expected.time_steps, time_steps))
      << expected.time_steps << " and " << time_steps;
  double rays = 0;
  for (const std::string& each : columns.at("rays")) rays += std::stod(each);
  const double expected_rays = expected.rays_per_time_step * expected.time_steps;
  EXPECT_TRUE(is_within_a_factor_of_two(expected_rays, rays)) << expected_rays << " and " << rays;
  for (const std::string& lost : columns.at("lost_weight")) EXPECT_EQ(std::stod(lost), 0);
}

INSTANTIATE_TEST_SUITE_P(All, Configs, ::testing::ValuesIn(names_of_configs()),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace scarp

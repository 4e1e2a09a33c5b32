// Coverages and fluxes that fit each other, on whole surfaces and through the time steps of a run.

#include "apps/simulator/coverages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "apps/run/restart.h"
#include "apps/run/run.h"
#include "apps/simulator/simulator.h"
#include "apps/simulator/state_file.h"
#include "core/parallel.h"
#include "core/system/temporary_folder.h"
#include "levelset/grid/checkpoint.h"
#include "tests/apps/columns.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* flat_wafer = R"(
[domain]
mode = "2d"
spacing = "10 nm"
extent = ["100 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[flux]
target_error = 0.005
)";

constexpr const char* small_hole = R"(
[domain]
spacing = "50 nm"
extent = ["400 nm", "400 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "hole"
radius = "190 nm"
depth = "1 um"
center = ["-200 nm", "-200 nm"]
[[geometry]]
shape = "mask"
material = "mask"
thickness = "200 nm"
opening = { shape = "hole", radius = "190 nm", center = ["-200 nm", "-200 nm"] }
[flux]
target_error = 0.03
[[step]]
model = "sf6_o2"
duration = "4 s"
etchant_flux = "4.5e18 /cm2/s"
passivation_flux = "4e17 /cm2/s"
[[step.ion]]
flux = "1e16 /cm2/s"
[output]
every = "1 s"
)";

std::vector<std::span<const float>> tallies_of(const Survey& survey) {
  std::vector<std::span<const float>> tallies;
  for (const FluxField& field : survey.flux)
    for (const Tally& tally : field.tallies) tallies.emplace_back(tally.mean);
  return tallies;
}

double largest_difference(const std::vector<std::vector<float>>& a,
                          const std::vector<std::vector<float>>& b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    for (std::size_t f = 0; f < a[k].size(); ++f)
      largest = std::max(largest, std::abs(static_cast<double>(a[k][f]) - b[k][f]));
  return largest;
}

// The balance with the numbers of sf6_o2 written out, on every facet of the hole.
TEST(Coverages, BalanceTheFluxOnEveryFacetOfAHole) {
  const Recipe recipe = read_text(small_hole);
  const State state = start_state(recipe.domain.frame, recipe.start);
  const Survey now = survey(state, recipe);
  EXPECT_TRUE(now.coverage_fit.reached);
  EXPECT_LE(now.coverage_fit.change, recipe.flux.coverages.tolerance);
  EXPECT_GT(now.coverage_fit.iterations, 1);
  const auto flux = tallies_of(now);
  double least = 1;
  for (std::size_t f = 0; f < now.facets.triangles.size(); ++f) {
    const double e = now.coverages[0][f];
    const double p = now.coverages[1][f];
    const double arrives_e = 0.7 * 4500 * flux[0][f];
    const double arrives_p = 400 * flux[1][f];
    const double leaves_e = 300 + 2 * 10 * flux[3][f];
    const double leaves_p = 0.04 + 10 * flux[4][f];
    const double bare = 1 - e - p;
    // To the tolerance of a coverage, which the site feels by all that arrives and leaves.
    const double tolerance = 2 * recipe.flux.coverages.tolerance;
    EXPECT_NEAR(arrives_e * bare, leaves_e * e, tolerance * (arrives_e + leaves_e)) << f;
    EXPECT_NEAR(arrives_p * bare, leaves_p * p, tolerance * (arrives_p + leaves_p)) << f;
    least = std::min(least, static_cast<double>(flux[1][f]));
  }
  EXPECT_LT(least, 0.6);  // so the sticking matters
}

TEST(Coverages, DoNotDependOnTheStart) {
  Recipe recipe = read_text(small_hole);
  recipe.flux.options.rays =
      100'000;  // how many a target asks for, first rounds say, which do depend on it
  State state = start_state(recipe.domain.frame, recipe.start);
  const Survey from_above = survey(state, recipe);
  const double tolerance = recipe.flux.coverages.tolerance;
  const auto start_with = [&](float etchant, float passivation) {
    const std::size_t count = from_above.facets.triangles.size();
    state.mesh.facets = from_above.facets;
    state.coverages = {
        .names = {"F", "O"},
        .values = {std::vector<float>(count, etchant), std::vector<float>(count, passivation)}};
    return survey(state, recipe);
  };
  for (const auto& [etchant, passivation] : {std::pair{0.0F, 0.0F}, {1.0F, 0.0F}, {0.0F, 1.0F}}) {
    const Survey other = start_with(etchant, passivation);
    EXPECT_TRUE(other.coverage_fit.reached);
    // What is left to go is the last change and what a geometric series adds to it.
    EXPECT_LT(largest_difference(other.coverages, from_above.coverages), 10 * tolerance);
  }
}

TEST(Coverages, FitAtOnceWhereTheyAreKnown) {
  Recipe recipe = read_text(small_hole);
  recipe.flux.options.target_error = 1;  // one number of rays
  State state = start_state(recipe.domain.frame, recipe.start);
  const Survey first = survey(state, recipe);
  EXPECT_GT(first.coverage_fit.iterations, 3);
  state.mesh.facets = first.facets;
  state.coverages = {.names = {"F", "O"}, .values = first.coverages};
  EXPECT_EQ(survey(state, recipe).coverage_fit.iterations, 1);
  // What is not of this model is no start.
  state.coverages.names = {"F", "polymer"};
  EXPECT_EQ(survey(state, recipe).coverage_fit.iterations, first.coverage_fit.iterations);
}

TEST(Coverages, GoFromTimeStepToTimeStep) {
  const Recipe recipe = read_text(small_hole);
  State state = start_state(recipe.domain.frame, recipe.start);
  const Survey first = survey(state, recipe);
  advance(state, recipe, first, 0.2);
  EXPECT_EQ(state.coverages.names, (std::vector<std::string>{"F", "O"}));
  EXPECT_EQ(state.coverages.values, first.coverages);
  EXPECT_EQ(state.mesh.facets.triangles, first.facets.triangles);
  const Survey carried_on = survey(state, recipe);
  state.coverages = {};
  const Survey anew = survey(state, recipe);
  EXPECT_LE(carried_on.coverage_fit.iterations, anew.coverage_fit.iterations);
  EXPECT_LT(largest_difference(carried_on.coverages, anew.coverages),
            10 * recipe.flux.coverages.tolerance);
}

TEST(Coverages, BitsDoNotDependOnThreads) {
  const Recipe recipe = read_text(small_hole);
  const State state = start_state(recipe.domain.frame, recipe.start);
  std::vector<std::vector<std::vector<float>>> coverages;
  for (const int threads : {1, 2, 8}) {
    const ThreadLimit limit(threads);
    coverages.push_back(survey(state, recipe).coverages);
  }
  EXPECT_EQ(coverages[0], coverages[1]);
  EXPECT_EQ(coverages[0], coverages[2]);
}

/// One gas that covers what it reaches: theta = F / (1 + F).
class Langmuir final : public BalancedCoverages {
 public:
  std::vector<std::string> coverage_names() const override { return {"gas"}; }
  std::vector<std::vector<float>> steady_coverages(
      const SurfacePoints&, std::span<const std::span<const float>> flux) const override {
    std::vector<float> theta;
    for (const float f : flux[0]) theta.push_back(f / (1 + f));
    return {theta};
  }
  std::vector<std::vector<float>> covered_sticking(
      const SurfacePoints&, std::span<const std::vector<float>> coverages) const override {
    std::vector<float> sticking;
    for (const float theta : coverages[0]) sticking.push_back(1 - theta);
    return {sticking};
  }
};

// Turns go on as long as a single facet among many is not done.
TEST(CoverageIteration, WaitsForTheWorstFacet) {
  const Langmuir model;
  TriMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles.assign(20, {0, 1, 2});
  mesh.materials.assign(20, 0);
  const CoverageOptions options{.tolerance = 1e-3, .most_iterations = 10};
  CoverageIteration iteration(model, mesh, {}, options);
  const StickingFeedback feedback = iteration.feedback();
  EXPECT_EQ(feedback.species, std::vector<bool>{true});
  std::vector<float> flux(20, 1);
  std::vector<std::vector<float>> sticking(1);
  const auto turn = [&] {
    const std::vector<std::span<const float>> tallies{flux};
    return feedback.update(tallies, sticking);
  };
  EXPECT_TRUE(turn());
  EXPECT_EQ(sticking[0], std::vector<float>(20, 0.5F));
  flux[11] = 1.01F;  // 0.0025 more of a coverage, 0.0006 of it in the root mean square
  EXPECT_TRUE(turn());
  EXPECT_EQ(iteration.fit().facet, 11U);
  EXPECT_NEAR(iteration.fit().change, 1.01 / 2.01 - 0.5, 1e-6);
  EXPECT_FLOAT_EQ(sticking[0][11], 1 / 2.01F);
  flux[11] = 1.0101F;
  EXPECT_FALSE(turn());
  EXPECT_TRUE(iteration.fit().reached);
  EXPECT_EQ(iteration.fit().iterations, 2);
}

// As errors need it: asked about any flux, and nothing of the iteration changes by it.
TEST(CoverageIteration, TellsTheStickingOfOtherFluxes) {
  const Langmuir model;
  TriMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.materials = {0};
  CoverageIteration iteration(model, mesh, {}, {.tolerance = 1e-3, .most_iterations = 10});
  const StickingFeedback feedback = iteration.feedback();
  const std::vector<float> flux{1};
  std::vector<std::vector<float>> sticking(1);
  feedback.update(std::vector<std::span<const float>>{flux}, sticking);
  const std::vector<std::vector<float>> before = iteration.coverages();
  const std::vector<float> other{3};
  EXPECT_EQ(feedback.sticking_at(std::vector<std::span<const float>>{other}),
            (std::vector<std::vector<float>>{{0.25F}}));
  EXPECT_EQ(iteration.coverages(), before);
}

TEST(Coverages, AreCarriedFromTheClosestPoint) {
  const std::vector<std::vector<float>> known{{0.25F, 0.75F}};
  TriMesh mesh;
  mesh.vertices = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {2, 2, 0}};
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
  TriMesh other;
  other.vertices = {{0, 0, 1},  {0.5F, 0, 1},  {0, 0.5F, 1},
                    {2, 2, -1}, {1.5F, 2, -1}, {2, 1.5F, -1}};
  other.triangles = {{3, 4, 5}, {0, 1, 2}};
  EXPECT_EQ(carried(known, mesh, other, 2, {}), (std::vector<std::vector<float>>{{0.75F, 0.25F}}));
}

struct Covered {
  TriMesh facets;
  std::vector<std::vector<float>> values;
};

/// A wavy wafer 80 x 80 nm, in cells of a width, with a pattern of two coverages on it.
Covered wavy(float cell, bool is_turned) {
  Covered known{.facets = {}, .values = {{}, {}}};
  const auto count = static_cast<std::uint32_t>(std::lround(80 / cell));
  for (std::uint32_t j = 0; j <= count; ++j) {
    for (std::uint32_t i = 0; i <= count; ++i) {
      const float x = cell * static_cast<float>(i);
      const float y = cell * static_cast<float>(j);
      known.facets.vertices.push_back({x, y, 5 * std::sin(x / 12) * std::cos(y / 15)});
    }
  }
  for (std::uint32_t j = 0; j < count; ++j) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t v = j * (count + 1) + i;
      const std::uint32_t up = v + count + 1;
      if (is_turned) {
        known.facets.triangles.insert(known.facets.triangles.end(),
                                      {{v, v + 1, up + 1}, {v, up + 1, up}});
      } else {
        known.facets.triangles.insert(known.facets.triangles.end(),
                                      {{v, v + 1, up}, {v + 1, up + 1, up}});
      }
    }
  }
  for (std::size_t f = 0; f < known.facets.triangles.size(); ++f) {
    const Vec3f r = known.facets.vertices[known.facets.triangles[f][0]];
    const bool is_left = r.x < 33;
    known.values[0].push_back(is_left ? 1.0F : 0.3F * r.y / 80);
    known.values[1].push_back(is_left ? 0.0F : 0.7F);
  }
  return known;
}

double area_of(const TriMesh& mesh) {
  const std::vector<double> areas = facet_areas(mesh);
  return std::accumulate(areas.begin(), areas.end(), 0.0);
}

// From fine facets to coarse ones and back: of what is covered nothing is lost or made, however
// often. Covered whole on the left, where nothing can be added.
TEST(Coverages, KeepTheirIntegralWhenTheMeshIsMadeAnew) {
  Covered now = wavy(2, false);
  const double area = area_of(now.facets);
  const std::vector<double> before = covered_areas(facet_areas(now.facets), now.values);
  for (const float cell : {5.0F, 1.0F, 8.0F, 2.0F}) {
    const TriMesh next = wavy(cell, cell > 4).facets;
    now.values = carried(now.values, now.facets, next, 2, {});
    now.facets = next;
    const std::vector<double> after = covered_areas(facet_areas(now.facets), now.values);
    for (std::size_t k = 0; k < 2; ++k)
      EXPECT_NEAR(after[k] / area_of(next), before[k] / area, 1e-7) << cell;
    for (std::size_t f = 0; f < next.triangles.size(); ++f) {
      EXPECT_GE(now.values[0][f], 0);
      EXPECT_GE(now.values[1][f], 0);
      EXPECT_LE(now.values[0][f] + now.values[1][f], 1 + 1e-6F);
    }
  }
  // And it stays where it was: beyond a coarse facet from the edge as it began.
  const Covered start = wavy(2, false);
  for (std::size_t f = 0; f < now.facets.triangles.size(); ++f) {
    const float x = now.facets.vertices[now.facets.triangles[f][0]].x;
    if (std::abs(x - 33) < 16) continue;
    EXPECT_NEAR(now.values[0][f], start.values[0][f], 0.05) << x;
    EXPECT_NEAR(now.values[1][f], start.values[1][f], 0.05) << x;
  }
}

TEST(Coverages, ThatAreTheSameEverywhereStaySo) {
  Covered known = wavy(2, false);
  known.values[0].assign(known.facets.triangles.size(), 0.375F);
  known.values[1].assign(known.facets.triangles.size(), 0.625F);
  const auto values = carried(known.values, known.facets, wavy(5, true).facets, 2, {});
  for (std::size_t f = 0; f < values[0].size(); ++f) {
    EXPECT_FLOAT_EQ(values[0][f], 0.375F);
    EXPECT_FLOAT_EQ(values[1][f], 0.625F);
  }
}

// The right half goes, and takes what covered it; something new appears far away, and is bare.
// As that of a mask: what is closest is at a distance of nothing but rounding.
TEST(Coverages, StayOnASurfaceThatStandsStill) {
  Covered known = wavy(2, false);
  for (Vec3f& r : known.facets.vertices) r = {7.3F * r.x + 0.1F, 7.3F * r.y + 0.7F, 1200.1F};
  const auto values = carried(known.values, known.facets, known.facets, 40, {});
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t f = 0; f < values[k].size(); ++f)
      EXPECT_NEAR(values[k][f], known.values[k][f], 1e-6);
}

TEST(Coverages, GoWithTheSurfaceThatIsLost) {
  const Covered known = wavy(2, false);
  const auto is_lost = [](const TriMesh& mesh, std::size_t f) {
    const auto [a, b, c] = corners(mesh, f);
    return a.x + b.x + c.x > 3 * 40;
  };
  const TriMesh whole = wavy(1, false).facets;
  TriMesh next{.vertices = whole.vertices, .triangles = {}, .materials = {}};
  for (std::size_t f = 0; f < whole.triangles.size(); ++f)
    if (!is_lost(whole, f)) next.triangles.push_back(whole.triangles[f]);
  const double area = area_of(next);
  const auto first = static_cast<std::uint32_t>(next.vertices.size());
  next.vertices.insert(next.vertices.end(), {{0, 0, 50}, {40, 0, 50}, {0, 40, 50}});
  next.triangles.push_back({first, first + 1, first + 2});

  const auto values = carried(known.values, known.facets, next, 0.3, {});
  const std::vector<double> areas = facet_areas(known.facets);
  const std::vector<double> found = covered_areas(facet_areas(next), values);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(values[k].back(), 0);
    double left = 0;
    double covered = 0;
    for (std::size_t f = 0; f < areas.size(); ++f) {
      if (is_lost(known.facets, f)) continue;
      left += areas[f];
      covered += areas[f] * static_cast<double>(known.values[k][f]);
    }
    EXPECT_NEAR(found[k] / area, covered / left, 1e-6) << k;
  }
}

// Also where the next one acts at once.
TEST(Coverages, EndWithTheStepThatMadeThem) {
  const std::string etch = "[[step]]\nmodel = \"sf6_o2\"\nduration = \"1 s\"\n";
  for (const std::string next :
       {"model = \"isotropic\"\nduration = \"1 s\"\netch_rate = \"1 nm/s\"\n",
        "model = \"conformal\"\nthickness = \"30 nm\"\nmaterial = \"SiO2\"\n"}) {
    const Recipe recipe = read_text(flat_wafer + etch + "[[step]]\n" + next);
    State state = start_state(recipe.domain.frame, recipe.start);
    while (state.step == 0) advance(state, recipe, survey(state, recipe), 1e9);
    EXPECT_EQ(state.coverages.names.size(), 2U);
    begin_step(state, recipe.steps);
    advance(state, recipe, survey(state, recipe), 1e9);
    EXPECT_TRUE(state.coverages.names.empty());
  }
}

class CoveragesOfRuns : public Program {
 protected:
  Outcome run(const std::string& more) const {
    write("hole.toml", small_hole);
    return scarp("run " + path("hole.toml") + " --quiet " + more);
  }
};

TEST_F(CoveragesOfRuns, AreWrittenAndCounted) {
  ASSERT_EQ(run("-o " + path("r")).exit_code, 0);
  const std::string surface = read_file(folder_ / "r" / "surface_0001.vtp");
  EXPECT_THAT(surface, AllOf(HasSubstr("Name=\"coverage_F\""), HasSubstr("Name=\"coverage_O\"")));
  const auto columns = columns_of(folder_ / "r" / "metrics.csv");
  for (const std::string& count : columns.at("coverage_iterations")) EXPECT_GT(std::stoi(count), 0);
}

// Of the time step before, as far as the hole goes on growing: the part of the surface that each
// takes up is kept to the digits that are written.
TEST_F(CoveragesOfRuns, AreTakenOverWhole) {
  const std::string around =
      "--set 'domain.mode=\"axisymmetric\"' --set 'domain.extent=[\"800 nm\"]' --set "
      "'geometry[1].center=[\"0 nm\", \"0 nm\"]' --set "
      "'geometry[2].opening.center=[\"0 nm\", \"0 nm\"]' ";
  for (const std::string& mode : {std::string(), around}) {
    ASSERT_EQ(run(mode + "-o " + path("r")).exit_code, 0);
    auto columns = columns_of(folder_ / "r" / "metrics.csv");
    const auto value = [&](const char* column, std::size_t row) {
      return std::stod(columns.at(column).at(row));
    };
    const std::size_t rows = columns.at("time_s").size();
    ASSERT_GT(rows, 3U);
    for (const auto& [covered, carried] :
         {std::pair{"covered_F_nm2", "carried_F_nm2"}, {"covered_O_nm2", "carried_O_nm2"}}) {
      EXPECT_EQ(columns.at(carried).front(), "");
      for (std::size_t row = 1; row < rows; ++row) {
        const double before = value(covered, row - 1) / value("surface_area_nm2", row - 1);
        EXPECT_NEAR(value(carried, row) / value("surface_area_nm2", row), before, 1e-6 * before)
            << mode << carried << ' ' << row;
        EXPECT_GT(before, 0);
      }
    }
    fs::remove_all(folder_ / "r");
  }
}

TEST_F(CoveragesOfRuns, AResumedRunGivesTheSameBits) {
  ASSERT_EQ(run("-o " + path("whole")).exit_code, 0);
  fs::copy(folder_ / "whole", folder_ / "cut", fs::copy_options::recursive);
  for (const char* late : {"summary.json", "state_0003.vdb", "state_0004.vdb"})
    fs::remove(folder_ / "cut" / late);
  ASSERT_EQ(run("--resume -o " + path("cut")).exit_code, 0);
  expect_same_bits("whole", "cut");
}

TEST_F(CoveragesOfRuns, AMissOfTheToleranceIsAWarningWithThePlace) {
  const Outcome missed =
      run("--set flux.coverage_iterations=1 --set step[0].duration='\"0.1 s\"' -o " + path("r"));
  EXPECT_EQ(missed.exit_code, 0);
  EXPECT_THAT(missed.messages,
              AllOf(HasSubstr("warning: step \"sf6_o2\", t = 0 s: the coverages of model sf6_o2 "
                              "are uncertain by"),
                    HasSubstr("after 1 iterations, most at ("), HasSubstr("material "),
                    HasSubstr("raise flux.coverage_iterations")));
  EXPECT_EQ(missed.messages.find("are uncertain by"),
            missed.messages.rfind("are uncertain by"));  // once
}

TEST_F(CoveragesOfRuns, ACheckpointWhoseCoveragesAreNotWholeIsPassedOver) {
  ASSERT_EQ(run("-o " + path("r")).exit_code, 0);
  const fs::path file = folder_ / "r" / "state_0004.vdb";
  const std::string whole = read_checkpoint(file).notes.at("coverages");
  for (const std::string& bytes :
       {std::string(), std::string("F"), whole.substr(0, whole.size() - 1), whole + 'x',
        "another\n" + whole}) {
    fs::remove(folder_ / "r" / "summary.json");
    Checkpoint checkpoint = read_checkpoint(file);
    checkpoint.notes["coverages"] = bytes;
    write_checkpoint(file, checkpoint.layers, checkpoint.notes);
    const Outcome resumed = run("--resume -o " + path("r"));
    EXPECT_EQ(resumed.exit_code, 0);
    EXPECT_THAT(resumed.messages, AllOf(HasSubstr("the entry coverages is not complete"),
                                        HasSubstr("earlier checkpoint")));
  }
}

// Another coverage, another bit of the state.
TEST(StateHash, CountsCoverages) {
  const Recipe recipe = read_text(small_hole);
  State state = start_state(recipe.domain.frame, recipe.start);
  const std::string without = state_hash(state, recipe.materials);
  state.mesh.facets = {
      .vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, .triangles = {{0, 1, 2}}, .materials = {}};
  state.coverages = {.names = {"F"}, .values = {{0.5F}}};
  const std::string with = state_hash(state, recipe.materials);
  state.coverages.values = {{std::nextafter(0.5F, 1.0F)}};
  EXPECT_NE(with, without);
  EXPECT_NE(state_hash(state, recipe.materials), with);
}

}  // namespace
}  // namespace scarp

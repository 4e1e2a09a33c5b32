#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "apps/report/comparison.h"
#include "apps/run/run_record.h"
#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

class CompareCommand : public Program {
 protected:
  /// What small_trench runs.
  Outcome compare_trench(const std::string& folder, const std::string& more = "") const {
    return scarp("compare " + small_trench("-o " + path(folder) + " --json " + more));
  }

  /// A trench that a film of the given thickness lines at once.
  void run_film(const std::string& folder, const std::string& thickness,
                const std::string& domain = "mode = \"2d\"\nextent = [\"600 nm\"]") const {
    write("film.toml", "[domain]\n" + domain + R"(
spacing = "10 nm"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "300 nm"
depth = "400 nm"
[[step]]
model = "conformal"
material = "SiO2"
thickness = ")" + thickness +
                           "\"\n");
    const Outcome run = scarp("run " + path("film.toml") + " -o " + path(folder) + " --quiet");
    ASSERT_EQ(run.exit_code, 0) << run.messages;
  }

  static const nlohmann::json& value(const nlohmann::json& found, const std::string& name) {
    const nlohmann::json* last = nullptr;
    for (const nlohmann::json& each : found["metrology"])
      if (each["name"] == name) last = &each;
    EXPECT_NE(last, nullptr) << name;
    return *last;
  }
};

TEST_F(CompareCommand, SimplifiedTrenchIsAsTheFullOne) {
  const Outcome outcome = compare_trench("out", "--seeds 2");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  const nlohmann::json found = json_of(outcome);
  EXPECT_EQ(found, nlohmann::json::parse(read_file(path("out/compare.json"))));
  EXPECT_TRUE(found["passed"]);
  EXPECT_GT(found["speedup"], 0);
  EXPECT_GT(found["time_to_equal_error"]["second_s"], 0);
  EXPECT_EQ(found["distance"].size(), 4U);  // outputs
  EXPECT_GT(found["distance"][3]["forward"]["mean"], 0);
  EXPECT_LT(found["distance"][3]["forward"]["mean"], 0.2);
  EXPECT_LT(found["cost"]["second"]["facets"],
            0.5 * found["cost"]["first"]["facets"].get<double>());
  EXPECT_EQ(found["cost"]["first"]["facets"], found["cost"]["first"]["facets_full"]);
  EXPECT_EQ(value(found, "trench 1 depth_nm")["first"]["runs"], 2);
  EXPECT_GT(value(found, "trench 1 SiO2_wall_nm")["first"]["spread"], 0);
  EXPECT_EQ(value(found, "trench 1 SiO2_step_coverage")["verdict"], "within");
  // Two seeds are one distance, whose spread nobody knows.
  EXPECT_TRUE(found["time_to_equal_error"]["speedup_std_error"].is_null());
  ASSERT_FALSE(found["flux"].empty());
  EXPECT_LT(found["flux"].back()["rms_difference"], 0.2);

  const std::string page = read_file(path("out/report.html"));
  EXPECT_THAT(page, HasSubstr("within the tolerances"));
  EXPECT_THAT(page, HasSubstr("<svg"));
  // Needs no network; the script names the namespace of XHTML.
  EXPECT_THAT(page.substr(0, page.rfind("<script>")), Not(HasSubstr("http")));
  const Outcome again = scarp("report " + path("out") + " -o " + path("again.html"));
  EXPECT_EQ(again.exit_code, 0) << again.messages;
  EXPECT_EQ(read_file(path("again.html")), page);
}

// Prescribed speeds: nothing but rounding lies between them.
TEST_F(CompareCommand, ACrossSectionIsAsASliceThatIsCutFromIt) {
  run_film("section", "60 nm");
  run_film("slice", "60 nm", "extent = [\"600 nm\", \"70 nm\"]");
  for (const auto& [first, second] : {std::pair("section", "slice"), {"slice", "section"}}) {
    const Outcome outcome =
        scarp("compare " + path(first) + " " + path(second) + " --json -o " + path("out"));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
    const nlohmann::json found = json_of(outcome);
    for (const char* way : {"forward", "reverse"})
      EXPECT_LT(found["distance"].back()[way]["max"], 1e-4) << way;
    const nlohmann::json& volume = value(found, "SiO2_volume_nm3");
    EXPECT_GT(volume["first"]["mean"], 0);
    EXPECT_NEAR(volume["difference"], 0, 1e-6 * volume["first"]["mean"].get<double>());
  }
  run_film("other", "60 nm", "extent = [\"620 nm\", \"70 nm\"]");
  const Outcome other = scarp("compare " + path("section") + " " + path("other"));
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.messages, HasSubstr("other: has another extent"));
}

TEST_F(CompareCommand, ARecipeInTwoDimensionsIsAsInThree) {
  const Outcome outcome = compare_trench("out", "--seeds 2 --modes 3d,2d");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  const nlohmann::json found = json_of(outcome);
  EXPECT_EQ(found["first"], "3d");
  EXPECT_EQ(found["second"], "2d");
  EXPECT_TRUE(fs::exists(path("out/3d_seed_1/summary.json")));
  EXPECT_TRUE(fs::exists(path("out/2d_seed_4/summary.json")));
  EXPECT_GT(found["distance"].back()["forward"]["mean"], 0);
  EXPECT_EQ(value(found, "trench 1 SiO2_step_coverage")["verdict"], "within");
  ASSERT_FALSE(found["flux"].empty());
  EXPECT_LT(found["flux"].back()["rms_difference"], 0.1);
  const std::string page = read_file(path("out/report.html"));
  EXPECT_EQ(scarp("report " + path("out") + " -o " + path("again.html")).exit_code, 0);
  EXPECT_EQ(read_file(path("again.html")), page);

  run_film("film", "60 nm");
  const Outcome film =
      scarp("compare " + path("film.toml") + " --modes 2d,3d --seeds 1 --json -o " + path("films"));
  ASSERT_EQ(film.exit_code, 0) << film.messages;
  EXPECT_EQ(json_of(film)["second"], "3d");
  EXPECT_LT(json_of(film)["distance"].back()["reverse"]["max"], 1e-4);
}

TEST_F(CompareCommand, RunsThatAreThereAreNotMadeAgain) {
  ASSERT_EQ(compare_trench("out", "--seeds 1").exit_code, 0);
  const auto written = fs::last_write_time(path("out/full_seed_1/summary.json"));
  const Outcome again = compare_trench("out", "--seeds 2");
  EXPECT_EQ(again.exit_code, 0) << again.messages;
  EXPECT_EQ(fs::last_write_time(path("out/full_seed_1/summary.json")), written);
  EXPECT_TRUE(fs::exists(path("out/simplified_seed_4/summary.json")));
  // Another recipe in the same folder is another comparison.
  const Outcome other = compare_trench("out", "--seeds 1 --set step[0].sticking=1");
  EXPECT_EQ(other.exit_code, 0) << other.messages;
  EXPECT_NE(fs::last_write_time(path("out/full_seed_1/summary.json")), written);
}

TEST_F(CompareCommand, FacetsThatAreTooLargeFailAndAreNamed) {
  const Outcome outcome = scarp(
      "compare " + small_trench("--seeds 4 --set simplify.l_max=30 --set flux.carry_within=0.02 "
                                "--set flux.target_error=0.01 --set step[0].duration='\"150 s\"' "
                                "--set step[0].sticking=0.6 "
                                "--set output.every='\"0 s\"' -o " +
                                path("out")));
  EXPECT_EQ(outcome.exit_code, 1) << outcome.messages;
  EXPECT_THAT(outcome.out, HasSubstr("moved"));
  EXPECT_THAT(outcome.out, HasSubstr("\n  trench 1 bow_nm at t = "));
  EXPECT_THAT(outcome.out, HasSubstr("allowed"));
  EXPECT_THAT(read_file(path("out/report.html")), HasSubstr("<li class=\"bad\">trench 1 bow_nm"));
}

TEST_F(CompareCommand, TolerancesAreSettable) {
  const Outcome strict =
      compare_trench("out", "--seeds 1 --mean-distance 1e-5 --p99-distance 1e-5");
  EXPECT_EQ(strict.exit_code, 1);
  EXPECT_THAT(json_of(strict)["moved"], Contains(HasSubstr("mean distance at t = 30 s")));
  const Outcome loose = compare_trench("out", "--seeds 1 --mean-distance 5 --p99-distance 5");
  EXPECT_EQ(loose.exit_code, 0);
}

TEST_F(CompareCommand, MethodsAreComparedWithTheFullMesh) {
  const Outcome outcome = compare_trench("out", "--seeds 1 --methods paper,curvature");
  const nlohmann::json found = json_of(outcome);
  ASSERT_EQ(found["methods"].size(), 2U) << outcome.messages;
  EXPECT_EQ(found["second"], "paper");
  EXPECT_NE(found["methods"]["paper"]["cost"]["second"]["facets"],
            found["methods"]["curvature"]["cost"]["second"]["facets"]);
}

TEST_F(CompareCommand, ARunIsAsItself) {
  run_film("a", "40 nm");
  const Outcome outcome =
      scarp("compare " + path("a") + " " + path("a") + " --json -o " + path("out"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  const nlohmann::json found = json_of(outcome);
  for (const nlohmann::json& each : found["distance"]) EXPECT_EQ(each["forward"]["max"], 0);
  for (const nlohmann::json& each : found["metrology"]) EXPECT_EQ(each["difference"], 0);
}

// The copy lacks the last of the outputs at 0, 10, 20 and 30 s.
TEST_F(CompareCommand, RunsThatEndAtDifferentTimesAreComparedAsFarAsBothGo) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("whole"))).exit_code, 0);
  fs::copy(path("whole"), path("short"), fs::copy_options::recursive);
  for (const char* name : {"short/state_0003.vdb", "short/summary.json"})
    ASSERT_TRUE(fs::remove(folder_ / name));
  const Outcome outcome =
      scarp("compare " + path("whole") + ' ' + path("short") + " -o " + path("out"));
  EXPECT_EQ(outcome.exit_code, 1) << outcome.messages;
  const std::string ends =
      path("whole") + " ends at 30 s, " + path("short") + " at 20 s: compared up to 20 s";
  EXPECT_THAT(outcome.messages, HasSubstr("warning: " + ends));
  EXPECT_THAT(outcome.messages, HasSubstr("warning: " + path("short") + ": is not complete"));
  EXPECT_THAT(outcome.messages, Not(HasSubstr(path("whole") + ": is not complete")));
  EXPECT_THAT(outcome.out,
              HasSubstr("within the tolerances up to 20 s, but not compared to the end"));
  EXPECT_THAT(outcome.out, HasSubstr("their ends are at different times"));
  EXPECT_THAT(read_file(path("out/report.html")), HasSubstr(ends));
  const auto found = nlohmann::json::parse(read_file(path("out/compare.json")));
  EXPECT_THAT(found["warnings"], Contains(ends));
  EXPECT_EQ(found["speedup"], nullptr);
  EXPECT_EQ(found["passed"], false);
  ASSERT_EQ(found["distance"].size(), 3U);
  for (const nlohmann::json& each : found["distance"]) EXPECT_EQ(each["forward"]["max"], 0);

  write("contour.csv", "x [um],z [um]\n2,0\n1,0\n1,-3\n-1,-3\n-1,0\n-2,0\n");
  const Outcome contour =
      scarp("compare " + path("short") + ' ' + path("contour.csv") + " -o " + path("out"));
  EXPECT_THAT(contour.messages, HasSubstr("warning: " + path("short") + ": is not complete"));

  const Outcome none = scarp("compare " + path("short") + ' ' + path("whole/state_0003.vdb"));
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.messages, HasSubstr("at 30 s: they have no output at the same time"));
  const Outcome states = scarp("compare " + path("whole/state_0001.vdb") + ' ' +
                               path("whole/state_0002.vdb") + " -o " + path("out"));
  EXPECT_EQ(states.exit_code, 1) << states.messages;
  EXPECT_THAT(states.messages, HasSubstr("state_0001.vdb is at 10 s, "));
  EXPECT_THAT(states.messages, HasSubstr("state_0002.vdb at 20 s: compared at these times"));
}

// A section is as wide as its spacing.
TEST_F(CompareCommand, SectionsOfDifferentSpacingsAreTheSame) {
  write("flat.toml", R"([domain]
spacing = "10 nm"
extent = ["0.4 um"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[step]]
model = "isotropic"
duration = "10 s"
etch_rate = "5 nm/s"
)");
  const std::string run = "run " + path("flat.toml") + " --quiet -o ";
  ASSERT_EQ(scarp(run + path("a")).exit_code, 0);
  ASSERT_EQ(scarp(run + path("b") + " --set 'domain.spacing=\"20 nm\"'").exit_code, 0);
  for (const auto& [first, second] : {std::pair("a", "b"), std::pair("b", "a")}) {
    const Outcome outcome =
        scarp("compare " + path(first) + ' ' + path(second) + " --json -o " + path("out"));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.messages;
    EXPECT_LT(json_of(outcome)["distance"].back()["forward"]["max"], 0.01);
    EXPECT_NEAR(value(json_of(outcome), "Si_volume_nm3")["difference"], 0, 100);
  }
}

// Seeds may see what is hardly deep enough, or not: that is chance, not a change. That three of
// three see it and none of three others is chance once in ten times.
TEST_F(CompareCommand, AnOpeningThatFewSeedsSeeIsNoise) {
  const std::string flat =
      "[domain]\nspacing = \"10 nm\"\nextent = [\"600 nm\"]\nmode = \"2d\"\n"
      "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n";
  const std::string step =
      "[[step]]\nmodel = \"conformal\"\nmaterial = \"SiO2\"\nthickness = \"20 nm\"\n";
  write("flat.toml", flat + step);
  write("trench.toml", flat + "[[geometry]]\nshape = \"trench\"\nwidth = \"300 nm\"\n" +
                           "depth = \"60 nm\"\n" + step);
  for (const char* name : {"flat", "trench"}) {
    const Outcome run =
        scarp("run " + path(std::string(name) + ".toml") + " --quiet -o " + path(name));
    ASSERT_EQ(run.exit_code, 0) << run.messages;
  }
  const RunRecord without = read_run(path("flat"));
  const RunRecord with = read_run(path("trench"));
  const auto verdict = [&](std::size_t count, std::size_t with_it) {
    RunGroup first{.name = "first", .runs = std::vector(count, without)};
    const RunGroup second{.name = "second", .runs = first.runs};
    std::fill_n(first.runs.begin(), with_it, with);
    for (const ComparedValue& each : compare(first, second, {}).values) {
      if (!each.name.ends_with(" depth_nm")) continue;
      EXPECT_EQ(each.first.count, count);
      EXPECT_EQ(each.first.stand_ins, count - with_it);
      EXPECT_EQ(each.second.stand_ins, count);
      return each.verdict;
    }
    return Verdict::none;
  };
  EXPECT_EQ(verdict(3, 1), Verdict::noise);
  EXPECT_EQ(verdict(3, 3), Verdict::noise);
  EXPECT_EQ(verdict(6, 6), Verdict::moved);
}

// At the same depth.
TEST_F(CompareCommand, RunsThatAConditionEndsAreComparedAtTheirEnds) {
  write("etch.toml",
        "[domain]\nspacing = \"20 nm\"\nextent = [\"400 nm\"]\nmode = \"2d\"\n"
        "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
        "[[step]]\nmodel = \"isotropic\"\nduration = \"100 s\"\n"
        "etch_rate = \"10 nm/s\"\nuntil = { depth = \"100 nm\" }\n");
  ASSERT_EQ(scarp("run " + path("etch.toml") + " --quiet -o " + path("a")).exit_code, 0);
  const Outcome faster = scarp("run " + path("etch.toml") + " --quiet -o " + path("b") +
                               " --set step[0].etch_rate='\"20 nm/s\"'");
  ASSERT_EQ(faster.exit_code, 0) << faster.messages;
  const Outcome outcome =
      scarp("compare " + path("a") + ' ' + path("b") + " --json -o " + path("out"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.messages;
  EXPECT_THAT(outcome.messages, HasSubstr("compared at these times"));
  EXPECT_NEAR(json_of(outcome)["distance"].back()["time_s"], 10, 0.1);
}

// Whatever their times are.
TEST_F(CompareCommand, OfGivenRunsNothingIsSaidOfWhatSimplificationSaves) {
  for (const char* name : {"a", "b"})
    ASSERT_EQ(scarp("run " + small_trench(std::string("-o ") + path(name))).exit_code, 0);
  const auto make_slow = [&](const std::string& name) {
    std::string rows = read_file(folder_ / name / "metrics.csv");
    for (std::size_t at = 0; (at = rows.find(",0.0", at)) != std::string::npos;)
      rows.replace(at, 4, ",7.0");
    write(name + "/metrics.csv", rows);
  };
  make_slow("b");
  const Outcome outcome = scarp("compare " + path("a") + ' ' + path("b") + " -o " + path("out"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.messages;
  EXPECT_THAT(outcome.out, HasSubstr("time of "));
  EXPECT_THAT(outcome.out, Not(HasSubstr("pay")));
  EXPECT_EQ(read_file(path("out/report.html")).find("was not worth it"), std::string::npos);
  ASSERT_EQ(
      scarp("run " + small_trench("--set simplify.enabled=false -o " + path("full"))).exit_code, 0);
  EXPECT_THAT(scarp("compare " + path("full") + ' ' + path("b") + " -o " + path("out")).out,
              HasSubstr("b was not worth it here"));
}

// Films of 40 and 43 nm are 0.3 spacings apart everywhere, a trench 6 nm narrower.
TEST_F(CompareCommand, TwoStatesAreAsFarApartAsTheirFilms) {
  run_film("a", "40 nm");
  run_film("b", "43 nm");
  const Outcome outcome = scarp("compare " + path("a/state_0001.vdb") + " " +
                                path("b/state_0001.vdb") + " --json -o " + path("out"));
  EXPECT_EQ(outcome.exit_code, 1) << outcome.messages;
  const nlohmann::json found = json_of(outcome);
  EXPECT_NEAR(found["distance"][0]["forward"]["mean"], 0.3, 0.01);
  EXPECT_NEAR(value(found, "trench 1 middle_cd_nm")["difference"], -6, 0.1);
  EXPECT_EQ(value(found, "trench 1 middle_cd_nm")["verdict"], "moved");
  EXPECT_NEAR(value(found, "trench 1 SiO2_wall_nm")["difference"], 3, 0.1);
  EXPECT_EQ(found["speedup"], nullptr);
}

// From right to left, in um; the trench of the run is 300 nm wide and 400 nm deep.
TEST_F(CompareCommand, TheViewerGetsBothSurfacesWithTheirDistance) {
  const std::string deep = "extent = [\"600 nm\", \"60 nm\"]";
  run_film("a", "40 nm", deep);
  run_film("b", "43 nm", deep);
  scarp("compare " + path("a") + " " + path("b") + " -o " + path("out"));
  const nlohmann::json found = scene_description(read_file(path("out/report.html")));
  ASSERT_EQ(found["panes"].size(), 2U);
  EXPECT_EQ(found["panes"][1]["name"], path("b"));
  for (const nlohmann::json& pane : found["panes"]) {
    ASSERT_EQ(pane["outputs"].size(), 2U);
    for (const nlohmann::json& field : pane["outputs"][1]["fields"]) {
      if (field["name"] != "distance_spacings") continue;
      EXPECT_NEAR(field["low"], 0.3, 0.1);  // what meshes may be off
      EXPECT_NEAR(field["high"], 0.3, 0.1);
    }
  }
  EXPECT_EQ(found["fields"][0]["name"], "distance_spacings");
  EXPECT_EQ(found["fields"][0]["low"], 0);  // before the films
}

TEST_F(CompareCommand, TheReportNamesARunThatIsGone) {
  run_film("a", "40 nm");
  ASSERT_EQ(scarp("compare " + path("a") + " " + path("a") + " -o " + path("out")).exit_code, 0);
  fs::rename(path("a"), path("b"));
  const Outcome outcome = scarp("report " + path("out"));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.messages, HasSubstr("out/../a"));
  write("out/compare.json", "{\"passed\": true}");
  const Outcome old = scarp("report " + path("out"));
  EXPECT_EQ(old.exit_code, 2);
  EXPECT_THAT(old.messages, HasSubstr("make it with scarp compare"));
  write("out/compare.json", "{\"passed\": true");
  const Outcome damaged = scarp("report " + path("out"));
  EXPECT_EQ(damaged.exit_code, 2);
  EXPECT_THAT(damaged.messages, HasSubstr("out/compare.json: is damaged: "));
  EXPECT_THAT(damaged.messages, Not(HasSubstr("json.exception")));
}

TEST_F(CompareCommand, AMeasuredContourIsComparedWithTheProfile) {
  run_film("a", "40 nm");
  const auto compare_with = [&](const std::string& contour) {
    write("contour.csv", "x [um],z [um]\n" + contour);
    return scarp("compare " + path("a/state_0000.vdb") + " " + path("contour.csv") + " --json -o " +
                 path("out"));
  };
  const Outcome same = compare_with("0.3,0\n0.15,0\n0.15,-0.4\n-0.15,-0.4\n-0.15,0\n-0.3,0\n");
  EXPECT_EQ(same.exit_code, 0) << same.messages << same.out;
  EXPECT_LT(json_of(same)["distance"][0]["forward"]["max"], 0.1);
  EXPECT_LT(json_of(same)["distance"][0]["reverse"]["max"], 0.1);
  EXPECT_NEAR(value(json_of(same), "depth_nm")["first"]["mean"], 400, 1e-6);
  EXPECT_NEAR(value(json_of(same), "depth_nm")["difference"], 0, 0.1);

  // Walls of 400 nm, each 10 nm further in, of a length of 1360 nm.
  const Outcome narrower = compare_with("0.3,0\n0.14,0\n0.14,-0.4\n-0.14,-0.4\n-0.14,0\n-0.3,0\n");
  EXPECT_EQ(narrower.exit_code, 1);
  EXPECT_NEAR(json_of(narrower)["distance"][0]["forward"]["mean"], 800.0 / 1360, 0.03);
  EXPECT_NEAR(value(json_of(narrower), "middle_cd_nm")["difference"], 20, 0.1);
  EXPECT_NEAR(value(json_of(narrower), "depth_nm")["difference"], 0, 0.1);
  EXPECT_EQ(value(json_of(narrower), "middle_cd_nm")["verdict"], "moved");

  // What the wafer is too shallow for has a line, and no verdict.
  const Outcome deeper = compare_with("0.3,0\n0.15,0\n0.15,-0.6\n-0.15,-0.6\n-0.15,0\n-0.3,0\n");
  EXPECT_EQ(deeper.exit_code, 1);
  EXPECT_NEAR(value(json_of(deeper), "depth_nm")["difference"], -200, 0.1);
  EXPECT_NEAR(value(json_of(deeper), "bottom_cd_nm")["first"]["mean"], 300, 0.1);
  EXPECT_EQ(value(json_of(deeper), "bottom_cd_nm")["second"]["runs"], 0);
  EXPECT_EQ(value(json_of(deeper), "bottom_cd_nm")["verdict"], "none");
}

TEST_F(CompareCommand, AContourMayBeWiderBelowThanItsFields) {
  const auto run_trench = [&](const std::string& folder, const std::string& film) {
    write("wide.toml", R"([domain]
mode = "2d"
extent = ["800 nm"]
spacing = "10 nm"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "300 nm"
depth = "400 nm"
taper = "-20 deg"
[[step]]
model = "conformal"
material = "SiO2"
thickness = ")" + film + "\"\n");
    ASSERT_EQ(scarp("run " + path("wide.toml") + " -o " + path(folder) + " --quiet").exit_code, 0);
  };
  run_trench("a", "40 nm");
  const auto compare_with = [&](const std::string& state, const std::string& contour) {
    write("contour.csv", "x [nm],z [nm]\n" + contour);
    return scarp("compare " + path(state) + " " + path("contour.csv") + " --json -o " +
                 path("out"));
  };
  // 400 tan 20 deg = 145.59 on either side.
  const Outcome same =
      compare_with("a/state_0000.vdb", "-160,0\n-150,0\n-295.59,-400\n295.59,-400\n150,0\n160,0\n");
  EXPECT_EQ(same.exit_code, 0) << same.messages << same.out;
  EXPECT_EQ(same.messages, "");
  EXPECT_LT(json_of(same)["distance"][0]["reverse"]["max"], 0.3);
  EXPECT_NEAR(value(json_of(same), "depth_nm")["second"]["mean"], 400, 0.5);
  EXPECT_NEAR(value(json_of(same), "top_cd_nm")["second"]["mean"], 329.12, 0.5);
  EXPECT_NEAR(value(json_of(same), "middle_cd_nm")["second"]["mean"], 445.59, 0.5);
  EXPECT_NEAR(value(json_of(same), "bottom_cd_nm")["second"]["mean"], 562.06, 0.5);

  // A film shuts the trench when it is 150 nm thick, and leaves what is further away than that: up
  // from a floor 150 nm higher to the arcs about the edges, which touch at the surface, and walls
  // that go on from them at 70 degrees, 9.05 nm from the middle at 150 sin 20 deg = 51.30 nm.
  run_trench("b", "160 nm");
  const Outcome open = compare_with("b/state_0001.vdb", "-300,160\n0,160\n300,160\n");
  EXPECT_THAT(open.messages, HasSubstr("a void below the contour"));
  EXPECT_THAT(open.messages, HasSubstr("neither depth nor widths are compared"));
  const std::string loop =
      "0,0\n2.21,-25.65\n9.05,-51.3\n81.37,-250\n-81.37,-250\n-9.05,-51.3\n-2.21,-25.65\n0,0\n";
  const Outcome closed = compare_with("b/state_0001.vdb", loop);
  EXPECT_EQ(closed.messages, "");
  EXPECT_NEAR(value(json_of(closed), "depth_nm")["first"]["mean"], 250, 1e-6);
  EXPECT_NEAR(value(json_of(closed), "depth_nm")["second"]["mean"], 250, 5);
  EXPECT_NEAR(value(json_of(closed), "bottom_cd_nm")["second"]["mean"], 144.5, 1);
  EXPECT_NEAR(value(json_of(closed), "middle_cd_nm")["second"]["mean"], 71.75, 1);
  const Outcome missing = compare_with("a/state_0000.vdb", loop);
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.messages, HasSubstr("the wafer has none there"));
  EXPECT_NEAR(value(json_of(missing), "depth_nm")["difference"], -250, 1e-6);
}

TEST_F(CompareCommand, AContourMayLeanPastItsOwnWidth) {
  write("lean.toml", R"([domain]
mode = "2d"
boundary = ["periodic"]
extent = ["1 um"]
spacing = "10 nm"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "resist"
thickness = "20 nm"
opening = { shape = "trench", width = "140 nm", center = "-200 nm" }
[[step]]
model = "directional"
duration = "40 s"
directional_etch_rate = { Si = "10 nm/s", resist = "0 nm/s" }
beam = [{ tilt = "40 deg" }]
)");
  ASSERT_EQ(scarp("run " + path("lean.toml") + " -o " + path("a") + " --quiet").exit_code, 0);
  // The beam comes past the top of the left edge, 20 tan 40 deg = 16.78 to the right of it at the
  // surface, and etches 400 cos 40 deg = 306.42 down, so walls lean by 257.12.
  write("contour.csv",
        "x [nm],z [nm]\n-400,20\n-270,20\n-270,0\n-253.22,0\n3.9,-306.42\n127.12,-306.42\n-130,0\n"
        "-130,20\n100,20\n");
  const Outcome outcome = scarp("compare " + path("a/state_0001.vdb") + " " + path("contour.csv") +
                                " --json -o " + path("out"));
  const nlohmann::json found = json_of(outcome);
  EXPECT_NEAR(value(found, "depth_nm")["second"]["mean"], 326.42, 0.5);
  EXPECT_NEAR(value(found, "middle_cd_nm")["first"]["mean"], 123.22, 1e-6);
  EXPECT_NEAR(value(found, "middle_cd_nm")["second"]["mean"], 123.22, 2);
  // But for the acute corners, which the grid rounds.
  EXPECT_EQ(found["distance"][0]["mean_verdict"], "within");
}

TEST_F(CompareCommand, AnOpeningThatTheWaferLacksIsNotDeep) {
  write("flat.toml",
        "[domain]\nspacing = \"20 nm\"\nextent = [\"600 nm\"]\nmode = \"2d\"\n"
        "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
        "[[step]]\nmodel = \"isotropic\"\nduration = \"1 s\"\nmaterial = \"SiO2\"\n"
        "growth_rate = \"1 nm/s\"\n");
  write("contour.csv", "x [um],z [um]\n0.3,0\n0.15,0\n0.15,-0.4\n-0.15,-0.4\n-0.15,0\n-0.3,0\n");
  ASSERT_EQ(scarp("run " + path("flat.toml") + " --quiet -o " + path("flat")).exit_code, 0);
  const Outcome outcome = scarp("compare " + path("flat/state_0000.vdb") + " " +
                                path("contour.csv") + " --json -o " + path("out"));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NEAR(value(json_of(outcome), "depth_nm")["difference"], -400, 1e-6);
  EXPECT_EQ(value(json_of(outcome), "depth_nm")["verdict"], "moved");
  EXPECT_EQ(value(json_of(outcome), "top_cd_nm")["second"]["runs"], 0);
}

TEST_F(CompareCommand, SaysWhatItCannotCompare) {
  run_film("a", "40 nm");
  const Outcome flat = scarp("compare " + path("film.toml"));
  EXPECT_EQ(flat.exit_code, 2);
  EXPECT_THAT(flat.messages, HasSubstr("in two dimensions the mesh is not simplified"));
  EXPECT_THAT(flat.messages, HasSubstr("use --modes 3d,2d to compare"));
  write("hole.toml",
        "[domain]\nspacing = \"20 nm\"\nextent = [\"600 nm\", \"600 nm\"]\n"
        "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
        "[[geometry]]\nshape = \"hole\"\ndiameter = \"200 nm\"\ndepth = \"200 nm\"\n"
        "[[step]]\nmodel = \"isotropic\"\nduration = \"1 s\"\nmaterial = \"SiO2\"\n"
        "growth_rate = \"1 nm/s\"\n");
  const Outcome hole = scarp("compare " + path("hole.toml") + " --modes 3d,2d -o " + path("hole"));
  EXPECT_EQ(hole.exit_code, 2);
  EXPECT_THAT(hole.messages, HasSubstr("hole.toml:7"));
  EXPECT_FALSE(fs::exists(path("hole")));
  for (const char* wrong : {"--modes 2d", "--modes 2d,2d", "--modes 3d,2d --methods paper"})
    EXPECT_EQ(scarp("compare " + path("hole.toml") + ' ' + wrong).exit_code, 2) << wrong;
  EXPECT_THAT(scarp("compare " + path("hole.toml") + " --modes 3d,round").messages,
              HasSubstr("\"3d,round\" is none of 3d,2d | 2d,3d | 3d,axisymmetric"));
  const Outcome given = scarp("compare " + path("a") + " " + path("a") + " --modes 3d,2d");
  EXPECT_EQ(given.exit_code, 2);
  EXPECT_THAT(given.messages, HasSubstr("--modes compares the runs of a recipe; leave out"));
  const Outcome alone = scarp("compare " + path("a"));
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_THAT(alone.messages, HasSubstr("name what it is compared with"));
  fs::create_directory(folder_ / "own");
  write("own/compare.json", "mine");
  const Outcome own = scarp("compare " + path("a") + " " + path("a") + " -o " + path("own"));
  EXPECT_EQ(own.exit_code, 2);
  EXPECT_THAT(own.messages, HasSubstr("own/compare.json: was not written by a comparison"));
  EXPECT_EQ(read_file(folder_ / "own" / "compare.json"), "mine");
  write("short.csv", "x [um],z [um]\n0,0\n1,0\n");
  EXPECT_EQ(scarp("compare " + path("a") + " " + path("short.csv")).exit_code, 2);
  write("beside.csv", "x [um],z [um]\n0,0\n1,0\n2,0\n");
  const Outcome beside = scarp("compare " + path("a") + " " + path("beside.csv"));
  EXPECT_EQ(beside.exit_code, 2);
  EXPECT_THAT(beside.messages, HasSubstr("the wafer from -300 to 300 nm"));
}

}  // namespace
}  // namespace scarp

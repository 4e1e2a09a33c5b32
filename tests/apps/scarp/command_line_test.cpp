// The program as a user calls it: options and exit codes, and the commands that only tell or show.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "core/system/folder_lock.h"
#include "tests/apps/program.h"
#include "tests/sanitizers.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

using CommandLine = Program;

TEST_F(CommandLine, AnUnknownOptionIsExitTwo) {
  EXPECT_EQ(scarp("run --fast").exit_code, 2);
  EXPECT_EQ(scarp("").exit_code, 2);
  EXPECT_EQ(scarp("--help").exit_code, 0);
}

TEST_F(CommandLine, AnOptionOutOfRangeIsNamedWithWhatIsAllowed) {
  write("a.obj", pyramid);
  const std::string flux = "flux " + path("a.obj") + " --rays 100 ";
  const std::string simplify = "simplify " + path("a.obj") + " " + path("b.ply");
  const std::map<std::string, std::string> messages{
      {flux + "--sticking 2", "--sticking: \"2\" is not a number in [0, 1]\n"},
      {flux + "--threads abc", "--threads: \"abc\" is not a whole number above 0\n"},
      {flux + "--threads 0", "--threads: \"0\" is not a whole number above 0\n"},
      {flux + "--max-rays 1.5", "--max-rays: \"1.5\" is not a whole number above 0\n"},
      {flux + "--engine 1", "--engine: \"1\" is none of auto, forward, gather\n"},
      {flux + "--boundary open", "--boundary: \"open\" is none of periodic, reflective\n"},
      {simplify + " --remove 1.5", "--remove: \"1.5\" is not a number in [0, 1)\n"}};
  for (const auto& [line, message] : messages) {
    const Outcome outcome = scarp(line);
    EXPECT_EQ(outcome.exit_code, 2) << line;
    EXPECT_THAT(outcome.messages, HasSubstr(message)) << line;
  }
  EXPECT_EQ(scarp(flux + "--engine forward --boundary periodic --threads 1e0").exit_code, 0);
}

// The options of a command that take a number, as its help has them.
std::vector<std::string> numeric_options(const std::string& help) {
  std::vector<std::string> options;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t name = line.find("--");
    const std::size_t type = line.find(" FLOAT");
    if (name == std::string::npos || type == std::string::npos || type < name) continue;
    options.push_back(line.substr(name, line.find_first_of(" ,", name) - name));
  }
  return options;
}

TEST_F(CommandLine, EveryNumberThatIsNoneOrOverflowsIsRefusedByName) {
  const std::map<std::string, std::string> commands{{"simplify", "a.obj b.ply"},
                                                    {"flux", "a.obj"},
                                                    {"distance", "a.obj b.obj"},
                                                    {"measure", "a"},
                                                    {"section", "a"},
                                                    {"compare", "a b"},
                                                    {"render", "a"},
                                                    {"volume", "a"},
                                                    {"run", "a.toml"},
                                                    {"check", "a.toml"},
                                                    {"preview", "a.toml"},
                                                    {"baseline", "check a"}};
  std::size_t count = 0;
  for (const auto& [command, arguments] : commands) {
    for (const std::string& option : numeric_options(scarp(command + " --help").out)) {
      for (const char* const value : {"nan", "inf", "-inf", "1e308", "-1e308", "1e999"}) {
        const Outcome outcome = scarp(command + ' ' + arguments + ' ' + option + '=' + value);
        EXPECT_EQ(outcome.exit_code, 2) << command << option << value;
        EXPECT_THAT(outcome.messages, HasSubstr(option)) << command << value;
      }
      ++count;
    }
  }
  EXPECT_GT(count, 15U);
}

TEST_F(CommandLine, AnUnknownCommandIsNamedWithTheKnownOnes) {
  const Outcome outcome = scarp("simplfy a.obj b.ply");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.messages,
              AllOf(HasSubstr("\"simplfy\" is not a command (did you mean simplify?)"),
                    HasSubstr("run, check, ")));
}

TEST_F(CommandLine, AnUnknownOptionIsNamedWithTheOneThatWasMeant) {
  const std::map<std::string, std::string> messages{
      {"run r.toml --thraeds 2", "--thraeds is not an option of run (did you mean --threads?)\n"},
      {"run --thraeds 2 r.toml", "--thraeds is not an option of run (did you mean --threads?)\n"},
      {"run r.toml --memory_limit=8GB", "(did you mean --memory-limit?)\n"},
      {"flux --ray 100", "--ray is not an option of flux (did you mean --rays?)\n"},
      {"check r.toml --fast", "--fast is not an option of check\n"},
      {"--threads 2 run r.toml", "--threads stands before the command: write scarp COMMAND"}};
  for (const auto& [line, message] : messages) {
    const Outcome outcome = scarp(line);
    EXPECT_EQ(outcome.exit_code, 2) << line;
    EXPECT_THAT(outcome.messages, HasSubstr(message)) << line;
  }
}

TEST_F(CommandLine, AWarningThatNobodyReadsEndsNoCommand) {
  write("a.obj", pyramid);
  const std::string warns = "flux " + path("a.obj") + " --target-error 1e-6 --max-rays 100";
  EXPECT_THAT(scarp(warns).messages, HasSubstr("warning: the error"));
  write("r.toml", R"(
[domain]
mode = "2d"
spacing = "10 nm"
extent = ["100 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "20 nm"
depth = "100 nm"
[[step]]
model = "isotropic"
duration = "1 s"
etch_rate = "1 nm/s"
)");
  EXPECT_THAT(scarp("check " + path("r.toml")).messages, HasSubstr("warning: "));
  for (const std::string& command : {warns, "check " + path("r.toml")}) {
    const std::string line = std::string(SCARP_BINARY) + ' ' + command + " >" + path("out");
    EXPECT_EQ(WEXITSTATUS(std::system((line + " 2>/dev/full").c_str())), 0) << command;
    EXPECT_EQ(WEXITSTATUS(std::system((line + " 2>&-").c_str())), 0) << command;
  }
}

// From limits with which no library is loaded to those that are enough.
TEST_F(CommandLine, AMachineThatGivesNoThreadsIsTold) {
#ifdef SCARP_UNDER_ASAN
  GTEST_SKIP() << "the sanitizer takes more address space than any limit gives";
#endif
  write("a.obj", pyramid);
  int told = 0;
  for (int limit = 60'000; limit <= 160'000; limit += 5'000) {
    const std::string line = "ulimit -v " + std::to_string(limit) + "; " + SCARP_BINARY + " flux " +
                             path("a.obj") + " --threads 4 >" + path("out") + " 2>" +
                             path("messages");
    const int code = WEXITSTATUS(std::system(("sh -c '" + line + "'").c_str()));
    const std::string messages = read_file(folder_ / "messages");
    // 127: of the loader.
    EXPECT_THAT(code, AnyOf(0, 3, 127)) << limit << messages;
    told += code == 3 && messages.find(
                             "gives no more threads: raise the limit on memory "
                             "(ulimit -v)") != std::string::npos;
  }
  EXPECT_GT(told, 0);
}

TEST_F(CommandLine, QuietKeepsResults) {
  write("a.obj", pyramid);
  EXPECT_THAT(scarp("flux " + path("a.obj") + " --rays 100 --quiet").out, HasSubstr("absorbed"));
  EXPECT_THAT(scarp("simplify " + path("a.obj") + " " + path("b.ply") + " --quiet").out,
              HasSubstr("vertices_out"));
  EXPECT_THAT(scarp("check " + small_trench()).out, HasSubstr("# Cost"));
  EXPECT_THAT(scarp("preview " + small_trench("-o " + path("p"))).out, HasSubstr("preview.svg"));
  EXPECT_EQ(scarp("run " + small_trench("-o " + path("r"))).out, "");
}

TEST_F(CommandLine, AResultThatCannotBePrintedIsExitThree) {
  EXPECT_EQ(scarp("models >/dev/full").exit_code, 3);
  EXPECT_EQ(scarp("run --help >/dev/full").exit_code, 3);
  EXPECT_EQ(scarp("--version >/dev/full").exit_code, 3);
  EXPECT_EQ(scarp("models --json >/dev/full").exit_code, 3);
}

TEST_F(CommandLine, AFileThatOpensButCannotBeReadIsExitTwo) {
  fs::create_symlink("/proc/self/mem", path("mem.obj"));
  for (const std::string& command : {std::string("check /proc/self/mem"),
                                     "check " + folder_.string(), "flux " + path("mem.obj")}) {
    const Outcome outcome = scarp(command);
    EXPECT_EQ(outcome.exit_code, 2) << command;
    EXPECT_THAT(outcome.messages, HasSubstr("cannot be read: ")) << command;
  }
}

TEST_F(CommandLine, ModelsPrintsAPage) {
  const Outcome page = scarp("models single_particle");
  EXPECT_EQ(page.exit_code, 0);
  EXPECT_THAT(page.out, AllOf(HasSubstr("sticking"), HasSubstr("growth_rate")));
  EXPECT_EQ(scarp("models no_such_model").exit_code, 2);
}

TEST_F(CommandLine, ModelsWithoutANamePrintsAllParameters) {
  EXPECT_THAT(scarp("models").out, AllOf(HasSubstr("beam.tilt"), HasSubstr("source_power"),
                                         HasSubstr("Limits: "), HasSubstr("Source: ")));
  const auto models = json_of(scarp("models --json"));
  for (const auto& parameter : models["single_particle"]["parameters"]) {
    const bool is_rate = parameter["unit"] == "nm/s";
    EXPECT_EQ(parameter["by_material"], is_rate || parameter["name"] == "sticking");
  }
  EXPECT_EQ(models["multi_particle"]["parameters"][0]["name"], "rate");
  EXPECT_EQ(models["multi_particle"]["parameters"][0]["by_material"], true);
}

TEST_F(CommandLine, CheckPrintsTheRecipeThatIsRun) {
  const Outcome check = scarp("check " + small_trench());
  ASSERT_EQ(check.exit_code, 0) << check.messages;
  write("resolved.toml", check.out);
  EXPECT_EQ(scarp("check " + path("resolved.toml") + " --quiet").exit_code, 0);
}

TEST_F(CommandLine, PreviewTellsOfLooseSolidAndOfVoidsInTheStartGeometry) {
  // Resist whose foot is cut away, itself cut in two; a film closes the re-entrant trench below.
  write("loose.toml", R"(
[domain]
mode = "2d"
spacing = "10 nm"
extent = ["400 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "layer"
material = "Cu"
thickness = "100 nm"
[[geometry]]
shape = "mask"
material = "resist"
thickness = "50 nm"
resist = { shape = "trench", width = "80 nm" }
[[geometry]]
shape = "trench"
width = "300 nm"
depth = "100 nm"
through = ["Cu"]
[[geometry]]
shape = "trench"
width = "60 nm"
depth = "200 nm"
depth_from = "Si"
taper = "-10 deg"
[[step]]
model = "conformal"
thickness = "40 nm"
material = "SiO2"
[[step]]
model = "isotropic"
duration = "2 s"
etch_rate = "1 nm/s"
)");
  const Outcome outcome = scarp("preview " + path("loose.toml") + " -o " + path("out"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  EXPECT_THAT(outcome.messages, HasSubstr("warning: the start geometry has solid that is not "
                                          "connected to the wafer: 2 pieces of 0.0"));
  EXPECT_THAT(outcome.messages, HasSubstr("1 void closed from the start\n  0.0"));
  const nlohmann::json result =
      json_of(scarp("preview --json " + path("loose.toml") + " -o " + path("out")));
  EXPECT_EQ(result["islands_removed"]["count"], 2);
  EXPECT_EQ(result["void_count"], 1);
  EXPECT_GT(result["void_volume_nm3"], 0);
}

TEST_F(CommandLine, PreviewWritesTheStartGeometryAndLeavesARunAlone) {
  fs::create_directories(folder_ / "out");
  write("out/metrics.csv", "kept");
  const Outcome outcome = scarp("preview " + small_trench("--json -o " + path("out")));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  EXPECT_EQ(files("out"), (std::set<std::string>{".lock", "metrics.csv", "preview.csv",
                                                 "preview.svg", "preview.vtp"}));
  const nlohmann::json result = json_of(outcome);
  EXPECT_NEAR(result["lowest_nm"], -8000, 1);
  EXPECT_NEAR(result["highest_nm"], 0, 1);
  ASSERT_EQ(result["layers"].size(), 1U);
  EXPECT_EQ(result["layers"][0]["material"], "Si");
  EXPECT_NEAR(result["layers"][0]["volume_nm3"], -4000.0 * 8000 * 2000, 0.01 * 6.4e10);
}

TEST_F(CommandLine, PreviewReplacesPreviewsAlone) {
  const std::string command = "preview " + small_trench("-o " + path("out"));
  for (const char* name : {"preview.vtp", "preview.csv", "preview.svg"}) {
    fs::create_directories(folder_ / "out");
    write(std::string("out/") + name, "mine");
    const Outcome refused = scarp(command);
    EXPECT_EQ(refused.exit_code, 2) << name;
    EXPECT_THAT(refused.messages,
                AllOf(HasSubstr(std::string("out/") + name + ": was not written by a preview"),
                      HasSubstr("-o")));
    EXPECT_EQ(read_file(folder_ / "out" / name), "mine");
    fs::remove_all(folder_ / "out");
  }
  ASSERT_EQ(scarp(command).exit_code, 0);
  write("out/preview.vtp", "from a preview before");
  EXPECT_EQ(scarp(command).exit_code, 0);
  EXPECT_NE(read_file(folder_ / "out" / "preview.vtp"), "from a preview before");
}

TEST_F(CommandLine, FoldersAreWrittenByOneCommandAtATime) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  const FolderLock held(folder_ / "out");
  for (const std::string& command :
       {"preview " + small_trench("-o " + path("out")), "run " + small_trench("-o " + path("out")),
        "compare " + small_trench("-o " + path("out")),
        "compare " + path("r") + ' ' + path("r") + " -o " + path("out")}) {
    const Outcome refused = scarp(command);
    EXPECT_EQ(refused.exit_code, 2) << command;
    EXPECT_THAT(refused.messages, HasSubstr("another scarp is writing here")) << command;
  }
  EXPECT_EQ(files("out"), (std::set<std::string>{".lock"}));
}

// The name of a file may hold anything; no line of it looks like one of ours.
TEST_F(CommandLine, NamesOfFilesWithLineEndsAreShownOnOneLine) {
  const std::string name = "a\nwarning: forged\t\x1b[31m";
  const auto quoted = [&](const std::string& end) { return '\'' + path(name + end) + "' "; };
  write(name + ".obj", pyramid);
  write(name + ".toml",
        read_file(std::string(SCARP_SOURCE_DIR) + "/configs/trench_deposition.toml"));
  const std::string small =
      "--set domain.spacing='\"0.4 um\"' --set domain.extent='[\"10 um\", \"2 um\"]' "
      "--set flux.rays=1000 --set step[0].duration='\"1 s\"' --set output.every='\"1 s\"' ";
  const std::vector<std::string> lines{
      "run " + quoted(".toml") + small + "-o " + quoted(""),
      "run " + quoted(".toml") + small + "--resume -o " + quoted(""),
      "run " + quoted(".toml") + small + "-o " + quoted("/recipe.toml"),
      "check " + quoted(".toml") + small,
      "check " + quoted(".toml") + "--set " + quoted("=1"),
      "preview " + quoted(".toml") + small + "-o " + quoted("p"),
      "measure " + quoted(""),
      "section " + quoted("") + "-o " + quoted("s"),
      "render " + quoted("") + "-o " + quoted(".png"),
      "render " + quoted("") + "-o " + quoted(".jpg"),
      "volume " + quoted("") + "-o " + quoted(".stl"),
      "report " + quoted(""),
      "compare " + quoted("") + quoted("") + "-o " + quoted("c"),
      "baseline check " + quoted(""),
      "simplify " + quoted(".obj") + quoted("b.obj") + "--vertices 4",
      "distance " + quoted(".obj") + quoted(".obj") + "-o " + quoted("d.vtp"),
      "flux " + quoted(".obj") + "--rays 1000 -o " + quoted("f.csv"),
      "models " + quoted(""),
      quoted(""),
      "run " + quoted(".toml") + quoted("")};
  for (const std::string& line : lines) {
    const Outcome outcome = scarp(line);
    EXPECT_THAT(outcome.messages + outcome.out, Not(HasSubstr("\nwarning: forged"))) << line;
    EXPECT_THAT(outcome.messages + outcome.out, Not(HasSubstr("\t\\x1b"))) << line;
  }
  for (const char* command : {"run", "check", "preview", "measure", "section", "render", "volume",
                              "report", "simplify", "distance", "flux"}) {
    const Outcome missing =
        scarp(std::string(command) + ' ' + quoted("none.toml") +
              (std::string(command) == "distance" || std::string(command) == "simplify"
                   ? quoted("none.obj")
                   : ""));
    EXPECT_EQ(missing.exit_code, 2) << command;
    EXPECT_THAT(missing.messages, HasSubstr("/a\\nwarning: forged\\t\\x1b[31mnone"));
  }
}

TEST_F(CommandLine, DistanceOfAMeshToItselfIsZero) {
  write("a.obj", pyramid);
  const Outcome distance = scarp("distance " + path("a.obj") + " " + path("a.obj") + " --json");
  ASSERT_EQ(distance.exit_code, 0) << distance.messages;
  EXPECT_EQ(json_of(distance)["symmetric_max"], 0);
  EXPECT_EQ(json_of(distance)["forward"]["p99"], 0);
}

}  // namespace
}  // namespace scarp

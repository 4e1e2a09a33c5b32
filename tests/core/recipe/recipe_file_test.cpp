// RecipeFile of core/recipe/recipe_table.h: files, overrides, and the resolved recipe.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>

#include "core/error.h"
#include "core/recipe/recipe_table.h"
#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

std::string message(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

std::string override_message(const std::string& change) {
  return message([&] {
    const RecipeFile file({"[domain]\nspacing = \"1 nm\"\n[[step]]\nduration = \"1 s\"\n", "r.toml",
                           std::vector<std::string>{change}});
    file.root().table("domain").length("spacing");
    for (const RecipeTable& step : file.root().tables("step"))
      step.time("duration", {.minimum = 0});
    file.finish();
  });
}

TEST(RecipeFile, SaysWhereTheSyntaxIsWrong) {
  EXPECT_THAT(message([] {
                RecipeFile({"a = 1\nb = = 2\n", "r.toml"});
              }),
              testing::StartsWith("r.toml:2:5: "));
  EXPECT_THAT(message([] {
                RecipeFile({"a = 1\na = 2\n", "r.toml"});
              }),
              testing::StartsWith("r.toml:2:"));
  EXPECT_THAT(message([] {
                RecipeFile({"a = \"\xff\xfe\"\n", "r.toml"});
              }),
              testing::StartsWith("r.toml:1:"));
}

TEST(RecipeFile, RefusesWhatIsEmptyOrCannotBeRead) {
  EXPECT_EQ(message([] {
              RecipeFile({"\n# nothing\n", "r.toml"});
            }),
            "r.toml: the recipe is empty; start from one in configs/");
  EXPECT_EQ(message([] { RecipeFile(recipe_in("/none/r.toml")); }),
            "/none/r.toml: cannot be read: No such file or directory");
  EXPECT_EQ(message([] { RecipeFile(recipe_in(fs::temp_directory_path())); }),
            fs::temp_directory_path().string() +
                ": cannot be read: it is a folder; give the name of a file");
  const TemporaryFolder folder;
  const fs::path empty = folder / "empty.toml";
  std::ofstream(empty).close();
  EXPECT_EQ(message([&] { RecipeFile(recipe_in(empty)); }),
            empty.string() + ": the recipe is empty; start from one in configs/");
}

/// Whoever runs the tests as root may read anything, so the child process gives that up first.
[[noreturn]] void read_without_permission(const fs::path& path) {
  if (geteuid() == 0 && seteuid(65534) != 0) std::_Exit(3);
  std::fputs(message([&] { RecipeFile(recipe_in(path)); }).c_str(), stderr);
  std::_Exit(2);
}

TEST(RecipeFile, SaysThatPermissionIsMissing) {
  const TemporaryFolder folder;
  fs::permissions(folder, fs::perms::all);
  const fs::path locked = folder / "locked_recipe.toml";
  std::ofstream(locked) << "a = 1\n";
  fs::permissions(locked, fs::perms::none);
  EXPECT_EXIT(read_without_permission(locked), testing::ExitedWithCode(2),
              "locked_recipe.toml: cannot be read: Permission denied");
}

TEST(RecipeFile, TakesValuesFromTheCommandLine) {
  const std::vector<std::string> changes{"domain.spacing=\"0.4 um\"", "step[1].duration=\"2 s\"",
                                         "simplify.enabled=false", "domain.extent[0]=\"7 nm\""};
  const RecipeFile file({R"([domain]
spacing = "1 nm"
extent = ["1 nm", "2 nm"]
[[step]]
duration = "1 s"
[[step]]
)",
                         "r.toml", changes});
  const RecipeTable root = file.root();
  EXPECT_EQ(root.table("domain").length("spacing"), 400);
  EXPECT_THAT(root.table("domain").quantities("extent", Dimension::length),
              testing::ElementsAre(7, 2));
  EXPECT_EQ(root.tables("step")[0].time("duration"), 1);
  EXPECT_EQ(root.tables("step")[1].time("duration"), 2);
  EXPECT_FALSE(root.table("simplify").flag("enabled", true));
  file.finish();
}

TEST(RecipeFile, NamesTheCommandLineInErrors) {
  EXPECT_EQ(override_message("step[0].duration=\"-2 s\""),
            "--set step[0].duration=\"-2 s\": step[0].duration: \"-2 s\" is below 0");
  EXPECT_EQ(override_message("domain.spaccing=1"),
            "--set domain.spaccing=1: domain.spaccing: unknown key (did you mean spacing?)");
  EXPECT_EQ(override_message("domain.spacing=0.4 um"),
            "--set domain.spacing=0.4 um: 0.4 um is not a value of TOML; a text keeps its quotes: "
            "--set domain.spacing='\"0.4 um\"'");
  EXPECT_EQ(override_message("flux.target_error=.01"),
            "--set flux.target_error=.01: .01 is not a value of TOML; write 0.01");
  EXPECT_EQ(override_message("domain.spacing=\"1 um"),
            "--set domain.spacing=\"1 um: \"1 um is not a value of TOML; a text keeps its quotes: "
            "--set domain.spacing='\"1 um\"'");
  EXPECT_EQ(override_message("step[1].duration=\"2 s\""),
            "--set step[1].duration=\"2 s\": step has no entry 1; they are counted from 0 "
            "and there are 1");
  EXPECT_EQ(override_message("step.duration=\"2 s\""),
            "--set step.duration=\"2 s\": step is a list; say which entry, [0] for the first");
  EXPECT_EQ(override_message("domain.spacing.x=1"),
            "--set domain.spacing.x=1: domain.spacing is not a table");
  EXPECT_EQ(override_message("domain[0]=1"), "--set domain[0]=1: domain is not a list");
  EXPECT_EQ(override_message("domain.spacing"),
            "--set domain.spacing: write PATH=VALUE, for example step[0].sticking=0.5");
  EXPECT_EQ(override_message("a..b=1"),
            "--set a..b=1: \"a..b\" is not a path; write for example domain.spacing or "
            "step[0].duration");
  EXPECT_THAT(override_message("step[0].seed=99999999999999999999"),
              testing::AllOf(testing::HasSubstr("is not a value of TOML: "),
                             testing::HasSubstr("not representable"),
                             testing::Not(testing::HasSubstr("quotes"))));
  EXPECT_THAT(override_message("domain.spacing=[1, 2"), testing::Not(testing::HasSubstr("quotes")));
  EXPECT_EQ(override_message("domain.spacing=1\nx = 2"),
            "--set domain.spacing=1\\nx = 2: 1\\nx = 2 is not a value of TOML; a text keeps its "
            "quotes: --set domain.spacing='\"1\\nx = 2\"'");
}

TEST(RecipeFile, ErrorsOfTheCommandLineComeLast) {
  const std::vector<std::string> changes{"a=-1"};
  const RecipeFile file({"a = 1\nb = 2\n", "r.toml", changes});
  file.root().number("a", {.minimum = 0});
  file.root().number("b", {.maximum = 1});
  EXPECT_EQ(message([&] { file.finish(); }),
            "r.toml:2:5: b: 2 is above 1\n--set a=-1: a: -1 is below 0");
}

/// A reader with a default of every kind.
struct Values {
  std::vector<double> numbers;
  std::vector<std::string> texts;

  explicit Values(const RecipeFile& file) {
    const RecipeTable root = file.root();
    texts.push_back(root.text("title", "none"));
    const RecipeTable domain = root.table("domain");
    numbers.push_back(domain.length("spacing"));
    numbers.push_back(domain.angle("tilt", {.fallback = "10 deg"}));
    for (const double x :
         domain.quantities("extent", Dimension::length, {2, 2}, {.fallback = "0.1 um"})) {
      numbers.push_back(x);
    }
    const RecipeTable simplify = root.table("simplify");
    numbers.push_back(simplify.flag("enabled", true));
    numbers.push_back(simplify.number("l0", {.fallback = "0.6"}));
    numbers.push_back(static_cast<double>(root.table("flux").integer("rays", {.fallback = "100"})));
    for (const RecipeTable& step : root.tables("step")) read_step(step);
    file.finish();
  }

  void read_step(const RecipeTable& step) {
    numbers.push_back(step.time("duration", {.fallback = "1.1 min"}));
    numbers.push_back(step.fraction("sticking", "0.1"));
    for (const RecipeTable& inner : step.tables("step")) read_step(inner);
  }
};

TEST(RecipeFile, ResolvedRecipeIsWrittenOutAndReadsTheSame) {
  const RecipeFile file({R"(title = "a \"b\" \\ \n \t µ"
[[step]]
sticking = 0.30000000000000004
[[step.step]]
[[step.step]]
duration = "7 h"
[[step]]
[domain]
spacing = "0.57 um"
)",
                         "r.toml",
                         {"flux.rays=1e3"}});
  const Values values(file);
  EXPECT_EQ(file.resolved(), R"(title = "a \"b\" \\ \n \t µ"

[domain]
spacing = "0.57 um"
tilt = "10 deg"
extent = ["0.1 um", "0.1 um"]

[simplify]
enabled = true
l0 = 0.6

[flux]
rays = 1000

[[step]]
duration = "1.1 min"
sticking = 0.30000000000000004

[[step.step]]
duration = "1.1 min"
sticking = 0.1

[[step.step]]
duration = "7 h"
sticking = 0.1

[[step]]
duration = "1.1 min"
sticking = 0.1
)");
  const RecipeFile again({file.resolved(), "resolved.toml"});
  const Values same(again);
  EXPECT_EQ(same.numbers, values.numbers);
  EXPECT_EQ(same.texts, values.texts);
  EXPECT_EQ(again.resolved(), file.resolved());
}

}  // namespace
}  // namespace scarp

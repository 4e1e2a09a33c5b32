#include "apps/simulator/recipe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/error.h"
#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

namespace fs = std::filesystem;

constexpr const char* trench_recipe = R"([domain]
spacing = "0.1 um"
extent = ["10 um", "10 um"]

[[geometry]]
shape = "wafer"
material = "Si"

[[geometry]]
shape = "trench"
width = "4 um"
depth = "8 um"

[[step]]
name = "liner"
model = "single_particle"
duration = "1.6 min"
material = "SiO2"
growth_rate = "1 um/min"
sticking = 0.1
)";

class RecipeTest : public ::testing::Test {
 protected:
  Recipe read(const std::string& text, const std::vector<std::string>& overrides = {}) {
    const fs::path file = folder_ / "r.toml";
    std::ofstream(file) << text;
    return read_recipe(recipe_in(file, overrides));
  }

  // The messages, with the folder cut off.
  std::string message_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
    try {
      read(text, overrides);
    } catch (const InputError& error) {
      std::string message = error.what();
      const std::string prefix = folder_.string() + "/";
      for (auto at = message.find(prefix); at != std::string::npos; at = message.find(prefix)) {
        message.erase(at, prefix.size());
      }
      return message;
    }
    return "no error";
  }

  // The trench recipe with one piece of text put in the place of another.
  static std::string changed(const std::string& from, const std::string& to) {
    std::string text = trench_recipe;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }

  TemporaryFolder folder_;
};

TEST_F(RecipeTest, KnowsTheSchemes) {
  EXPECT_EQ(read(trench_recipe).advection.scheme, Scheme::eno2);
  const Recipe recipe = read(trench_recipe, {"advection.scheme=\"weno5\""});
  EXPECT_EQ(recipe.advection.scheme, Scheme::weno5);
  EXPECT_THAT(recipe.resolved, HasSubstr("scheme = \"weno5\""));
  EXPECT_THAT(message_of(trench_recipe, {"advection.scheme=\"eno3\""}),
              AllOf(HasSubstr("advection.scheme"), HasSubstr("eno2")));
}

TEST_F(RecipeTest, ReadsTheTrenchInInternalUnits) {
  const Recipe recipe = read(trench_recipe);
  EXPECT_EQ(recipe.domain.frame.spacing, 100);
  EXPECT_EQ(recipe.domain.frame.cells, (std::array<int, 2>{100, 100}));
  ASSERT_EQ(recipe.start.shapes.size(), 2U);
  EXPECT_EQ(std::get<TrenchShape>(recipe.start.shapes[1]).width, 4000);
  EXPECT_EQ(std::get<TrenchShape>(recipe.start.shapes[1]).cut.depth, 8000);
  ASSERT_EQ(recipe.steps.size(), 1U);
  EXPECT_EQ(recipe.steps[0].duration, 96);
  EXPECT_EQ(recipe.steps[0].deposits, recipe.materials.id("SiO2"));
  ASSERT_TRUE(recipe.simplification.options.has_value());
  EXPECT_DOUBLE_EQ(recipe.simplification.options->l0.value(), 60);
}

TEST_F(RecipeTest, NamesAreOneLineThatNoSpreadsheetTakesForAFormula) {
  for (const std::string bad : {"=1+1", "+x", "-x", "@SUM(A1)"})
    EXPECT_THAT(message_of(changed("\"liner\"", '"' + bad + '"')),
                HasSubstr("step[0].name: \"" + bad + "\": a name does not begin with"));
  EXPECT_THAT(message_of(changed("\"liner\"", "\"two\\nlines\"")),
              HasSubstr("step[0].name: \"two\\nlines\": a name is one line"));
  EXPECT_THAT(message_of(changed("\"liner\"", "\"red \\u001b[31m\"")),
              HasSubstr("step[0].name: \"red \\x1b[31m\" has a control character"));
  const std::string material = "\n[materials.\"SiO2\\nW\"]\ndensity = \"5e22 /cm3\"\n";
  EXPECT_THAT(message_of(trench_recipe + material), HasSubstr("\"SiO2\\nW\": a name is one line"));
}

TEST_F(RecipeTest, ReadsTheMemoryLimit) {
  EXPECT_EQ(read(trench_recipe).flux.options.memory_limit, std::uint64_t{1} << 30);
  EXPECT_EQ(read(changed("[[step]]", "[flux]\nmemory_limit = \"64 MB\"\n\n[[step]]"))
                .flux.options.memory_limit,
            std::uint64_t{64} << 20);
}

TEST_F(RecipeTest, TheResolvedRecipeReadsTheSame) {
  const Recipe recipe = read(trench_recipe);
  EXPECT_EQ(read(recipe.resolved).resolved, recipe.resolved);
}

TEST_F(RecipeTest, TheResolvedRecipeHoldsDefaultsThatAreNotNumbers) {
  std::string text = trench_recipe;
  text.replace(text.find("model = \"single"), std::string::npos,
               "model = \"directional\"\nduration = \"1 s\"\ndirectional_etch_rate = \"1 nm/s\"\n");
  const std::string resolved = read(text).resolved;
  EXPECT_THAT(resolved,
              AllOf(HasSubstr("depth_from = \"surface\"\n"), HasSubstr("through = \"all\"\n"),
                    HasSubstr("repeat = 1\n"), HasSubstr("curvature_threshold = 0\n"),
                    HasSubstr("remove = 1\n"), HasSubstr("[[step.beam]]\ntilt = \"0 deg\"\n")));
  EXPECT_EQ(read(resolved).resolved, resolved);
  EXPECT_FALSE(read(resolved).simplification.options->remove.has_value());
}

TEST_F(RecipeTest, AnL0AboveTheDefaultOfLMaxRaisesItInTheResolvedRecipe) {
  const Recipe recipe = read(trench_recipe, {"simplify.l0=10"});
  EXPECT_DOUBLE_EQ(recipe.simplification.options->l_max, 1000);
  EXPECT_THAT(recipe.resolved, HasSubstr("l_max = 10\n"));
}

TEST_F(RecipeTest, EveryRecipeInConfigsIsAccepted) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(SCARP_SOURCE_DIR) / "configs")) {
    if (entry.path().extension() != ".toml") continue;
    ++count;
    EXPECT_NO_THROW(read_recipe(recipe_in(entry.path()))) << entry.path();
  }
  EXPECT_GE(count, 4);
}

TEST_F(RecipeTest, OverridesChangeValues) {
  const Recipe recipe =
      read(trench_recipe, {"domain.spacing=\"0.4 um\"", "geometry[1].width=\"3.2 um\"",
                           "step[0].duration=\"6 s\"", "domain.extent=[\"9.6 um\", \"8 um\"]"});
  EXPECT_EQ(recipe.domain.frame.spacing, 400);
  EXPECT_EQ(recipe.steps[0].duration, 6);
  EXPECT_EQ(std::get<TrenchShape>(recipe.start.shapes[1]).width, 3200);
}

TEST_F(RecipeTest, RepeatedStepsAreWrittenOutInOrder) {
  const std::string cycle = std::string(trench_recipe) + R"(
[[step]]
name = "bosch"
repeat = 3
[[step.step]]
name = "passivate"
model = "isotropic"
duration = "1 s"
material = "polymer"
growth_rate = "1 nm/s"
[[step.step]]
name = "etch"
model = "isotropic"
duration = "2 s"
etch_rate = { Si = "1 nm/s", SiO2 = "0 nm/s", polymer = "5 nm/s" }
)";
  const Recipe recipe = read(cycle);
  ASSERT_EQ(recipe.steps.size(), 7U);
  EXPECT_EQ(recipe.steps[1].name, "bosch 1: passivate");
  EXPECT_EQ(recipe.steps[6].name, "bosch 3: etch");
}

// What a later round meets includes what an earlier one deposited.
TEST_F(RecipeTest, ARepeatedEtchHasToListWhatTheCycleDeposits) {
  const std::string cycle = std::string(trench_recipe) + R"(
[[step]]
repeat = 2
[[step.step]]
model = "isotropic"
duration = "2 s"
etch_rate = { Si = "1 nm/s", SiO2 = "0 nm/s" }
[[step.step]]
model = "isotropic"
duration = "1 s"
material = "polymer"
growth_rate = "1 nm/s"
)";
  EXPECT_THAT(message_of(cycle),
              AllOf(HasSubstr("step[1].step[0].etch_rate"), HasSubstr("polymer")));
}

TEST_F(RecipeTest, TwoDimensionsHaveOneExtentAndNoSimplification) {
  const Recipe recipe =
      read(changed("extent = [\"10 um\", \"10 um\"]", "extent = [\"10 um\"]\nmode = \"2d\""));
  EXPECT_TRUE(recipe.domain.frame.two_dimensional);
  EXPECT_EQ(recipe.domain.frame.cells, (std::array<int, 2>{100, 1}));
  EXPECT_FALSE(recipe.simplification.options.has_value());
}

struct BadRecipe {
  const char* name;
  const char* from;
  const char* to;
  std::vector<const char*> says;
};

std::ostream& operator<<(std::ostream& out, const BadRecipe& recipe) { return out << recipe.name; }

class BadRecipeTest : public RecipeTest, public ::testing::WithParamInterface<BadRecipe> {};

TEST_P(BadRecipeTest, IsRefusedWithPlaceAndRemedy) {
  const std::string message = message_of(changed(GetParam().from, GetParam().to));
  for (const char* says : GetParam().says) EXPECT_THAT(message, HasSubstr(says));
}

INSTANTIATE_TEST_SUITE_P(
    All, BadRecipeTest,
    ::testing::Values(
        BadRecipe{"NoUnit",
                  "\"0.1 um\"",
                  "\"0.1\"",
                  {"r.toml:2:", "domain.spacing", "has no unit", "nm"}},
        BadRecipe{"BareNumber", "\"0.1 um\"", "0.1", {"r.toml:2:", "domain.spacing", "unit"}},
        BadRecipe{"WrongUnit",
                  "\"0.1 um\"",
                  "\"0.1 s\"",
                  {"r.toml:2:", "domain.spacing", "time", "length"}},
        BadRecipe{"UnknownKey",
                  "spacing",
                  "spaccing",
                  {"r.toml:2:1", "domain.spaccing", "did you mean spacing?"}},
        BadRecipe{"MissingKey", "duration = \"1.6 min\"\n", "", {"r.toml:1", "step[0].duration"}},
        BadRecipe{"WrongType",
                  "sticking = 0.1",
                  "sticking = \"low\"",
                  {"r.toml:20:", "step[0].sticking"}},
        BadRecipe{
            "NotANumber", "sticking = 0.1", "sticking = nan", {"r.toml:20:", "step[0].sticking"}},
        BadRecipe{"InfiniteLength", "\"0.1 um\"", "\"inf um\"", {"r.toml:2:", "domain.spacing"}},
        BadRecipe{"StickingAboveOne",
                  "sticking = 0.1",
                  "sticking = 1.5",
                  {"r.toml:20:", "step[0].sticking", "1.5 is outside [0, 1]"}},
        BadRecipe{"NegativeRate",
                  "\"1 um/min\"",
                  "\"-1 um/min\"",
                  {"r.toml:19:", "step[0].growth_rate", "outside [0, 1e9 nm/s]"}},
        BadRecipe{"TrenchWiderThanDomain",
                  "width = \"4 um\"",
                  "width = \"12 um\"",
                  {"r.toml:11:", "geometry[1].width", "domain"}},
        BadRecipe{"FeatureThinnerThanTwoCells",
                  "width = \"4 um\"",
                  "width = \"0.15 um\"",
                  {"r.toml:11:", "geometry[1].width", "two grid spacings"}},
        BadRecipe{
            "ZeroRays", "[[step]]", "[flux]\nrays = 0\n\n[[step]]", {"r.toml:15:", "flux.rays"}},
        BadRecipe{"ExtentNotAWholeNumberOfSpacings",
                  "\"0.1 um\"",
                  "\"0.3 um\"",
                  {"r.toml:3:", "domain.extent[0]", "whole number"}},
        BadRecipe{"MemoryLimitWithoutUnit",
                  "[[step]]",
                  "[flux]\nmemory_limit = \"512\"\n\n[[step]]",
                  {"r.toml:15:", "flux.memory_limit", "512 MB"}},
        BadRecipe{"MoreRaysThanATallyHolds",
                  "[[step]]",
                  "[flux]\nrays = 10000000000\n\n[[step]]",
                  {"r.toml:15:", "flux.rays"}},
        BadRecipe{"DomainLargerThanMemory",
                  "extent = [\"10 um\", \"10 um\"]",
                  "extent = [\"90 mm\", \"90 mm\"]",
                  {"r.toml:3:", "domain.extent", "coarser spacing"}},
        BadRecipe{"CellsWithoutEnd",
                  "extent = [\"10 um\", \"10 um\"]",
                  "extent = [\"0.9 m\", \"10 um\"]",
                  {"domain.extent[0]", "the most is 1000000: an extent of 1e8 nm", "900 nm"}},
        BadRecipe{"SpacingBelowAtoms",
                  "\"0.1 um\"",
                  "\"1e-30 um\"",
                  {"r.toml:2:", "domain.spacing", "outside [1e-6 um, 1e9 nm]"}},
        BadRecipe{"EndlessDepth",
                  "depth = \"8 um\"",
                  "depth = \"1e30 m\"",
                  {"r.toml:12:", "geometry[1].depth", "outside (0, 1e9 nm)"}},
        BadRecipe{"DepthOfTooManyCells",
                  "depth = \"8 um\"",
                  "depth = \"0.5 m\"",
                  {"r.toml:12:", "geometry[1].depth", "5000000 grid spacings high", "100000"}},
        BadRecipe{
            "WallsLargerThanMemory",
            "\"10 um\"]\n\n[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n\n[[geometry]]\n"
            "shape = \"trench\"\nwidth = \"4 um\"\ndepth = \"8 um\"",
            "\"10 mm\"]\n\n[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n\n[[geometry]]\n"
            "shape = \"trench\"\nwidth = \"4 um\"\ndepth = \"8 mm\"",
            {"r.toml:9:", "geometry[1]", "walls of 1.6e+10 grid cells need 4.1e+03 GB"}},
        BadRecipe{"EndlessRate",
                  "\"1 um/min\"",
                  "\"1e33 um/min\"",
                  {"r.toml:19:", "step[0].growth_rate", "outside [0, 1e9 nm/s]"}},
        BadRecipe{
            "EndlessRepeat",
            "[[step]]\n",
            "[[step]]\nrepeat = 1000000\n[[step.step]]\nrepeat = 1000000\n[[step.step.step]]\n",
            {"step[0].step[0].repeat", "makes 1000000 steps", "the most is 100000"}},
        BadRecipe{"RepeatsThatMultiply",
                  "[[step]]\n",
                  "[[step]]\nrepeat = 1000\n[[step.step]]\nrepeat = 1000\n[[step.step.step]]\n",
                  {"r.toml:15:", "step[0].repeat", "makes 1000000 steps"}},
        BadRecipe{"EndlessStep", "\"1.6 min\"", "\"1e300 s\"", {"r.toml:17:", "step[0].duration"}},
        BadRecipe{"UnknownModel",
                  "single_particle",
                  "single_partcle",
                  {"r.toml:16:", "step[0].model", "single_particle"}},
        BadRecipe{"EndlessFilm",
                  "[[step]]",
                  "[[step]]\nmodel = \"conformal\"\nthickness = \"0.5 m\"\nmaterial = \"SiO2\"\n\n"
                  "[[step]]",
                  {"r.toml:16:", "step[0].thickness", "5000000 spacings; the most is 100000"}},
        BadRecipe{"PlaneFarBelowEverything",
                  "[[step]]",
                  "[[step]]\nmodel = \"planarise\"\nheight = \"-0.5 m\"\n\n[[step]]",
                  {"r.toml:16:", "step[0].height", "5000000 spacings; the most is 100000"}},
        BadRecipe{"RemovalOfMoreThanThereIs",
                  "[[step]]",
                  "[[step]]\nmodel = \"planarise\"\nremoval = \"0.5 m\"\n\n[[step]]",
                  {"r.toml:16:", "step[0].removal", "5000000 spacings; the most is 100000"}},
        BadRecipe{"TimeStepsWithoutEnd",
                  "\"1.6 min\"",
                  "\"8e8 s\"",
                  {"r.toml:17:", "step[0].duration", "makes about 3.3e+08 time steps",
                   "a shorter duration, lower rates or a coarser spacing"}},
        BadRecipe{"UnknownMaterial",
                  "material = \"Si\"\n",
                  "material = \"Sj\"\n",
                  {"r.toml:7:", "geometry[0].material", "Sj"}},
        BadRecipe{"UnknownMethod",
                  "[[step]]",
                  "[simplify]\nmethod = \"curvatur\"\n\n[[step]]",
                  {"r.toml:15:", "simplify.method", "curvature"}},
        BadRecipe{"AmbiguousMask",
                  "[[step]]",
                  "[[geometry]]\nshape = \"mask\"\nmaterial = \"resist\"\nthickness = \"1 um\"\n\n"
                  "[[step]]",
                  {"r.toml:14:", "geometry[2]", "opening", "resist"}}),
    [](const auto& test) { return std::string(test.param.name); });

TEST_F(RecipeTest, AllErrorsAreReportedAtOnceInTheOrderOfLines) {
  std::string text = changed("\"0.1 um\"", "\"0.1\"");
  text.replace(text.find("sticking = 0.1"), 14, "sticking = 1.5");
  const std::string message = message_of(text);
  const auto first = message.find("domain.spacing");
  const auto second = message.find("step[0].sticking");
  ASSERT_NE(first, std::string::npos);
  ASSERT_NE(second, std::string::npos);
  EXPECT_LT(first, second);
}

TEST_F(RecipeTest, ATiltedBeamBetweenMirrorsIsRefused) {
  std::string text = trench_recipe;
  text.replace(text.find("[[step]]"), std::string::npos, R"([[step]]
model = "directional"
duration = "1 s"
directional_etch_rate = "1 nm/s"
beam = [{ tilt = "10 deg" }]
)");
  EXPECT_THAT(message_of(text), AllOf(HasSubstr("step[0].beam"), HasSubstr("periodic")));
  const auto with_beams = [&](const std::string& beams) {
    std::string other = text;
    return other.replace(other.find("beam = "), std::string::npos, "beam = [" + beams + "]\n");
  };
  EXPECT_EQ(
      message_of(with_beams(R"({ tilt = "10 deg" }, { tilt = "10 deg", azimuth = "180 deg" })")),
      "no error");
  EXPECT_THAT(message_of(with_beams(
                  R"({ tilt = "10 deg" }, { tilt = "10 deg", azimuth = "180 deg", share = 2 })")),
              HasSubstr("same share"));
}

TEST_F(RecipeTest, TiltedIonsBetweenMirrorsAreRefused) {
  std::string text = trench_recipe;
  text.replace(text.find("[[step]]"), std::string::npos, R"([[step]]
model = "multi_particle"
duration = "1 s"
rate = "-1 nm/s * ion"
[[step.ion]]
name = "ion"
tilt = "10 deg"
)");
  EXPECT_THAT(message_of(text),
              AllOf(HasSubstr("step[0].ion"), HasSubstr("along x"), HasSubstr("rotating = true")));
  EXPECT_EQ(message_of(text + "rotating = true\n"), "no error");
}

TEST_F(RecipeTest, RepeatOnAPlainStepIsOneError) {
  const std::string message = message_of(trench_recipe, {"step[0].repeat=3"});
  EXPECT_THAT(message, HasSubstr("step[0].repeat: there is nothing to repeat"));
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 0) << message;
}

TEST_F(RecipeTest, WhatIsNoTableIsTheOnlyError) {
  for (const char* change : {"domain=1", "step[0]=1", "step=1", "geometry=1", "geometry[1]=1"}) {
    const std::string message = message_of(trench_recipe, {change});
    EXPECT_THAT(message, HasSubstr("1 is not a table")) << change;
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 0) << message;
  }
}

TEST_F(RecipeTest, TheStepsOfAllCyclesAreCounted) {
  std::string text = trench_recipe;
  text.erase(text.find("[[step]]"));
  for (int cycle = 0; cycle < 3; ++cycle) {
    text +=
        "[[step]]\nrepeat = 40000\n[[step.step]]\nmodel = \"isotropic\"\nduration = \"1 s\"\n"
        "etch_rate = \"1 nm/s\"\n";
  }
  const std::string message = message_of(text);
  EXPECT_THAT(message, HasSubstr("step[2].repeat: makes 120000 steps"));
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 0) << message;
}

TEST_F(RecipeTest, AnEmptyOrMissingFileIsRefused) {
  EXPECT_THAT(message_of(""), HasSubstr("r.toml"));
  EXPECT_THROW(read_recipe(recipe_in(folder_ / "nothing.toml")), InputError);
}

}  // namespace
}  // namespace scarp

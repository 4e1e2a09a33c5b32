// What scarp check and scarp run warn of before a run: each once, and what is just not doubtful.

#include "apps/simulator/recipe_warnings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/estimate/estimate.h"
#include "apps/simulator/state.h"
#include "core/error.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A wafer with something on it, on a grid of 10 nm.
std::string recipe(const std::string& tables) {
  const bool has_step = tables.find("[[step]]") != std::string::npos;
  return "[domain]\nspacing = \"10 nm\"\nextent = [\"400 nm\", \"200 nm\"]\n"
         "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n" +
         tables +
         (has_step ? ""
                   : "\n[[step]]\nmodel = \"isotropic\"\nduration = \"1 s\"\netch_rate = "
                     "{ Si = \"1 nm/s\", default = \"0 nm/s\" }\n");
}

std::string shape(const std::string& keys) { return "[[geometry]]\n" + keys + '\n'; }

std::string mask(const std::string& outline) {
  return shape("shape = \"mask\"\nmaterial = \"resist\"\nthickness = \"40 nm\"\n" + outline);
}

std::string oxide(const std::string& thickness) {
  return shape("shape = \"layer\"\nmaterial = \"SiO2\"\nthickness = \"" + thickness + '"');
}

std::string etch(const std::string& rates) {
  return "[[step]]\nmodel = \"isotropic\"\nduration = \"1 s\"\netch_rate = { " + rates + " }\n";
}

std::string film(const std::string& duration, const std::string& more = "") {
  return "[[step]]\nmodel = \"isotropic\"\nmaterial = \"W\"\ngrowth_rate = \"1 nm/s\"\nduration "
         "= \"" +
         duration + "\"\n" + more;
}

const std::string trench_100 = shape("shape = \"trench\"\nwidth = \"100 nm\"\ndepth = \"90 nm\"");

struct Doubt {
  std::string name;
  std::string tables;
  std::vector<std::string> says;  // empty: nothing
};

std::ostream& operator<<(std::ostream& out, const Doubt& doubt) { return out << doubt.name; }

class Doubts : public ::testing::TestWithParam<Doubt> {};

TEST_P(Doubts, AreToldWithKeyAndRemedy) {
  const std::vector<std::string> warnings = read_text(recipe(GetParam().tables)).warnings;
  if (GetParam().says.empty()) {
    EXPECT_THAT(warnings, IsEmpty());
    return;
  }
  ASSERT_EQ(warnings.size(), 1U) << testing::PrintToString(warnings);
  for (const std::string& text : GetParam().says) EXPECT_THAT(warnings[0], HasSubstr(text));
}

const std::vector<std::string> narrow{"than 5 grid spacings (50 nm)", "domain.spacing"};

std::vector<std::string> and_key(const std::string& key, std::vector<std::string> texts) {
  texts.push_back(key + ": ");
  return texts;
}

INSTANTIATE_TEST_SUITE_P(
    All, Doubts,
    ::testing::Values(
        Doubt{"Trench", shape("shape = \"trench\"\nwidth = \"49 nm\"\ndepth = \"90 nm\"\n"),
              and_key("r.toml:9:9: geometry[1].width", narrow)},
        Doubt{"TrenchOfFive",
              shape("shape = \"trench\"\nwidth = \"60 nm\"\ndepth = \"30 nm\"\n"),
              {}},
        Doubt{
            "Floor",
            shape(
                "shape = \"trench\"\nwidth = \"100 nm\"\ndepth = \"90 nm\"\ntaper = \"20 deg\"\n"),
            and_key("geometry[1].taper", narrow)},
        Doubt{"WallBetweenTrenches",
              shape("shape = \"trench\"\nwidth = \"60 nm\"\ndepth = \"90 nm\"\nrepeat = 2\n"
                    "pitch = \"100 nm\""),
              and_key("geometry[1].pitch", narrow)},
        Doubt{"Hole", shape("shape = \"hole\"\nradius = \"24 nm\"\ndepth = \"90 nm\""),
              and_key("geometry[1].radius", narrow)},
        Doubt{"HoleOfSix", shape("shape = \"hole\"\nradius = \"30 nm\"\ndepth = \"90 nm\""), {}},
        Doubt{"Fin",
              shape("shape = \"fin\"\nmaterial = \"Si\"\nwidth = \"40 nm\"\nheight = \"90 nm\""),
              and_key("geometry[1].width", narrow)},
        Doubt{"MaskOpening", mask("opening = { shape = \"trench\", width = \"40 nm\" }"),
              and_key("geometry[1].opening.width", narrow)},
        Doubt{"MaskOpeningOfSix", mask("opening = { shape = \"trench\", width = \"60 nm\" }"), {}},
        Doubt{"Resist", mask("resist = { shape = \"rectangle\", size = [\"100 nm\", \"40 nm\"] }"),
              and_key("geometry[1].resist.size", narrow)},
        Doubt{"MaskOfAStep",
              "[[step]]\nmodel = \"mask\"\nmaterial = \"resist\"\nthickness = \"60 nm\"\n"
              "opening = { shape = \"trench\", width = \"40 nm\" }\n",
              and_key("step[0].opening.width", narrow)},
        Doubt{"MaskOfAStepThatRepeats",
              "[[step]]\nrepeat = 3\n[[step.step]]\nmodel = \"mask\"\nmaterial = \"resist\"\n"
              "thickness = \"60 nm\"\nopening = { shape = \"trench\", width = \"40 nm\" }\n",
              and_key("step[0].step[0].opening.width", narrow)},
        Doubt{"Polygon",
              mask("opening = { shape = \"polygon\", points = [[\"0 nm\", \"0 nm\"], [\"90 nm\", "
                   "\"0 nm\"], [\"90 nm\", \"40 nm\"], [\"0 nm\", \"40 nm\"]] }"),
              {"geometry[1].opening.points: ", "50 nm apart", "domain.spacing"}},
        Doubt{"ThinLayerThatIsEtched",
              oxide("19 nm") + etch("Si = \"0 nm/s\", SiO2 = \"1 nm/s\""),
              {"geometry[1].thickness: ", "than two grid spacings (20 nm)", "9.5 nm or less"}},
        Doubt{
            "ThinLayerThatIsNot", oxide("19 nm") + etch("Si = \"1 nm/s\", SiO2 = \"0 nm/s\""), {}},
        Doubt{"ThinLayerOfWhatItLiesOn",
              shape("shape = \"layer\"\nmaterial = \"Si\"\nthickness = \"4 nm\"") +
                  etch("Si = \"1 nm/s\""),
              {}},
        Doubt{"LayerOfTwoThatIsEtched",
              oxide("20 nm") + etch("Si = \"0 nm/s\", SiO2 = \"1 nm/s\""),
              {}},
        Doubt{"ThinLayerOfAStack",
              shape("shape = \"stack\"\nmaterials = [\"Si\", \"SiO2\"]\nthicknesses = [\"30 nm\", "
                    "\"10 nm\"]\ncount = 2") +
                  etch("Si = \"0 nm/s\", SiO2 = \"1 nm/s\""),
              {"geometry[1].thicknesses[1]: ", "5 nm or less"}},
        Doubt{"ThinFilm",
              film("19 s"),
              {"r.toml:11:12: step[0].duration: ", "a film of 19 nm", "9.5 nm or less"}},
        Doubt{"FilmOfTwo", film("20 s"), {}},
        Doubt{"FilmInTwoSteps", film("10 s") + film("10 s"), {}},
        Doubt{"FilmThatIsEtchedBetween",
              film("30 s") + etch("W = \"1 nm/s\", default = \"0 nm/s\"") + film("10 s"),
              {"step[2].duration: ", "a film of 10 nm"}},
        Doubt{"FilmThatEndsByItsThickness",
              film("30 s", "until = { thickness = \"15 nm\" }\n"),
              {"step[0].until.thickness: ", "a film of 15 nm"}},
        Doubt{"ThinFilmOfCycles",
              "[[step]]\nrepeat = 3\n[[step.step]]\nmodel = \"conformal\"\nthickness = \"6 nm\"\n"
              "material = \"W\"\n",
              {"step[0].step[0].thickness: ", "a film of 18 nm"}},
        Doubt{"FilmOfCycles",
              "[[step]]\nrepeat = 4\n[[step.step]]\nmodel = \"conformal\"\nthickness = \"6 nm\"\n"
              "material = \"W\"\n",
              {}},
        // What settles depends on what the ions take away elsewhere.
        Doubt{"FilmOfUnknownThickness",
              "[[step]]\nmodel = \"ion_milling\"\nduration = \"1 s\"\netch_rate = \"1 nm/s\"\n"
              "material = \"W\"\n[[step.ion]]\nenergy = \"500 eV\"\n",
              {}},
        Doubt{"LongFacets",
              trench_100 + "[simplify]\nl_max = 5.1\n",
              {"simplify.l_max: ", "edges of 51 nm", "geometry[1].width: 100 nm"}},
        Doubt{"FacetsOfHalfAnOpening", trench_100 + "[simplify]\nl_max = 5\n", {}},
        Doubt{"LongFacetsByTheirL0",
              trench_100 + "[simplify]\nl0 = 5.1\n",
              {"simplify.l_max: ", "edges of 51 nm"}},
        Doubt{"FacetsOfAnyLength",
              trench_100 + "[simplify]\nl_max = 0\n",
              {"simplify.l_max: ", "edges of any length"}},
        // A ridge is no opening: its sides do not shadow each other.
        Doubt{"LongFacetsBesideARidge",
              shape("shape = \"fin\"\nmaterial = \"Si\"\nwidth = \"100 nm\"\nheight = \"90 nm\"") +
                  "[simplify]\nl_max = 6\n",
              {}},
        Doubt{
            "LongFacetsOfAFullMesh", trench_100 + "[simplify]\nenabled = false\nl_max = 9\n", {}}),
    [](const auto& test) { return test.param.name; });

// Shapes on a state are looked at as those of a start geometry.
TEST(NarrowShapes, OnAStateAreToldAsThoseOfAStartGeometry) {
  const Recipe base = read_text(recipe(""));
  const auto load = [&](const std::filesystem::path&, const Materials&) {
    const auto state = std::make_shared<State>();
    state->layers = build_layers(base.domain.frame, base.start.shapes);
    return StartState{.file = "a.vdb", .state = state, .hash = ""};
  };
  const auto warnings = [&](const std::string& tables) {
    std::string text = recipe(tables);
    const std::string wafer = "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n";
    text = "start = \"a.vdb\"\n" + text.replace(text.find(wafer), wafer.size(), "[materials]\n");
    return read_recipe({.text = text}, load).warnings;
  };
  EXPECT_THAT(
      warnings(shape("shape = \"trench\"\nwidth = \"40 nm\"\ndepth = \"90 nm\"")),
      ElementsAre(AllOf(HasSubstr("geometry[0].width: 40 nm"), HasSubstr("5 grid spacings"))));
  EXPECT_THAT(warnings(trench_100 + "[simplify]\nl_max = 5.1\n"),
              ElementsAre(HasSubstr("simplify.l_max: allows edges of 51 nm")));
  EXPECT_THAT(warnings(trench_100 + "[simplify]\nl_max = 5\n"), IsEmpty());
}

// A film over silicon under a mask, and what two steps do to it.
std::string held_film(const std::string& thickness, const std::string& first,
                      const std::string& second) {
  return recipe(oxide(thickness) + '\n' +
                mask("opening = { shape = \"trench\", width = \"100 nm\" }") + first + second);
}

std::string messages_for(const std::string& text) {
  try {
    read_text(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

const std::string opens =
    "[[step]]\nmodel = \"directional\"\nduration = \"10 s\"\n"
    "directional_etch_rate = { SiO2 = \"1 nm/s\", default = \"0 nm/s\" }\n";

std::string undercuts(const std::string& duration, const std::string& film_rate = "0 nm/s") {
  return "[[step]]\nmodel = \"isotropic\"\nduration = \"" + duration +
         "\"\netch_rate = { Si = \"1 nm/s\", SiO2 = \"" + film_rate +
         "\", default = \"0 nm/s\" }\n";
}

TEST(UnheldFilm, IsRefusedWithTheSpacingThatWouldDo) {
  EXPECT_THAT(messages_for(held_film("9 nm", opens, undercuts("11 s"))),
              AllOf(HasSubstr("geometry[1].thickness: a film of 9 nm"),
                    HasSubstr("step[1] etches Si"), HasSubstr("domain.spacing of 9 nm or less")));
  EXPECT_THAT(messages_for(held_film("9 nm", opens, undercuts("11 s", "0.09 nm/s"))),
              HasSubstr("a film of 9 nm"));
  const std::string cut = shape("shape = \"trench\"\nwidth = \"100 nm\"\ndepth = \"90 nm\"");
  EXPECT_THAT(messages_for(recipe(oxide("9 nm") + '\n' + cut + undercuts("11 s"))),
              HasSubstr("step[0] etches Si"));
}

TEST(UnheldFilm, IsRefusedOnceAllLayersAboveItAreOpened) {
  const auto under = [](const std::string& rate) {
    const std::string nitride =
        shape("shape = \"layer\"\nmaterial = \"Si3N4\"\nthickness = \"20 nm\"");
    const std::string open =
        "[[step]]\nmodel = \"directional\"\nduration = \"15 s\"\n"
        "directional_etch_rate = { SiO2 = \"2 nm/s\", Si3N4 = \"" +
        rate + "\", default = \"0 nm/s\" }\n";
    return recipe(oxide("9 nm") + '\n' + nitride + open + undercuts("11 s"));
  };
  EXPECT_THAT(messages_for(under("2 nm/s")), HasSubstr("a film of 9 nm"));  // 14.5 s for both
  EXPECT_EQ(messages_for(under("1.9 nm/s")), "");                           // 15.03 s
  EXPECT_EQ(messages_for(under("0 nm/s")), "");
}

TEST(UnheldFilm, IsNoMatterWhereItIsHeld) {
  const std::vector<std::string> held{
      held_film("10 nm", opens, undercuts("11 s")),             // the grid holds it
      held_film("9 nm", opens, undercuts("9 s")),               // by less than a spacing
      held_film("9 nm", "", undercuts("11 s")),                 // it is not opened
      held_film("9 nm", undercuts("11 s"), opens),              // later
      held_film("9 nm", opens, undercuts("11 s", "0.2 nm/s")),  // it goes as well
      held_film("9 nm", opens, opens)};                         // from above alone
  for (const std::string& text : held) EXPECT_EQ(messages_for(text), "") << text;
}

TEST(DearFlux, IsToldWithATargetThatIsNot) {
  Recipe recipe = read_text(
      "[domain]\nspacing = \"10 nm\"\nextent = [\"100 nm\"]\nmode = \"2d\"\n"
      "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n[flux]\n"
      "target_error = 0.001\nwarn_above = \"1 h\"\n[[step]]\nmodel = "
      "\"isotropic\"\nduration = \"1 s\"\netch_rate = \"1 nm/s\"\n");
  CostEstimate cost{.rays_per_time_step = 1e9, .seconds = 6 * 3600, .flux_seconds = 4 * 3600};
  EXPECT_THAT(expensive_flux_warning(cost, recipe.flux).value_or("nothing"),
              AllOf(HasSubstr("flux.target_error: 0.001 takes about 1e+09 rays per time step"),
                    HasSubstr("4.0 h on this machine, more than flux.warn_above (1 h)"),
                    HasSubstr("; 0.0022 would not")));
  cost.flux_seconds = 3600;
  EXPECT_EQ(expensive_flux_warning(cost, recipe.flux), std::nullopt);
  recipe.flux.position_error = 0.02;
  cost.flux_seconds = 4 * 3600;
  EXPECT_THAT(
      expensive_flux_warning(cost, recipe.flux).value_or("nothing"),
      AllOf(HasSubstr("flux.position_error: 0.02 nm takes"), HasSubstr("; 0.044 nm would")));
  // There is no target.
  cost.flux_seconds = 4 * 3600;
  recipe.flux.options.rays = 1000;
  EXPECT_EQ(expensive_flux_warning(cost, recipe.flux), std::nullopt);
}

using RecipeWarnings = Program;

TEST_F(RecipeWarnings, AreGivenByCheckAndRunAlike) {
  write("r.toml", recipe(shape("shape = \"trench\"\nwidth = \"40 nm\"\ndepth = \"60 nm\"") +
                         "[flux]\nwarn_above = \"1 us\"\n[[step]]\nmodel = \"single_particle\"\n"
                         "duration = \"15 s\"\nmaterial = \"W\"\ngrowth_rate = \"1 nm/s\"\n"));
  const Outcome check = scarp("check --json " + path("r.toml"));
  const Outcome run = scarp("run --quiet -o " + path("r") + ' ' + path("r.toml"));
  EXPECT_EQ(check.exit_code, 0);
  EXPECT_EQ(run.exit_code, 0);
  for (const Outcome& each : {check, run})
    EXPECT_THAT(each.messages,
                AllOf(HasSubstr("warning: " + path("r.toml") + ":9:9: geometry[1].width: "),
                      HasSubstr("step[0].duration: makes a film of 15 nm"),
                      HasSubstr("warning: flux.target_error: 0.01 takes")));
  EXPECT_EQ(json_of(check)["warnings"].size(), 3U);
}

class ShippedRecipes : public ::testing::TestWithParam<std::string> {};

TEST_P(ShippedRecipes, GiveNoWarning) {
  const std::filesystem::path folder = std::filesystem::path(SCARP_SOURCE_DIR) / GetParam();
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".toml") continue;
    EXPECT_THAT(read_recipe(recipe_in(entry.path())).warnings, IsEmpty()) << entry.path();
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedRecipes, ::testing::Values("configs", "tests/regression"),
                         [](const auto& test) {
                           return test.param == "configs" ? "Configs" : "Regression";
                         });

}  // namespace
}  // namespace scarp

#include "core/recipe/recipe_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>

#include "core/error.h"
#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

using testing::ElementsAre;

enum class Method { paper, length };
const Choices<Method> methods{{"paper", Method::paper}, {"length", Method::length}};

/// All errors that reading a recipe ends with; empty if there are none.
std::string errors(const RecipeSource& source,
                   const std::function<void(const RecipeTable&)>& read) {
  try {
    RecipeFile file(source);
    read(file.root());
    file.finish();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string errors(std::string_view text, const std::function<void(const RecipeTable&)>& read,
                   const std::vector<std::string>& overrides = {}) {
  return errors({std::string(text), "r.toml", overrides}, read);
}

void read_spacing(const RecipeTable& root) {
  root.table("domain").length("spacing", {.minimum = 0, .exclusive = true});
}

void read_sticking(const RecipeTable& root) {
  for (const RecipeTable& step : root.tables("step")) step.fraction("sticking");
}

TEST(RecipeTable, GivesValuesInTheUnitOfTheInside) {
  const RecipeFile file({R"(
title = "a trench"
[domain]
spacing = "0.1 um"
extent = ["10 um", "8 um"]
sides = ["length", "paper"]
[flux]
rays = 1e6
seed = 7
exact = true
part = 1
[[step]]
duration = "1.6 min"
tilt = "90 deg"
rate = "6 um/min"
energy = "100 eV"
)",
                         "r.toml"});
  const RecipeTable root = file.root();
  EXPECT_EQ(root.text("title"), "a trench");
  const RecipeTable domain = root.table("domain");
  EXPECT_EQ(domain.length("spacing"), 100);
  EXPECT_THAT(domain.quantities("extent", Dimension::length, {2, 2}), ElementsAre(10000, 8000));
  EXPECT_THAT(domain.choices<Method>("sides", methods, {2, 2}),
              ElementsAre(Method::length, Method::paper));
  const RecipeTable flux = root.table("flux");
  EXPECT_EQ(flux.integer("rays"), 1000000);
  EXPECT_EQ(flux.integer("seed"), 7);
  EXPECT_TRUE(flux.flag("exact"));
  EXPECT_EQ(flux.fraction("part"), 1);
  ASSERT_EQ(root.tables("step").size(), 1U);
  const RecipeTable step = root.tables("step")[0];
  EXPECT_EQ(step.time("duration"), 96);
  EXPECT_DOUBLE_EQ(step.angle("tilt"), std::numbers::pi / 2);
  EXPECT_EQ(step.rate("rate"), 100);
  EXPECT_EQ(step.energy("energy"), 100);
  EXPECT_EQ(step.path(), "step[0]");
  file.finish();
}

TEST(RecipeTable, GivesTheFallbackOfWhatIsNotThere) {
  const RecipeFile file({"[domain]\n", "r.toml"});
  const RecipeTable table = file.root().table("simplify");
  EXPECT_EQ(table.number("l0", {.fallback = "0.6"}), 0.6);
  EXPECT_EQ(table.angle("taper", {.fallback = "0 deg"}), 0);
  EXPECT_EQ(table.choice<Method>("method", methods, "length"), Method::length);
  EXPECT_TRUE(table.flag("enabled", true));
  EXPECT_EQ(table.text("name", "none"), "none");
  EXPECT_EQ(table.integer("seed", {.fallback = "1"}), 1);
  EXPECT_THAT(table.quantities("origin", Dimension::length, {2, 2}, {.fallback = "0 nm"}),
              ElementsAre(0, 0));
  EXPECT_THAT(table.choices<Method>("sides", methods, {1, 2}, "paper"),
              ElementsAre(Method::paper, Method::paper));
  EXPECT_TRUE(file.root().tables("step").empty());
  file.root().table("domain");
  file.finish();
}

TEST(RecipeTable, CountsLengthsInAGivenUnitOrTakesThemWithTheirOwn) {
  const RecipeFile file({"a = 0.6\nb = \"30 nm\"\n", "r.toml"});
  EXPECT_EQ(file.root().length_or_multiple("a", 50), 30);
  EXPECT_EQ(file.root().length_or_multiple("b", 50), 30);
  EXPECT_EQ(file.root().length_or_multiple("c", 50, {.fallback = "2"}), 100);
  file.finish();
  EXPECT_EQ(errors("a = \"300 nm\"",
                   [](const RecipeTable& root) {
                     root.length_or_multiple("a", 100, {.minimum = 0, .maximum = 2});
                   }),
            "r.toml:1:5: a: \"300 nm\", 3 times 100 nm, is outside [0, 2]");
}

TEST(RecipeTable, ReadsATruthOrAWord) {
  const RecipeFile file({"a = true\nb = \"auto\"\nd = false\n", "r.toml"});
  const RecipeTable root = file.root();
  EXPECT_EQ(root.flag_or("auto", "a", false), true);
  EXPECT_EQ(root.flag_or("auto", "b", false), std::nullopt);
  EXPECT_EQ(root.flag_or("auto", "c", true), true);
  EXPECT_EQ(root.flag_or("auto", "d", true), false);
  EXPECT_EQ(file.resolved(), "a = true\nb = \"auto\"\nc = true\nd = false\n");
  EXPECT_EQ(
      errors("a = \"yes\"\n", [](const RecipeTable& table) { table.flag_or("auto", "a", false); }),
      "r.toml:1:5: a: \"yes\" is not true, false or \"auto\"");
  EXPECT_EQ(errors("[t]\n", [](const RecipeTable& table) { table.table("t").flag("on"); }),
            "r.toml:1:1: t.on: missing; write true or false");
}

TEST(RecipeTable, ReadsListsOfMaterials) {
  const Materials materials;
  const RecipeFile file({"a = [\"SiO2\", \"Si\"]\n", "r.toml"});
  const RecipeTable root = file.root();
  EXPECT_THAT(root.material_list("a", materials),
              ElementsAre(materials.id("SiO2"), materials.id("Si")));
  EXPECT_THAT(root.material_list("b", materials, {}, "[\"W\", \"Si\"]"),
              ElementsAre(materials.id("W"), materials.id("Si")));
  EXPECT_EQ(file.resolved(), "a = [\"SiO2\", \"Si\"]\nb = [\"W\", \"Si\"]\n");
  EXPECT_EQ(
      errors("[t]\n",
             [&](const RecipeTable& table) { table.table("t").material_list("a", materials); }),
      "r.toml:1:1: t.a: missing; write for example a = [\"Si\"]");
}

TEST(RecipeTable, KnowsItsKeys) {
  const RecipeFile file({"[t]\nb = 1\na = 2\n", "r.toml"});
  EXPECT_THAT(file.root().table("t").keys(), ElementsAre("b", "a"));
  EXPECT_TRUE(file.root().table("absent").keys().empty());
}

// The kinds of bad input, in the words that users see.

TEST(RecipeErrors, MissingUnit) {
  EXPECT_EQ(errors("[domain]\nspacing = \"5\"\n", read_spacing),
            "r.toml:2:11: domain.spacing: \"5\" has no unit; write for example \"5 nm\"");
  EXPECT_EQ(errors("[domain]\nspacing = 10\n", read_spacing),
            "r.toml:2:11: domain.spacing: 10 has no unit; write for example \"10 nm\"");
}

TEST(RecipeErrors, WrongUnit) {
  EXPECT_EQ(errors("[domain]\nspacing = \"5 s\"\n", read_spacing),
            "r.toml:2:11: domain.spacing: \"5 s\" is a time; a length is wanted, in nm or um");
}

TEST(RecipeErrors, UnknownKey) {
  EXPECT_EQ(errors("[domain]\nspacing = \"5 nm\"\nspaccing = \"5 nm\"\n", read_spacing),
            "r.toml:3:1: domain.spaccing: unknown key (did you mean spacing?)");
  EXPECT_EQ(errors("[domain]\nspacing = \"5 nm\"\n  colour = 1\n", read_spacing),
            "r.toml:3:3: domain.colour: unknown key; known here: spacing");
  EXPECT_EQ(errors("[domain]\nspacing = \"5 nm\"\n[doman]\nx = 1\n", read_spacing),
            "r.toml:3:2: doman: unknown key (did you mean domain?)");
}

TEST(RecipeErrors, MisspeltKeyIsNotReportedAsMissingAsWell) {
  EXPECT_EQ(errors("[domain]\nspaccing = \"5 nm\"\n", read_spacing),
            "r.toml:2:1: domain.spaccing: unknown key (did you mean spacing?)");
}

TEST(RecipeErrors, MissingKeyPointsAtItsTable) {
  EXPECT_EQ(errors("title = 1\n\n[domain]\n",
                   [](const RecipeTable& root) {
                     read_spacing(root);
                     root.number("title");
                   }),
            "r.toml:3:1: domain.spacing: missing; write for example spacing = \"5 nm\"");
  EXPECT_EQ(errors("[[step]]\nsticking = 1\n[[step]]\n", read_sticking),
            "r.toml:3:1: step[1].sticking: missing; write for example sticking = 1");
  EXPECT_EQ(errors("x = 1\n",
                   [](const RecipeTable& root) {
                     root.number("x");
                     read_spacing(root);
                   }),
            "r.toml:1:1: domain.spacing: missing; write for example spacing = \"5 nm\"");
}

// The example has as many entries as are wanted at least.
TEST(RecipeErrors, MissingListIsShownWithAnExample) {
  const auto message = [](ListSize size) {
    return errors("x = 1\n", [&](const RecipeTable& root) {
      root.number("x");
      root.quantities("extent", Dimension::length, size);
    });
  };
  const std::string missing = "r.toml:1:1: extent: missing; write for example extent = ";
  EXPECT_EQ(message({1, 3}), missing + R"(["5 nm"])");
  EXPECT_EQ(message({2, 2}), missing + R"(["5 nm", "5 nm"])");
}

TEST(RecipeErrors, MissingMaterialIsTheFirstOneForWhatIsReadOn) {
  const Materials materials;
  EXPECT_EQ(errors("x = 1\n",
                   [&](const RecipeTable& root) {
                     root.number("x");
                     EXPECT_EQ(root.material("of", materials), materials.id("Si"));
                   }),
            "r.toml:1:1: of: missing; write for example of = \"Si\"");
}

TEST(RecipeErrors, ControlCharacters) {
  EXPECT_EQ(errors("title = \"a\\u0001\"\n", [](const RecipeTable& root) { root.text("title"); }),
            "r.toml:1:9: title: \"a\\x01\" has a control character; leave it out");
}

TEST(RecipeErrors, WrongType) {
  const auto read = [](const RecipeTable& root) {
    root.length("a");
    root.number("b");
    root.text("c");
    root.flag("d");
    root.integer("e");
    root.quantities("f", Dimension::length, {2, 2});
    root.table("g");
    root.tables("h");
    root.tables("i");
    root.quantities("j", Dimension::length, {1, 2});
    root.number("k");
    root.length("l");
  };
  EXPECT_EQ(errors(R"(a = true
b = "0.1"
c = 5
d = "yes"
e = 1.5
f = "5 nm"
g = 5
h = {}
i = "x"
j = ["1 nm", "2 nm", "3 nm"]
k = 2026-01-01
l = ["5 nm"]
)",
                   read),
            R"(r.toml:1:5: a: true is not a length; write for example "5 nm"
r.toml:2:5: b: "0.1" is a text; a number is wanted, for example 1
r.toml:3:5: c: 5 is not a text; write it in quotes
r.toml:4:5: d: "yes" is not true or false
r.toml:5:5: e: 1.5 is not a whole number
r.toml:6:5: f: "5 nm" is not a list; write it in brackets, [...]
r.toml:7:5: g: 5 is not a table
r.toml:8:5: h: is one table; write [[h]]
r.toml:9:5: i: "x" is not a table; write [[i]]
r.toml:10:5: j: has 3 entries; 1 to 2 are wanted
r.toml:11:5: k: a date or a time of day is not a number; write for example 1
r.toml:12:5: l: a list is not a length; write for example "5 nm")");
}

TEST(RecipeTable, AWordStandsForNoneOrForAllMaterials) {
  const Materials materials;
  const RecipeFile file(
      {"a = \"Si\"\nb = \"surface\"\nd = [\"Si\", \"W\"]\ne = \"all\"\n", "r.toml"});
  EXPECT_EQ(file.root().material_or("surface", "a", materials), materials.id("Si"));
  EXPECT_EQ(file.root().material_or("surface", "b", materials), std::nullopt);
  EXPECT_EQ(file.root().material_or("surface", "c", materials), std::nullopt);
  EXPECT_EQ(file.root().material_list_or("all", "d", materials).size(), 2U);
  EXPECT_TRUE(file.root().material_list_or("all", "e", materials).empty());
  EXPECT_TRUE(file.root().material_list_or("all", "f", materials).empty());
  EXPECT_NO_THROW(file.finish());
  EXPECT_EQ(file.resolved(),
            "a = \"Si\"\nb = \"surface\"\nc = \"surface\"\nd = [\"Si\", \"W\"]\ne = \"all\"\n"
            "f = \"all\"\n");
}

TEST(RecipeTable, AMissingArrayOfTablesMayHaveOneEntryOfFallbacks) {
  const RecipeFile file({"[[a]]\nx = 1\n[[a]]\nx = 2\n", "r.toml"});
  EXPECT_EQ(file.root().tables_or_one("a").size(), 2U);
  const auto one = file.root().tables_or_one("b");
  ASSERT_EQ(one.size(), 1U);
  EXPECT_EQ(one[0].number("x", {.fallback = "3"}), 3);
  EXPECT_THAT(file.resolved(), ::testing::HasSubstr("[[b]]\nx = 3\n"));
}

TEST(RecipeTable, WritesTheHeaderOfAnInnerTableAsTomlHasIt) {
  const std::string message = errors("[[step]]\nbeam = { tilt = \"10 deg\" }\n", [](RecipeTable t) {
    for (const RecipeTable& beam : t.tables("step")[0].tables("beam")) beam.angle("tilt");
  });
  EXPECT_EQ(message, "r.toml:2:8: step[0].beam: is one table; write [[step.beam]]");
}

TEST(RecipeErrors, NotANumberAndInfinity) {
  EXPECT_EQ(errors("[[step]]\nsticking = nan\n[[step]]\nsticking = -inf\n", read_sticking),
            "r.toml:2:12: step[0].sticking: nan is not a finite number\n"
            "r.toml:4:12: step[1].sticking: -inf is not a finite number");
  EXPECT_EQ(errors("[domain]\nspacing = \"inf nm\"\n", read_spacing),
            "r.toml:2:11: domain.spacing: \"inf nm\" is not a length; write for example \"5 nm\"");
  EXPECT_EQ(errors("[domain]\nspacing = nan\n", read_spacing),
            "r.toml:2:11: domain.spacing: nan is not a length; write for example \"5 nm\"");
}

TEST(RecipeErrors, OutOfRange) {
  EXPECT_EQ(errors("[[step]]\nsticking = 1.5\n", read_sticking),
            "r.toml:2:12: step[0].sticking: 1.5 is outside [0, 1]");
  EXPECT_EQ(errors("[domain]\nspacing = \"0 nm\"\n", read_spacing),
            "r.toml:2:11: domain.spacing: \"0 nm\" is not above 0");
  EXPECT_EQ(
      errors("a = \"-1 um/min\"", [](const RecipeTable& root) { root.rate("a", {.minimum = 0}); }),
      "r.toml:1:5: a: \"-1 um/min\" is below 0");
  EXPECT_EQ(
      errors("rays = 0", [](const RecipeTable& root) { root.integer("rays", {.minimum = 1}); }),
      "r.toml:1:8: rays: 0 is below 1");
  EXPECT_EQ(errors("a = \"2 rad\"",
                   [](const RecipeTable& root) {
                     root.angle("a", {.minimum = 0, .maximum = 1.5, .exclusive = true});
                   }),
            "r.toml:1:5: a: \"2 rad\" is outside (0, 1.5 rad)");
}

TEST(RecipeErrors, WrongChoice) {
  EXPECT_EQ(
      errors("method = \"papr\"",
             [](const RecipeTable& root) { root.choice<Method>("method", methods, "paper"); }),
      "r.toml:1:10: method: \"papr\" is not one of paper, length (did you mean paper?)");
  EXPECT_EQ(errors("x = [\"paper\", \"z\"]",
                   [](const RecipeTable& root) { root.choices<Method>("x", methods); }),
            "r.toml:1:15: x[1]: \"z\" is not one of paper, length");
}

TEST(RecipeErrors, AreAllSaidAtOnceByLine) {
  const auto read = [](const RecipeTable& root) {
    read_sticking(root);
    read_spacing(root);
    for (const RecipeTable& shape : root.tables("geometry")) {
      shape.angle("taper", {.fallback = "0 deg"});
    }
  };
  EXPECT_EQ(errors(R"([domain]
spacing = "5"
[[geometry]]
[[geometry]]
taper = "5 nm"
[[step]]
sticking = 2
typo = 1
)",
                   read),
            R"(r.toml:2:11: domain.spacing: "5" has no unit; write for example "5 nm"
r.toml:5:9: geometry[1].taper: "5 nm" is a length; an angle is wanted, in deg or rad
r.toml:7:12: step[0].sticking: 2 is outside [0, 1]
r.toml:8:1: step[0].typo: unknown key; known here: sticking)");
}

TEST(RecipeErrors, NamePlacesInNestedSteps) {
  EXPECT_EQ(errors(R"([[step]]
sticking = 1
[[step]]
[[step.step]]
sticking = 3
)",
                   [](const RecipeTable& root) {
                     const auto steps = root.tables("step");
                     steps.at(0).fraction("sticking");
                     steps.at(1).tables("step").at(0).fraction("sticking");
                   }),
            "r.toml:5:12: step[1].step[0].sticking: 3 is outside [0, 1]");
}

TEST(RecipeErrors, OfTheReaderStandAtTheirKey) {
  EXPECT_EQ(errors("[domain]\nspacing = \"5 nm\"\nextent = [\"1 um\",\n  \"3 nm\"]\n",
                   [](const RecipeTable& root) {
                     const RecipeTable domain = root.table("domain");
                     read_spacing(root);
                     domain.quantities("extent", Dimension::length);
                     EXPECT_TRUE(domain.ok());
                     domain.error("extent[1]", "is thinner than two cells");
                     domain.error("", "is wrong");
                     domain.error("boundary", "is not there");
                     EXPECT_FALSE(domain.ok("extent"));
                     EXPECT_TRUE(domain.ok("spacing"));
                     EXPECT_TRUE(root.ok("step"));
                     EXPECT_FALSE(root.ok());
                   }),
            "r.toml:1:1: domain: is wrong\n"
            "r.toml:1:1: domain.boundary: is not there\n"
            "r.toml:4:3: domain.extent[1]: is thinner than two cells");
}

TEST(RecipeErrors, AReaderThatGivesUpLeavesTheRest) {
  EXPECT_EQ(errors("[[step]]\nmodel = 1\nrate = 2\n",
                   [](const RecipeTable& root) {
                     const RecipeTable step = root.tables("step").at(0);
                     step.text("model");
                     step.accept_rest();
                   }),
            "r.toml:2:9: step[0].model: 1 is not a text; write it in quotes");
}

TEST(RecipeErrors, LetTheReaderGoOnWithAnAllowedValue) {
  const RecipeFile file({"a = 7\nb = \"x\"", "r.toml"});
  const RecipeTable root = file.root();
  EXPECT_EQ(root.number("a", {.fallback = "0.5", .maximum = 1}), 0.5);
  EXPECT_EQ(root.number("a", {.minimum = 8, .maximum = 10}), 9);
  EXPECT_GT(root.length("b", {.minimum = 5, .exclusive = true}), 5);
  EXPECT_LT(root.length("b", {.maximum = -5, .exclusive = true}), -5);
  EXPECT_EQ(root.quantities("c", Dimension::length, {2, 2}).size(), 2U);
  EXPECT_FALSE(file.ok());
}

TEST(RecipePerMaterial, TakesOneValueOrATable) {
  const Materials materials;
  const MaterialId si = materials.id("Si");
  const MaterialId oxide = materials.id("SiO2");
  const std::vector<MaterialId> reachable{si, oxide};
  const MaterialScope scope{materials, reachable};
  const RecipeFile file({R"(one = "2 nm/s"
all = { Si = "1 nm/s", default = "3 nm/s" }
listed = { Si = "1 nm/s", SiO2 = "0 nm/s" }
)",
                         "r.toml"});
  const RecipeTable root = file.root();
  const auto one = root.per_material("one", Dimension::rate, scope);
  EXPECT_EQ(one.size(), materials.size());
  EXPECT_EQ(one[oxide], 2);
  const auto all = root.per_material("all", Dimension::rate, scope);
  EXPECT_EQ(all[si], 1);
  EXPECT_EQ(all[oxide], 3);
  EXPECT_EQ(root.per_material("listed", Dimension::rate, scope)[oxide], 0);
  EXPECT_EQ(root.per_material("none", Dimension::rate, scope, {.fallback = "4 nm/s"})[si], 4);
  file.finish();
  EXPECT_EQ(file.resolved(), R"(one = "2 nm/s"
all = { Si = "1 nm/s", default = "3 nm/s" }
listed = { Si = "1 nm/s", SiO2 = "0 nm/s" }
none = "4 nm/s"
)");
}

TEST(RecipePerMaterial, SaysWhichMaterialIsWrong) {
  const Materials materials;
  const std::vector<MaterialId> reachable{materials.id("Si"), materials.id("SiO2")};
  const auto read = [&](const RecipeTable& root) {
    root.per_material("rate", Dimension::rate, {materials, reachable}, {.minimum = 0});
  };
  EXPECT_EQ(errors("rate = { Si = \"1 nm/s\" }", read),
            "r.toml:1:8: rate: no value for SiO2, which this step can reach; add it, or default = "
            "...");
  EXPECT_EQ(errors("rate = { default = \"1 nm/s\", Si02 = \"1 nm/s\" }", read),
            "r.toml:1:30: rate.Si02: is not a material (did you mean SiO2?)");
  EXPECT_EQ(errors("[rate]\ndefault = \"-1 nm/s\"\n", read),
            "r.toml:2:11: rate.default: \"-1 nm/s\" is below 0");
  EXPECT_EQ(errors("rate = { default = 5 }", read),
            "r.toml:1:20: rate.default: 5 has no unit; write for example \"5 nm/s\"");
  EXPECT_THAT(errors("material = \"Sii\"",
                     [&](const RecipeTable& root) { root.material("material", materials); }),
              testing::HasSubstr("r.toml:1:12: material: there is no material \"Sii\" (did you "
                                 "mean Si?)"));
}

TEST(RecipeTable, PolygonsAreOneListOfPointsOrAListOfSuchLists) {
  const RecipeFile file({
      R"(one = [["0 um", "0 nm"], ["1 um", "0 nm"], ["1 um", "2 um"]]
two = [[["0 nm", "0 nm"], ["1 nm", "0 nm"], ["0 nm", "1 nm"]],
       [["5 nm", "5 nm"], ["6 nm", "5 nm"], ["6 nm", "6 nm"], ["5 nm", "6 nm"]]]
)",
      "r.toml"});
  const auto one = file.root().polygons("one");
  ASSERT_EQ(one.size(), 1U);
  ASSERT_EQ(one[0].size(), 3U);
  EXPECT_EQ(one[0][2], (std::array<double, 2>{1000, 2000}));
  const auto two = file.root().polygons("two");
  ASSERT_EQ(two.size(), 2U);
  EXPECT_EQ(two[1].size(), 4U);
  EXPECT_EQ(two[1][1], (std::array<double, 2>{6, 5}));
  file.finish();
  const RecipeFile again({file.resolved(), "again.toml"});
  EXPECT_EQ(again.root().polygons("two"), two);
}

TEST(RecipeTable, PolygonsThatAreNoneNameThePlace) {
  const RecipeFile file({
      R"(few = [["0 um", "0 nm"], ["1 um", "0 nm"]]
flat = [["0 um", "0 nm"], ["1 um", "0 nm", "2 nm"], ["1 um", "2 um"]]
bare = [["0 um", 7], ["1 um", "0 nm"], ["1 um", "2 um"]]
)",
      "r.toml"});
  for (const char* key : {"few", "flat", "bare", "absent"}) file.root().polygons(key);
  try {
    file.finish();
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("few: has 2 entries; 3 or more are wanted"));
    EXPECT_THAT(error.what(), testing::HasSubstr("flat[1]: has 3 entries; 2 are wanted"));
    EXPECT_THAT(error.what(), testing::HasSubstr("bare[0][1]: 7 has no unit"));
    EXPECT_THAT(error.what(), testing::HasSubstr("absent: missing"));
  }
}

TEST(RecipeTable, CornersOfARectangleAreTheLowerLeftAndTheUpperRightOne) {
  const RecipeFile file({R"(right = [["-1 um", "0 nm"], ["1 um", "2 um"]])", "r.toml"});
  EXPECT_EQ(file.root().corners("right"),
            (std::array<std::array<double, 2>, 2>{{{-1000, 0}, {1000, 2000}}}));
  for (const char* wrong :
       {R"([["1 um", "0 nm"], ["1 um", "2 um"]])", R"([["0 um", "2 um"], ["1 um", "2 um"]])"}) {
    EXPECT_THAT(
        errors(std::string("c = ") + wrong, [](const RecipeTable& root) { root.corners("c"); }),
        testing::HasSubstr("c: the first corner has to lie below and left"))
        << wrong;
  }
}

const std::array yields{Column{"energy", Dimension::energy, {.minimum = 0}},
                        Column{"angle", Dimension::angle},
                        Column{"yield", Dimension::number, {.minimum = 0}}};

TEST(RecipeNumberTable, IsAListOfRowsOrACsvFileOfTheSame) {
  const TemporaryFolder folder;
  std::ofstream(folder / "y.csv") << "# measured\n energy [keV], angle [deg], yield [atoms/ion]\n"
                                     "0.02,0,0\n0.02,90,1.5\n\n0.1,0,2e-1\n";
  const RecipeFile file({.text = R"(file = "y.csv"
list = [["20 eV", "0 deg", 0], ["20 eV", "90 deg", 1.5], ["100 eV", "0 deg", 0.2]]
)",
                         .folder = folder});
  const auto list = file.root().number_table("list", yields);
  const auto csv = file.root().number_table("file", yields);
  EXPECT_FALSE(file.root().number_table("absent", yields).has_value());
  ASSERT_TRUE(list && csv);
  EXPECT_EQ(csv->values, list->values);
  EXPECT_THAT(list->column(0), ElementsAre(20, 20, 100));
  EXPECT_DOUBLE_EQ(list->values[1][1], std::numbers::pi / 2);
  file.finish();
  // The resolved recipe needs no file.
  const RecipeFile again({file.resolved(), "again.toml"});
  EXPECT_EQ(again.root().number_table("file", yields)->values, list->values);
  EXPECT_EQ(csv_head(yields), "energy [eV],angle [deg],yield");
}

TEST(RecipeNumberTable, SaysWhichRowIsWrong) {
  const auto expect = [](const std::string& value, const std::string& message) {
    EXPECT_EQ(
        errors("t = " + value, [](const RecipeTable& root) { root.number_table("t", yields); }),
        message.empty() ? "" : "r.toml:1:" + message)
        << value;
  };
  const std::string first = "[\"20 eV\", \"0 deg\", 0]";
  expect('[' + first + ", [\"20 eV\", \"1 deg\", 0]]", "");
  expect("7", "5: t: 7 is not a table; write its rows, [[...], [...]], or the name of a CSV file");
  expect("[]", "5: t: has 0 entries; 2 to 100000 are wanted");
  expect('[' + first + "]", "5: t: has 1 entry; 2 to 100000 are wanted");
  expect('[' + first + ", [\"20 eV\", 0]]", "29: t[1]: has 2 entries; 3 are wanted");
  expect('[' + first + ", [30, \"0 deg\", 0]]",
         "30: t[1][0]: 30 has no unit; write for example \"30 eV\"");
  expect('[' + first + ", [\"30 eV\", \"0 deg\", -1]]", "48: t[1][2]: -1 is below 0");
  expect('[' + first + ", [\"20 eV\", \"0 deg\", 1]]",
         "29: t[1]: rows have to ascend by energy, then by angle");
  expect('[' + first + ", [\"19 eV\", \"1 deg\", 1]]",
         "29: t[1]: rows have to ascend by energy, then by angle");
}

TEST(RecipeNumberTable, SaysWhichLineOfAFileIsWrong) {
  const auto expect = [&](const std::string& csv, const std::string& message) {
    const RecipeSource source{.text = "t = \"y.csv\"",
                              .name = "r.toml",
                              .load_file = [&](const std::string&) { return csv; }};
    const std::string said = errors(source, [&](const RecipeTable& root) {
      const auto table = root.number_table("t", yields);
      if (table) root.row_error("t", *table, 1, "is not liked");
    });
    EXPECT_EQ(said, "r.toml:1:5: t: y.csv:" + message) << csv;
  };
  const std::string head = "energy [eV],angle [deg],yield\n";
  const std::string names = "1: has to name the columns: \"energy [eV],angle [deg],yield\"";
  expect("", names);
  expect("20,0,1\n30,0,1\n", names + "; it is \"20,0,1\"");
  expect("angle [deg],energy [eV],yield\n20,0,1\n",
         names + "; it is \"angle [deg],energy [eV],yield\"");
  expect(
      "energy,angle [deg],yield\n",
      "1: gives no unit for energy; write \"energy [eV],angle [deg],yield\", with the units that "
      "the numbers below have");
  expect("energy [V],angle [deg],yield\n",
         "1: \"1 V\": \"V\" is not a unit; write it in eV or keV");
  expect(head, " has 0 rows of numbers; 2 to 100000 are wanted");
  expect(head + "20,0,1\n", " has 1 row of numbers; 2 to 100000 are wanted");
  expect(head + "20,0,1\n\n30,0\n", "4: has 2 columns; 3 are wanted");
  expect(head + "20,0,1\n30,0,nan\n", "3: \"nan\" is not a number; write for example \"5\"");
  expect(head + "20,0,1\n-30,0,1\n", "3: -30 eV is below 0");
  expect(head + "20,0,1\n20,0,1\n", "3: rows have to ascend by energy, then by angle");
  expect(head + "20,0,1\n\n30,0,1\n", "4: is not liked");
  EXPECT_THAT(
      errors("t = \"none.csv\"", [](const RecipeTable& root) { root.number_table("t", yields); }),
      testing::HasSubstr("t: none.csv: cannot be read: No such file"));
}

TEST(RecipePerMaterial, TakesNoEmptyTexts) {
  const Materials materials;
  const std::vector<MaterialId> reachable{materials.id("Si")};
  const auto message = [&](const std::string& text) {
    const RecipeFile file({text, "r.toml"});
    file.root().per_material_text("rate", {materials, reachable});
    try {
      file.finish();
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_EQ(message("rate = \"a\"\n"), "no error");
  EXPECT_EQ(message("rate = \"\"\n"), "r.toml:1:8: rate: is empty");
  EXPECT_EQ(message("rate = { Si = \"a\", default = \"\" }\n"),
            "r.toml:1:30: rate.default: is empty");
}

}  // namespace
}  // namespace scarp

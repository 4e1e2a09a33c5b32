// docs/recipe.md and docs/models.md against the program: every key and every default that a recipe
// is read with stands there, and no other.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "apps/simulator/recipe.h"
#include "apps/simulator/recipe_geometry.h"
#include "core/recipe/recipe_table.h"
#include "core/system/temporary_folder.h"
#include "models/registry.h"
#include "tests/apps/reference_page.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;

namespace fs = std::filesystem;

constexpr std::size_t default_column = 2;

/// The defaults of the keys that all recipes share, and of those of models.
Keys reference() { return reference_page("recipe.md", default_column); }
Keys models_reference() { return reference_page("models.md", default_column); }

/// The values of a recipe of one table per kind.
Keys tables_of(const std::string& toml) {
  Keys tables;
  std::string table = "Top level";
  std::istringstream in(toml);
  for (std::string line; std::getline(in, line);) {
    if (line.rfind('[', 0) == 0) {
      table = line;
    } else if (const auto equals = line.find(" = "); equals != std::string::npos) {
      tables[table][line.substr(0, equals)] = line.substr(equals + 3);
    }
  }
  return tables;
}

/// A key with its default in the reference, when the recipe did not give it.
void expect_described(const std::map<std::string, std::string>& section, const std::string& key,
                      const std::string& value, bool was_given) {
  const auto row = section.find(key);
  ASSERT_NE(row, section.end()) << key << " is missing";
  if (!was_given) {
    EXPECT_THAT(row->second, HasSubstr('`' + value + '`')) << key;
  }
}

constexpr const char* smallest_recipe = R"(title = "t"

[domain]
spacing = "10 nm"
extent = ["100 nm", "100 nm"]

[[geometry]]
shape = "wafer"
material = "Si"

[[step]]
model = "isotropic"
name = "isotropic"
duration = "1 s"
etch_rate = "1 nm/s"
)";

std::string resolved(const std::string& text) {
  const TemporaryFolder folder;
  const fs::path file = folder / "recipe.toml";
  std::ofstream(file) << text;
  return read_recipe(recipe_in(file)).resolved;
}

TEST(RecipeReference, HasTheKeysAndDefaultsOfEveryTable) {
  const Keys sections = reference();
  const Keys given = tables_of(smallest_recipe);
  Keys known = tables_of(resolved(smallest_recipe));
  known.erase("[[geometry]]");
  known.erase("[[step]]");
  EXPECT_EQ(known.size(), 7U);
  known["Top level"]["start"] = "none";
  known["[domain]"]["cut"] = "none";
  known["[flux]"]["rays"] = "none";
  known["[flux]"]["position_error"] = "none";
  known["[output]"]["sections"] = "none";
  known["[metrology]"]["cd_at"] = "none";
  known["[metrology]"]["angle_at"] = "none";
  for (const auto& [table, keys] : known) {
    SCOPED_TRACE(table);
    ASSERT_TRUE(sections.contains(table));
    for (const auto& [key, value] : keys) {
      const bool was_given = given.contains(table) && given.at(table).contains(key);
      expect_described(sections.at(table), key, value, was_given || value == "none");
    }
    EXPECT_EQ(keys_of(sections.at(table)), keys_of(keys));
  }
}

/// A shape, its section in the reference, and how it is written.
struct ShapeKeys {
  const char* section;
  std::vector<std::string> texts;
};

/// A mask whose inner table, opening or resist, is the shape.
std::string mask(const std::string& table, const std::string& shape) {
  return "shape = \"mask\"\nmaterial = \"resist\"\nthickness = \"1 um\"\n[geometry." + table +
         "]\n" + shape;
}

const std::vector<ShapeKeys> shapes{
    {"wafer", {"shape = \"wafer\"\nmaterial = \"Si\"\n"}},
    {"layer", {"shape = \"layer\"\nmaterial = \"Si\"\nthickness = \"1 um\"\n"}},
    {"stack", {"shape = \"stack\"\nmaterials = [\"Si\"]\nthicknesses = [\"1 um\"]\n"}},
    {"trench",
     {"shape = \"trench\"\nwidth = \"1 um\"\ndepth = \"1 um\"\npitch = \"2 um\"\n",
      "shape = \"hole\"\nradius = \"1 um\"\ndepth = \"1 um\"\npitch = [\"2 um\", \"2 um\"]\n"}},
    {"fin",
     {"shape = \"fin\"\nmaterial = \"Si\"\nwidth = \"1 um\"\nheight = \"1 um\"\npitch = \"2 "
      "um\"\n"}},
    {"mask",
     {mask("opening", "shape = \"trench\"\nwidth = \"1 um\"\npitch = \"2 um\"\n"),
      mask("resist", "shape = \"hole\"\nradius = \"1 um\"\npitch = [\"2 um\", \"2 um\"]\n"),
      mask("resist", "shape = \"rectangle\"\nsize = [\"1 um\", \"1 um\"]\n"),
      mask("resist",
           "shape = \"polygon\"\n"
           "points = [[\"0 um\", \"0 um\"], [\"1 um\", \"0 um\"], [\"0 um\", \"1 um\"]]\n"),
      mask("resist", "shape = \"gds\"\nfile = \"none.gds\"\nlayer = 1\ndatatype = 0\n"),
      mask("resist",
           "shape = \"gds\"\nfile = \"none.gds\"\nlayers = \"1 + 2\"\n"
           "center = [\"0 um\", \"0 um\"]\n"),
      mask("resist",
           "shape = \"gds\"\nfile = \"none.gds\"\nlayers = \"1 + 2\"\n"
           "window = [[\"0 um\", \"0 um\"], [\"1 um\", \"1 um\"]]\n")}},
    {"mesh",
     {"shape = \"mesh\"\nfile = \"none.stl\"\nmaterial = \"Si\"\nsection = \"y = 0 nm\"\n"}},
    {"profile",
     {"shape = \"profile\"\nfile = \"none.csv\"\nmaterial = \"Si\"\n",
      "shape = \"profile\"\nmaterial = \"Si\"\n"
      "points = [[\"0 um\", \"0 um\"], [\"1 um\", \"0 um\"], [\"0 um\", \"1 um\"]]\n"}},
};

TEST(RecipeReference, HasTheKeysAndDefaultsOfEveryShape) {
  Keys sections = reference();
  EXPECT_EQ(keys_of(sections["[[geometry]]"]), std::set<std::string>{"shape"});
  sections["trench"].merge(sections["hole"]);
  for (const ShapeKeys& shape : shapes) {
    SCOPED_TRACE(shape.section);
    std::set<std::string> read{"shape"};
    sections[shape.section].emplace("shape", "");
    for (const std::string& text : shape.texts) {
      const RecipeFile file({"[[geometry]]\n" + text, "r.toml"});
      read_geometry(file.root().tables("geometry"), {Materials(), Frame{}});
      const Keys given = tables_of("[[geometry]]\n" + text);
      for (const auto& [table, keys] : tables_of(file.resolved())) {
        if (table != "[[geometry]]") read.insert(table.substr(10, table.size() - 11));
        for (const auto& [key, value] : keys) {
          read.insert(key);
          expect_described(sections[shape.section], key, value, given.at(table).contains(key));
        }
      }
    }
    EXPECT_EQ(keys_of(sections[shape.section]), read);
  }
}

// The keys that the ions of several models share stand in a section of their own.
TEST(RecipeReference, HasTheParametersOfEveryModel) {
  const Keys sections = models_reference();
  const auto& of_ions = sections.at("[[step.ion]]");
  for (const ModelDescription& model : models()) {
    SCOPED_TRACE(model.name);
    ASSERT_TRUE(sections.contains(std::string(model.name)));
    const auto& section = sections.at(std::string(model.name));
    std::set<std::string> names;
    for (const Parameter& parameter : model.parameters) {
      const std::string name(parameter.name);
      const std::string inside = name.substr(name.find('.') + 1);
      const bool is_shared = name == "ion." + inside && !section.contains(name);
      if (!is_shared) names.insert(name);
      const auto& rows = is_shared ? of_ions : section;
      const std::string& key = is_shared ? inside : name;
      ASSERT_TRUE(rows.contains(key)) << name;
      EXPECT_THAT(rows.at(key), HasSubstr(default_text(parameter))) << name;
    }
    EXPECT_EQ(keys_of(section), names);
  }
  const ModelDescription& any = *find_model("multi_particle");
  for (const auto& [key, text] : of_ions)
    EXPECT_NE(std::ranges::find(any.parameters, "ion." + key, &Parameter::name),
              any.parameters.end())
        << key;
}

TEST(RecipeReference, HasTheKeysOfSteps) {
  Keys sections = reference();
  sections.at("[[step]]").merge(sections.at("Repeats"));
  EXPECT_EQ(keys_of(sections.at("[[step]]")),
            (std::set<std::string>{"model", "name", "duration", "keep_free", "blanket_rate",
                                   "until", "repeat", "step"}));
  const std::set<std::string> of_until{"depth",    "thickness", "exposed",  "gone",
                                       "material", "at",        "over_etch"};
  EXPECT_EQ(keys_of(sections.at("[step.until]")), of_until);
  EXPECT_THAT(sections.at("[step.until]").at("over_etch"), HasSubstr("`\"0 %\"`"));
  const RecipeFile file({"[until]\ngone = \"Si\"\n", "r.toml"});
  read_end_condition(file.root().table("until"), Materials(), {});
  EXPECT_THAT(file.resolved(), HasSubstr("over_etch = \"0 %\"\n"));
}

TEST(RecipeReference, ListsTheBuiltInMaterials) {
  const std::string text = read_file(fs::path(SCARP_SOURCE_DIR) / "docs/recipe.md");
  const Materials materials;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const Material& material = materials[static_cast<MaterialId>(m)];
    const std::string name = '`' + material.name + "` ";
    const std::size_t at = text.find(name);
    ASSERT_NE(at, std::string::npos) << material.name;
    EXPECT_NEAR(std::strtod(text.c_str() + at + name.size(), nullptr), material.density,
                0.006 * material.density)
        << material.name;
  }
}

}  // namespace
}  // namespace scarp

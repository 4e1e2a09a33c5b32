#include "models/registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "core/error.h"

namespace scarp {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::StartsWith;

TEST(Registry, HasTheModelsOfTheHouse) {
  std::set<std::string_view> names;
  for (const ModelDescription& model : models()) {
    EXPECT_TRUE(names.insert(model.name).second) << model.name;
    EXPECT_EQ(find_model(model.name), &model);
    EXPECT_FALSE(model.summary.empty());
    EXPECT_FALSE(model.equation.empty());
    EXPECT_FALSE(model.limits.empty());
    EXPECT_FALSE(model.source.empty());
  }
  EXPECT_THAT(names, testing::IsSupersetOf({"isotropic", "directional", "single_particle"}));
  EXPECT_EQ(find_model("none"), nullptr);
}

TEST(Registry, DescribesEveryParameterInFull) {
  for (const ModelDescription& model : models()) {
    std::set<std::string_view> names;
    for (const Parameter& parameter : model.parameters) {
      EXPECT_TRUE(names.insert(parameter.name).second) << model.name << ' ' << parameter.name;
      EXPECT_FALSE(parameter.meaning.empty()) << parameter.name;
      EXPECT_FALSE(parameter.source.empty()) << parameter.name;
      EXPECT_FALSE(default_text(parameter).empty()) << parameter.name;
      const std::string_view fallback = parameter.limits.fallback;
      if (fallback.empty() || parameter.kind == Parameter::Kind::flag ||
          parameter.kind == Parameter::Kind::text) {
        continue;
      }
      const double value = parse_quantity(fallback, parameter.dimension);
      EXPECT_GE(value, parameter.limits.minimum) << parameter.name;
      EXPECT_LE(value, parameter.limits.maximum) << parameter.name;
    }
  }
}

TEST(Registry, SuggestsTheModelThatWasMeant) {
  const std::string text = unknown_model_text("single_partcle");
  EXPECT_THAT(text, StartsWith("there is no model \"single_partcle\" (did you mean "
                               "single_particle?); there are "));
  for (const ModelDescription& model : models()) {
    EXPECT_THAT(text.substr(text.find("there are ")), HasSubstr(std::string(model.name)));
  }
}

TEST(Registry, PrintsAPageThatShowsUnitsDefaultsAndRanges) {
  const std::string page = model_page(*find_model("single_particle"));
  EXPECT_THAT(page, HasSubstr("single_particle: one species"));
  EXPECT_THAT(page, HasSubstr("relative to an open flat wafer"));
  EXPECT_THAT(page, ContainsRegex("\n  Limits: Molecules meet walls"));
  EXPECT_THAT(page, ContainsRegex("\n  Source: J. C. Rey"));
  EXPECT_THAT(page, ContainsRegex("sticking +- +1 +\\[0, 1\\] +yes +probability"));
  EXPECT_THAT(page, ContainsRegex("growth_rate +nm/s +this or etch_rate +.0, 1e9 nm/s. +yes"));
  EXPECT_THAT(model_page(*find_model("directional")),
              ContainsRegex("beam.tilt +deg +0 deg +\\[0, 89 deg\\]"));
}

TEST(Registry, SaysHowTheKeysOfInnerTablesAreWritten) {
  EXPECT_THAT(model_page(*find_model("directional")),
              HasSubstr("beam.tilt is the key tilt of a [[step.beam]] table, one for each beam"));
  EXPECT_EQ(model_page(*find_model("isotropic")).find("[[step."), std::string::npos);
}

TEST(Registry, PrintsAllPages) {
  for (const ModelDescription& model : models()) {
    EXPECT_THAT(model_pages(), HasSubstr(model_page(model)));
  }
}

TEST(Registry, WrapsPagesToTheirWidth) {
  const std::string page = model_page(*find_model("single_particle"));
  const std::string prose = page.substr(0, page.find("  parameter "));
  for (std::size_t begin = 0; begin < prose.size();) {
    const std::size_t end = prose.find('\n', begin);
    EXPECT_LE(end - begin, 96U) << prose.substr(begin, end - begin);
    begin = end + 1;
  }
  EXPECT_THAT(prose, HasSubstr("among those that cross"));
}

TEST(Registry, NamesTheModelThatIsWrongAndLeavesItsKeys) {
  const auto errors = [](const std::string& text) -> std::string {
    const RecipeFile file(text, "r.toml");
    const Materials materials;
    EXPECT_EQ(read_model(file.root().tables("step")[0], {materials, {}}).model, nullptr);
    try {
      file.finish();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(errors("[[step]]\nmodel = \"isotropc\"\netch_rate = 1\n"),
            "r.toml:2:9: step[0].model: " + unknown_model_text("isotropc"));
  EXPECT_EQ(errors("[[step]]\nmodel = 5\netch_rate = 1\n"),
            "r.toml:2:9: step[0].model: 5 is not a text; write it in quotes");
  EXPECT_EQ(errors("[[step]]\netch_rate = 1\n"),
            "r.toml:1:1: step[0].model: missing; write model = \"...\"");
}

/// A step with every parameter of a model's page but those of growth, or of etching.
std::string step_with_all(const ModelDescription& model, const std::string& leave_out) {
  std::string keys = "[[step]]\n";
  std::string table = "step";
  for (const Parameter& parameter : model.parameters) {
    const std::string name(parameter.name);
    const bool is_material = parameter.kind == Parameter::Kind::material;
    if (name.find(leave_out) != std::string::npos) continue;
    if (is_material && leave_out == "growth") continue;
    std::string value = is_material ? "\"Si\"" : "1";
    if (parameter.kind == Parameter::Kind::flag) value = "false";
    if (parameter.kind == Parameter::Kind::formula) value = "\"1 nm/s\"";
    const std::size_t dot = name.rfind('.');
    const std::string within = dot == std::string::npos ? "step" : "step." + name.substr(0, dot);
    if (parameter.kind == Parameter::Kind::text) {
      const std::string_view fallback = parameter.limits.fallback;
      value = '"' +
              (fallback.empty() ? within.substr(within.rfind('.') + 1) : std::string(fallback)) +
              '"';
    }
    if (parameter.dimension != Dimension::number) {
      value = '"' + quantity_example(parameter.dimension) + '"';
    }
    if (within != table) keys += "[[" + within + "]]\n";
    table = within;
    keys += name.substr(dot + 1) + " = " + value + '\n';
  }
  return keys;
}

TEST(Registry, ReadsEveryParameterOfItsPage) {
  const Materials materials;
  for (const ModelDescription& model : models()) {
    if (model.acts_at_once) continue;  // those have tests of their own
    for (const std::string leave_out : {"growth", "etch"}) {
      const RecipeFile file(step_with_all(model, leave_out), "r.toml");
      const StepModel step =
          model.read(file.root().tables("step")[0], {materials, {materials.id("Si")}});
      EXPECT_NE(step.model, nullptr);
      EXPECT_FALSE(step.operation.has_value());
      EXPECT_NO_THROW(file.finish()) << model.name;
      EXPECT_EQ(step.deposits.has_value(), leave_out == "etch");
    }
  }
}

}  // namespace
}  // namespace scarp

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
      if (parameter.kind == Parameter::Kind::material_list ||
          parameter.kind == Parameter::Kind::material || fallback.front() == '{') {
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

TEST(UnknownModel, OfAnotherNameOfTheFieldIsOneOfOurs) {
  EXPECT_THAT(unknown_model_text("CMP"), HasSubstr("there is no model \"CMP\"; use planarise"));
  EXPECT_THAT(unknown_model_text("cvd"), HasSubstr("use single_particle, teos or pecvd_teos"));
  EXPECT_THAT(unknown_model_text("etch"), HasSubstr("use isotropic, directional"));
  EXPECT_THAT(unknown_model_text("deposit"), HasSubstr("use conformal, isotropic"));
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
    const RecipeFile file({text, "r.toml"});
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

/// Rows at the ends of the ranges of all columns but the last, which falls from 1 to 0.
std::string table_text(std::span<const Column> columns, const std::string& row = "[",
                       bool is_first = true) {
  if (columns.size() == 1) return row + (is_first ? "1]" : "0]");
  std::string rows;
  for (const double end : {columns[0].limits.minimum, columns[0].limits.maximum}) {
    const double value = std::clamp(end, -1e3, 1e3);
    const std::string text = '"' + format_quantity(value, columns[0].dimension) + "\", ";
    const bool first = is_first && rows.empty();
    rows += (rows.empty() ? "" : ", ") + table_text(columns.subspan(1), row + text, first);
  }
  return rows;
}

std::string value_text(const Parameter& parameter, const std::string& within) {
  switch (parameter.kind) {
    case Parameter::Kind::material:
      return "\"Si\"";
    case Parameter::Kind::material_list:
      return "[\"Si\"]";
    case Parameter::Kind::flag:
      return "false";
    case Parameter::Kind::formula:
      return "\"1 nm/s\"";
    case Parameter::Kind::table:
      return '[' + table_text(parameter.columns) + ']';
    case Parameter::Kind::text: {
      const std::string_view fallback = parameter.limits.fallback;
      return '"' +
             (fallback.empty() ? within.substr(within.rfind('.') + 1) : std::string(fallback)) +
             '"';
    }
    default:
      if (parameter.dimension == Dimension::number) return "1";
      return '"' + quantity_example(parameter.dimension) + '"';
  }
}

std::string table_of(const Parameter& parameter) {
  const std::size_t dot = parameter.name.rfind('.');
  return dot == std::string_view::npos ? "step"
                                       : "step." + std::string(parameter.name.substr(0, dot));
}

bool takes_the_place_of(const Parameter& one, const Parameter& other) {
  return table_of(one) == table_of(other) && std::find(one.replaces.begin(), one.replaces.end(),
                                                       inner(other).name) != one.replaces.end();
}

bool has_row(const ModelDescription& model, std::string_view part) {
  return std::ranges::any_of(model.parameters, [&](const Parameter& row) {
    return row.name.find(part) != std::string_view::npos;
  });
}

/// A step with the parameters of a model's page but those of growth, or of etching, where it can do
/// either, and either those that take the place of others or these.
std::string step_with_all(const ModelDescription& model, const std::string& leave_out,
                          bool with_replacements) {
  const bool has_choice = has_row(model, "growth") && has_row(model, "etch_rate");
  std::string keys = "[[step]]\n";
  std::string table = "step";
  for (const Parameter& parameter : model.parameters) {
    const bool is_needed = parameter.needed == "required";
    const bool is_left_out =
        (has_choice && parameter.name.find(leave_out) != std::string_view::npos) ||
        (parameter.kind == Parameter::Kind::material && leave_out == "growth" && !is_needed) ||
        (!with_replacements && !parameter.replaces[0].empty()) ||
        (with_replacements &&
         std::any_of(model.parameters.begin(), model.parameters.end(),
                     [&](const Parameter& other) { return takes_the_place_of(other, parameter); }));
    if (is_left_out) continue;
    const std::string within = table_of(parameter);
    if (within != table) keys += "[[" + within + "]]\n";
    table = within;
    keys += std::string(inner(parameter).name) + " = " + value_text(parameter, within) + '\n';
  }
  return keys;
}

TEST(Registry, ReadsEveryParameterOfItsPage) {
  const Materials materials;
  for (const ModelDescription& model : models()) {
    if (model.acts_at_once) continue;  // those have tests of their own
    for (const std::string leave_out : {"growth", "etch"}) {
      for (const bool with_replacements : {false, true}) {
        const RecipeFile file({step_with_all(model, leave_out, with_replacements), "r.toml"});
        const StepModel step =
            model.read(file.root().tables("step")[0],
                       {materials, {materials.id("Si")}, {.spacing = 1, .cells = {9, 9}}});
        EXPECT_NE(step.model, nullptr);
        EXPECT_FALSE(step.operation.has_value());
        EXPECT_NO_THROW(file.finish()) << model.name;
        const auto film = std::ranges::find(model.parameters, Parameter::Kind::material,
                                            [](const Parameter& row) { return row.kind; });
        const bool grows =
            film != model.parameters.end() &&
            (leave_out == "etch" || film->needed == "required" || !film->limits.fallback.empty());
        EXPECT_EQ(step.deposits.has_value(), grows) << model.name;
      }
    }
  }
}

}  // namespace
}  // namespace scarp

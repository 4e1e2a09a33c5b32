// A model that the program does not have, added as docs/design.md says. What stands before the
// tests is all that its two files would hold; the line in the registry is left out.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <memory>

#include "core/error.h"
#include "levelset/operations/layer_steps.h"
#include "models/model_description.h"
#include "models/registry.h"
#include "models/source_parameters.h"
#include "tests/apps/final_state.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// seeded_growth.h

/// A metal that grows from a vapour on seeds and on itself: v = growth_rate F.
class SeededGrowth final : public SurfaceModel {
 public:
  SeededGrowth(Species vapour, std::vector<float> rates)
      : SurfaceModel({std::move(vapour)}), rates_(std::move(rates)) {}

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;

 private:
  std::vector<float> rates_;  // by material
};

// seeded_growth.cpp

const Parameter rate{.name = "growth_rate",
                     .dimension = Dimension::rate,
                     .limits = {.minimum = 0, .maximum = fastest_rate, .exclusive = true},
                     .meaning = "of an open flat seed"};
const Parameter film{.name = "material", .kind = Parameter::Kind::material, .meaning = "the metal"};
const Parameter seeds{.name = "seeds",
                      .kind = Parameter::Kind::material_list,
                      .limits = {.fallback = "[\"TiN\"]"},
                      .meaning = "what it grows on, besides itself"};
const Parameter sticking{.name = "sticking",
                         .limits = {.fallback = "0.1", .minimum = 0, .maximum = 1},
                         .meaning = "to these; none to all else"};
const std::array parameters{rate, film, seeds, sticking};

StepModel read(const RecipeTable& step, const StepScope& scope) {
  const MaterialId metal = step.material(film.name, scope.materials);
  std::vector<MaterialId> grows = read_material_list(step, seeds, scope);
  grows.push_back(metal);
  const auto speed = static_cast<float>(read_value(step, rate));
  const auto sticks = static_cast<float>(read_value(step, sticking));
  Species vapour{.name = "vapour", .sticking = std::vector<float>(scope.materials.size())};
  std::vector<float> rates(scope.materials.size());
  for (const MaterialId m : grows) {
    vapour.sticking[m] = sticks;
    rates[m] = speed;
  }
  return {std::make_shared<SeededGrowth>(std::move(vapour), std::move(rates)), metal};
}

std::vector<float> SeededGrowth::speeds(const SurfacePoints& points,
                                        std::span<const std::span<const float>> flux) const {
  std::vector<float> speeds;
  for (std::size_t p = 0; p < points.material.size(); ++p)
    speeds.push_back(rates_[points.material[p]] * flux.front()[p]);
  return speeds;
}

ModelDescription seeded_growth_description() {
  return {.name = "seeded_growth",
          .summary = "a metal that grows on seeds",
          .equation = "v = growth_rate F",
          .symbols = "F is the flux relative to an open flat wafer.",
          .limits = "An example.",
          .source = "none",
          .parameters = parameters,
          .read = read};
}

// The tests.

/// A recipe whose step is of the model.
Recipe seeded(const std::string& wafer, const std::string& keys) {
  Recipe recipe = read_text(
      "[domain]\nmode = \"2d\"\nspacing = \"5 nm\"\nextent = [\"200 nm\"]\n[[geometry]]\nshape = "
      "\"wafer\"\nmaterial = \"" +
      wafer +
      "\"\n[[geometry]]\nshape = \"trench\"\nwidth = \"100 nm\"\ndepth = \"100 nm\"\n"
      "[[step]]\nmodel = \"isotropic\"\nduration = \"10 s\"\netch_rate = \"1 nm/s\"\n");
  const RecipeFile file({"[[step]]\n" + keys, "r.toml"});
  const StepModel step = seeded_growth_description().read(
      file.root().tables("step")[0],
      {recipe.materials, {recipe.materials.id(wafer)}, recipe.domain.frame});
  file.finish();
  recipe.steps[0].model = step.model;
  recipe.steps[0].deposits = step.deposits;
  return recipe;
}

const std::string tungsten = "material = \"W\"\ngrowth_rate = \"2 nm/s\"\n";

TEST(NewModel, RunsInARecipe) {
  const State grown = final_state(seeded("TiN", tungsten));
  EXPECT_NEAR(highest_point(grown.layers), 20, 0.3);
  const State bare = final_state(seeded("SiO2", tungsten));
  EXPECT_NEAR(highest_point(bare.layers), 0, 0.01);
}

TEST(NewModel, HasAPageAndErrorsLikeTheOthers) {
  const std::string page = model_page(seeded_growth_description());
  EXPECT_THAT(page, HasSubstr("v = growth_rate F"));
  EXPECT_THAT(page, HasSubstr("what it grows on, besides itself"));
  const auto message = [](const std::string& keys) { seeded("TiN", tungsten + keys); };
  EXPECT_THAT([&] { message("sticking = 2\n"); },
              ThrowsMessage<InputError>(HasSubstr("step[0].sticking: 2 is outside [0, 1]")));
  EXPECT_THAT([&] { message("stickng = 0.5\n"); },
              ThrowsMessage<InputError>(HasSubstr("did you mean sticking?")));
}

}  // namespace
}  // namespace scarp

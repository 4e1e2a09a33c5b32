#include "models/model_parts.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "models/catalogue/ald.h"
#include "models/catalogue/crystal.h"
#include "models/catalogue/directional.h"
#include "models/catalogue/isotropic.h"
#include "models/catalogue/langmuir_transport.h"
#include "models/catalogue/oxide_regrowth.h"
#include "models/catalogue/plasma_etch.h"
#include "models/catalogue/single_particle.h"
#include "models/catalogue/teos.h"
#include "tests/models/model_fixture.h"

// Models in code, from their values alone.

namespace scarp {
namespace {

using Flux = std::vector<std::vector<float>>;

float speed_at(const SurfaceModel& model, MaterialId material, const Flux& tallies) {
  const Vec3f up{0, 0, 1};
  const std::vector<std::span<const float>> flux(tallies.begin(), tallies.end());
  return model.speeds({.material = {&material, 1}, .normal = {&up, 1}}, flux).front();
}

std::string parts_of(const SurfaceModel& model) {
  std::string parts;
  if (model.balance() != nullptr) parts += "balance ";
  if (model.cycle() != nullptr) parts += "cycle ";
  if (model.emitter() != nullptr) parts += "emitter ";
  if (model.bath() != nullptr) parts += "bath ";
  return parts;
}

TEST(ModelsInCode, HaveThePartsThatTheirValuesAskFor) {
  EXPECT_EQ(parts_of(Isotropic({1.0F})), "");
  EXPECT_EQ(parts_of(SingleParticle({.speed = {1}, .sticking = {0.1F}})), "");
  EXPECT_EQ(parts_of(Directional({.directional_speed = {1}, .isotropic_speed = {0}})), "");
  EXPECT_EQ(parts_of(LangmuirTransport({.flux = 1, .surfaces = {{.reaction = 1}}})), "balance ");
  EXPECT_EQ(parts_of(Ald({.sticking = {0.1F}, .flux = 1, .pulse = 1})), "cycle ");
  EXPECT_EQ(parts_of(Ald({.sticking = {0.1F}, .flux = 1, .desorption = 1, .pulse = 1})),
            "cycle emitter ");
  EXPECT_EQ(parts_of(OxideRegrowth({.surfaces = {{.etch_rate = 1}}})), "bath ");
  EXPECT_EQ(parts_of(Teos({{.species = {.name = "a"}, .rate = 1}})), "");
  EXPECT_EQ(parts_of(Teos({{.species = {.name = "a"}, .rate = 1, .order = 0.5}})), "balance ");
}

TEST(ModelsInCode, GiveTheSpeedOfTheirEquations) {
  EXPECT_FLOAT_EQ(speed_at(Isotropic({1, -2}), 1, {}), -2);
  EXPECT_FLOAT_EQ(speed_at(SingleParticle({.speed = {3}, .sticking = {1}}), 0, {{0.5F}}), 1.5F);
  EXPECT_FLOAT_EQ(speed_at(Teos({{.species = {.name = "a"}, .rate = 2, .order = 2}}), 0, {{0.5F}}),
                  0.5F);
  const Directional beam({.directional_speed = {-4}, .isotropic_speed = {-1}, .visibility = false});
  EXPECT_FLOAT_EQ(speed_at(beam, 0, {}), -5);
  EXPECT_EQ(beam.angular().factors().size(), 1U);
  // As much adsorbs as reacts: half of the sites are covered.
  const LangmuirTransport transport(
      {.flux = 1, .molecules_per_atom = 2, .surfaces = {{.reaction = 1, .density = 5}}});
  EXPECT_FLOAT_EQ(speed_at(transport, 0, {{1}}), -0.5F / 10);
}

TEST(ModelsInCode, AreThoseThatARecipeMakesOfTheSameValues) {
  const StepModel read = read_step("single_particle",
                                   "growth_rate = \"2 nm/s\"\nsticking = 0.25\n"
                                   "material = \"SiO2\"\nsource_power = 3\n");
  const std::size_t count = Materials().size();
  const SingleParticle made({.speed = std::vector<float>(count, 2),
                             .sticking = std::vector<float>(count, 0.25F),
                             .source = {.cosine_power = 3}});
  ASSERT_EQ(read.model->species().size(), 1U);
  EXPECT_EQ(read.model->species()[0].name, made.species()[0].name);
  EXPECT_EQ(read.model->species()[0].source.cosine_power, 3);
  const MaterialId silicon = Materials().id("Si");
  EXPECT_EQ(read.model->species()[0].sticking[silicon], made.species()[0].sticking[silicon]);
  EXPECT_EQ(speed_at(*read.model, silicon, {{0.3F}}), speed_at(made, silicon, {{0.3F}}));
}

// A part may be an object of its own as well: it need not be the model.
TEST(ModelsInCode, TakePartsOfOthers) {
  struct Dissolves final : Bath {
    Solute solute() const override { return {.name = "salt"}; }
    std::vector<Exchange> exchange(const SurfacePoints& points) const override {
      return std::vector<Exchange>(points.material.size());
    }
  };
  class Salt final : public SurfaceModel {
   public:
    explicit Salt(const Bath& bath) : SurfaceModel({}, {.bath = &bath}) {}
    std::vector<float> speeds(const SurfacePoints& points,
                              std::span<const std::span<const float>>) const override {
      return std::vector<float>(points.material.size(), -1);
    }
  };
  const Dissolves bath;
  const Salt salt(bath);
  EXPECT_EQ(salt.bath()->solute().name, "salt");
  EXPECT_TRUE(salt.angular().factors().empty());
}

}  // namespace
}  // namespace scarp

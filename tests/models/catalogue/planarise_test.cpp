#include "models/catalogue/planarise.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "models/registry.h"

namespace scarp {
namespace {

/// The plane of a step with the given keys, on a wafer of Si with Si3N4; or the errors.
struct Outcome {
  std::optional<Planarise> plane;
  std::string errors;
};

Outcome read(const std::string& keys) {
  const RecipeFile file({"[[step]]\nmodel = \"planarise\"\n" + keys, "r.toml"});
  const Materials materials;
  const StepModel step = read_model(file.root().tables("step")[0],
                                    {materials, {materials.id("Si"), materials.id("Si3N4")}});
  EXPECT_EQ(step.model, nullptr);
  EXPECT_FALSE(step.deposits.has_value());
  Outcome outcome;
  if (step.operation) outcome.plane = std::get<Planarise>(*step.operation);
  try {
    file.finish();
  } catch (const InputError& error) {
    outcome.errors = error.what();
  }
  return outcome;
}

TEST(PlanariseModel, ReadsEachOfThreeWaysToSayWhere) {
  const Outcome height = read("height = \"-0.2 um\"\n");
  EXPECT_EQ(height.errors, "");
  EXPECT_EQ(height.plane->height, -200);
  EXPECT_FALSE(height.plane->removal || height.plane->stop_material);

  const Outcome removal = read("removal = \"50 nm\"\n");
  EXPECT_EQ(removal.errors, "");
  EXPECT_EQ(removal.plane->removal, 50);

  const Outcome stop = read("stop_material = \"Si3N4\"\n");
  EXPECT_EQ(stop.errors, "");
  EXPECT_EQ(stop.plane->stop_material, Materials().id("Si3N4"));
}

TEST(PlanariseModel, SaysWhatIsWrongAndHowToMendIt) {
  EXPECT_EQ(read("").errors,
            "r.toml:1:1: step[0]: height, removal or stop_material is missing; write for example "
            "removal = \"50 nm\"");
  EXPECT_EQ(read("height = \"1 nm\"\nremoval = \"5 nm\"\n").errors,
            "r.toml:4:11: step[0].removal: height and removal exclude each other; leave one out");
  EXPECT_NE(read("removal = \"0 nm\"\n").errors.find("step[0].removal"), std::string::npos);
  EXPECT_NE(read("removal = 5\n").errors.find("unit"), std::string::npos);
}

}  // namespace
}  // namespace scarp

#include "models/parameter.h"

#include <gtest/gtest.h>

#include <string>

#include "core/error.h"
#include "models/registry.h"

namespace scarp {
namespace {

/// The errors of a step that is read by a model, as a user sees them.
std::string errors(const std::string& model, const std::string& keys) {
  const RecipeFile file({"[[step]]\n" + keys, "r.toml"});
  const Materials materials;
  const RecipeTable step = file.root().tables("step")[0];
  find_model(model)->read(step, {materials, {materials.id("Si"), materials.id("resist")}});
  try {
    file.finish();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(ModelParameters, ExactlyOneOfGrowthAndEtching) {
  EXPECT_EQ(errors("isotropic", "etch_rate = \"1 nm/s\"\ngrowth_rate = \"1 nm/s\"\n"),
            "r.toml:2:13: step[0].etch_rate: growth_rate and etch_rate exclude each other; leave "
            "one out");
  EXPECT_EQ(errors("isotropic", "material = \"Si\"\n"),
            "r.toml:1:1: step[0]: growth_rate or etch_rate is missing; write for example etch_rate "
            "= \"5 nm/s\"");
}

TEST(ModelParameters, MisspeltRateIsSuggested) {
  EXPECT_EQ(errors("isotropic", "etch_rat = \"1 nm/s\"\n"),
            "r.toml:2:1: step[0].etch_rat: unknown key (did you mean etch_rate?)");
}

TEST(ModelParameters, RatesAreNeitherNegativeNorBeyondAMetrePerSecond) {
  EXPECT_EQ(errors("isotropic", "etch_rate = \"-1 um/min\"\n"),
            "r.toml:2:13: step[0].etch_rate: \"-1 um/min\" is outside [0, 1e9 nm/s]");
  EXPECT_EQ(errors("single_particle", "etch_rate = { default = \"-1 nm/s\" }\n"),
            "r.toml:2:25: step[0].etch_rate.default: \"-1 nm/s\" is outside [0, 1e9 nm/s]");
  EXPECT_EQ(errors("isotropic", "etch_rate = \"2 m/s\"\n"),
            "r.toml:2:13: step[0].etch_rate: \"2 m/s\" is outside [0, 1e9 nm/s]");
  EXPECT_EQ(errors("isotropic", "etch_rate = \"1 um\"\n"),
            "r.toml:2:13: step[0].etch_rate: \"1 um\" is a length; a rate is wanted, in nm/s, "
            "nm/min or um/min");
}

TEST(ModelParameters, StickingIsAProbability) {
  EXPECT_EQ(errors("single_particle", "etch_rate = \"1 nm/s\"\nsticking = 1.5\n"),
            "r.toml:3:12: step[0].sticking: 1.5 is outside [0, 1]");
  EXPECT_EQ(
      errors("single_particle", "etch_rate = \"1 nm/s\"\nsticking = { Si = -0.1, default = 1 }\n"),
      "r.toml:3:19: step[0].sticking.Si: -0.1 is outside [0, 1]");
}

TEST(ModelParameters, EveryReachableMaterialNeedsAValue) {
  EXPECT_EQ(errors("isotropic", "etch_rate = { Si = \"1 nm/s\" }\n"),
            "r.toml:2:13: step[0].etch_rate: no value for resist, which this step can reach; add "
            "it, or default = ...");
  EXPECT_EQ(errors("isotropic", "etch_rate = { Si = \"1 nm/s\", default = \"0 nm/s\" }\n"), "");
  EXPECT_EQ(errors("isotropic", "etch_rate = { Si = \"1 nm/s\", resist = \"0 nm/s\" }\n"), "");
}

TEST(ModelParameters, WhatGrowsIsReachable) {
  EXPECT_EQ(errors("single_particle",
                   "material = \"SiO2\"\n"
                   "growth_rate = { Si = \"1 nm/s\", resist = \"1 nm/s\" }\n"),
            "r.toml:3:15: step[0].growth_rate: no value for SiO2, which this step can reach; add "
            "it, or default = ...");
}

TEST(ModelParameters, GrowthSaysWhatGrows) {
  EXPECT_EQ(errors("isotropic", "growth_rate = \"1 nm/s\"\n"),
            "r.toml:1:1: step[0].material: missing; write for example material = \"Si\"");
  EXPECT_EQ(errors("isotropic", "etch_rate = \"1 nm/s\"\nmaterial = \"Si\"\n"),
            "r.toml:3:1: step[0].material: unknown key; known here: growth_rate, etch_rate");
}

TEST(ModelParameters, NamesTheBeamThatIsWrong) {
  EXPECT_EQ(errors("directional",
                   "directional_etch_rate = \"1 nm/s\"\n"
                   "[[step.beam]]\n[[step.beam]]\ntilt = \"90 deg\"\nshare = 0\n"),
            "r.toml:5:8: step[0].beam[1].tilt: \"90 deg\" is outside [0, 89 deg]\n"
            "r.toml:6:9: step[0].beam[1].share: 0 is not above 0");
}

}  // namespace
}  // namespace scarp

#include "core/material.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace scarp {
namespace {

TEST(Materials, NamesAreShownAsARecipeWritesThem) {
  const auto message = [](const std::string& name) -> std::string {
    try {
      Materials().id(name);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(message(""), "the name of the material is empty; write for example \"Si\"");
  EXPECT_NE(message("a b").find("[materials.\"a b\"]"), std::string::npos);
}

TEST(Materials, KnowsTheDensitiesThatTheModelsUse) {
  const Materials materials;
  EXPECT_EQ(materials[materials.id("Si")].density, 5.02);
  EXPECT_EQ(materials[materials.id("polySi")].density, 5.02);
  EXPECT_EQ(materials[materials.id("SiO2")].density, 2.2);
  EXPECT_EQ(materials[materials.id("Si3N4")].density, 2.3);
  EXPECT_EQ(materials[materials.id("polymer")].density, 2.0);
  EXPECT_EQ(materials[materials.id("mask")].density, 500);
  EXPECT_DOUBLE_EQ(materials[materials.id("SiGe")].density, 4.84);
  EXPECT_NEAR(materials[materials.id("W")].density, 6.32, 0.01);
  EXPECT_NEAR(materials[materials.id("GaAs")].density, 2.21, 0.01);
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const Material& material = materials[static_cast<MaterialId>(i)];
    EXPECT_EQ(materials.id(material.name), i);
    EXPECT_GT(material.density, 0.5) << material.name;
  }
}

TEST(Materials, SuggestsTheNameThatWasMeant) {
  try {
    Materials().id("SiO");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "there is no material \"SiO\" (did you mean SiO2?); a recipe adds one with "
                 "[materials.SiO] density = \"5e22 /cm3\"");
  }
}

TEST(Materials, TakesNewOnesAndOtherDensities) {
  Materials materials;
  const std::size_t count = materials.size();
  const MaterialId id = materials.add({"SiCOH", 1.5});
  EXPECT_EQ(id, count);
  EXPECT_EQ(materials.add({"SiO2", 2.0}), materials.id("SiO2"));
  EXPECT_EQ(materials[materials.id("SiO2")].density, 2.0);
  EXPECT_EQ(materials.size(), count + 1);
}

}  // namespace
}  // namespace scarp

#include "models/catalogue/conformal.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "models/registry.h"

namespace scarp {
namespace {

std::string errors(const RecipeFile& file) {
  try {
    file.finish();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(ConformalModel, ReadsThicknessAndMaterial) {
  const RecipeFile file(
      {"[[step]]\nmodel = \"conformal\"\nthickness = \"0.02 um\"\nmaterial = \"SiO2\"\n",
       "r.toml"});
  const Materials materials;
  const StepModel step = read_model(file.root().tables("step")[0], {materials, {}});
  EXPECT_EQ(errors(file), "");
  EXPECT_EQ(step.model, nullptr);
  EXPECT_EQ(step.deposits, materials.id("SiO2"));
  ASSERT_TRUE(step.operation.has_value());
  EXPECT_EQ(std::get<ConformalFilm>(*step.operation).thickness, 20);
}

TEST(ConformalModel, NeedsBoth) {
  for (const std::string keys : {"thickness = \"2 nm\"\n", "material = \"SiO2\"\n",
                                 "thickness = \"0 nm\"\nmaterial = \"SiO2\"\n"}) {
    const RecipeFile file({"[[step]]\nmodel = \"conformal\"\n" + keys, "r.toml"});
    const Materials materials;
    read_model(file.root().tables("step")[0], {materials, {}});
    EXPECT_NE(errors(file).find("step[0]."), std::string::npos) << keys;
  }
}

}  // namespace
}  // namespace scarp

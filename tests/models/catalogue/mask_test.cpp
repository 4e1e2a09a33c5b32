#include "models/catalogue/mask.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "core/error.h"
#include "models/registry.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;

struct Outcome {
  MaskFilm mask;
  std::string errors;
};

/// The mask of a step with the given keys. What of it lies in `read_mask` is read here.
Outcome read(const std::string& keys) {
  const RecipeFile file({"[[step]]\nmodel = \"mask\"\n" + keys, "r.toml"});
  const Materials materials;
  const auto read_mask = [&](const RecipeTable& table) {
    const double taper = table.quantity("taper", Dimension::angle, {.fallback = "0 deg"});
    return MaskShape{.material = materials.id("resist"), .taper = taper};
  };
  const StepModel step = read_model(
      file.root().tables("step")[0],
      {.materials = materials, .reachable = {materials.id("Si")}, .read_mask = read_mask});
  EXPECT_EQ(step.deposits, materials.id("resist"));
  Outcome outcome{.mask = std::get<MaskFilm>(step.operation.value()), .errors = {}};
  try {
    file.finish();
  } catch (const InputError& error) {
    outcome.errors = error.what();
  }
  return outcome;
}

TEST(MaskModel, IsFlatOnTopUnlessAsked) {
  EXPECT_TRUE(read("").mask.planar);
  EXPECT_FALSE(read("planar = false\n").mask.planar);
  const Outcome leaning = read("taper = \"9 deg\"\n");
  EXPECT_EQ(leaning.errors, "");
  EXPECT_DOUBLE_EQ(leaning.mask.shape.taper, std::numbers::pi / 20);
}

TEST(MaskModel, OfOneThicknessHasUprightWalls) {
  EXPECT_EQ(read("planar = false\ntaper = \"0 deg\"\n").errors, "");
  EXPECT_THAT(read("planar = false\ntaper = \"9 deg\"\n").errors,
              HasSubstr("step[0].taper: a mask of one thickness everywhere has upright walls"));
}

}  // namespace
}  // namespace scarp

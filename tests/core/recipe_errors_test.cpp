#include "core/recipe_errors.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

TEST(RecipeErrors, AreSortedByPlaceAndSaidOnce) {
  RecipeErrors errors("r.toml");
  EXPECT_TRUE(errors.empty());
  errors.add({"b", {7, 3}, "is wrong"});
  errors.add({"c", {1, 1, "--set c=1"}, "is wrong"});
  errors.add({"a", {7, 1}, "is wrong"});
  errors.add({"a", {7, 1}, "is wrong"});
  errors.add({"", {2, 1}, "the whole"});
  EXPECT_EQ(errors.text(),
            "r.toml:2:1: the whole\n"
            "r.toml:7:1: a: is wrong\n"
            "r.toml:7:3: b: is wrong\n"
            "--set c=1: c: is wrong");
}

TEST(RecipeErrors, ForgetsAKeyThatIsThereMisspelt) {
  RecipeErrors errors("r.toml");
  errors.add({"s", {1, 1}, "x or y is missing", {"s.x", "s.y"}});
  errors.forget_missing("s.z");
  EXPECT_FALSE(errors.ok("s"));
  errors.forget_missing("s.y");
  EXPECT_TRUE(errors.ok("s"));
}

}  // namespace
}  // namespace scarp

#include "core/recipe_errors.h"

#include <gtest/gtest.h>

#include <utility>

namespace scarp {
namespace {

RecipeErrors::Entry entry(std::string path, TomlPlace place, std::string text) {
  RecipeErrors::Entry entry;
  entry.path = std::move(path);
  entry.place = std::move(place);
  entry.text = std::move(text);
  return entry;
}

TEST(RecipeErrors, AreSortedByPlaceAndSaidOnce) {
  RecipeErrors errors("r.toml");
  EXPECT_TRUE(errors.empty());
  errors.add(entry("b", {7, 3, ""}, "is wrong"));
  errors.add(entry("c", {1, 1, "--set c=1"}, "is wrong"));
  errors.add(entry("a", {7, 1, ""}, "is wrong"));
  errors.add(entry("a", {7, 1, ""}, "is wrong"));
  errors.add(entry("", {2, 1, ""}, "the whole"));
  EXPECT_EQ(errors.text(),
            "r.toml:2:1: the whole\n"
            "r.toml:7:1: a: is wrong\n"
            "r.toml:7:3: b: is wrong\n"
            "--set c=1: c: is wrong");
}

TEST(RecipeErrors, ForgetsAKeyThatIsThereMisspelt) {
  RecipeErrors errors("r.toml");
  RecipeErrors::Entry missing = entry("s", {}, "x or y is missing");
  missing.missing = {"s.x", "s.y"};
  errors.add(missing);
  errors.forget_missing("s.z");
  EXPECT_FALSE(errors.ok("s"));
  errors.forget_missing("s.y");
  EXPECT_TRUE(errors.ok("s"));
}

}  // namespace
}  // namespace scarp

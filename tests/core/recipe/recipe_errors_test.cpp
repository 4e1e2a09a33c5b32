#include "core/recipe/recipe_errors.h"

#include <gtest/gtest.h>

#include <algorithm>
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

std::string text_of(const RecipeErrors& errors) { return InputError(errors.problems()).what(); }

TEST(RecipeErrors, AreSortedByPlaceAndSaidOnce) {
  RecipeErrors errors("r.toml");
  EXPECT_TRUE(errors.empty());
  errors.add(entry("b", {7, 3, ""}, "is wrong"));
  errors.add(entry("c", {1, 1, "--set c=1"}, "is wrong"));
  errors.add(entry("a", {7, 1, ""}, "is wrong"));
  errors.add(entry("a", {7, 1, ""}, "is wrong"));
  errors.add(entry("", {2, 1, ""}, "the whole"));
  EXPECT_EQ(text_of(errors),
            "r.toml:2:1: the whole\n"
            "r.toml:7:1: a: is wrong\n"
            "r.toml:7:3: b: is wrong\n"
            "--set c=1: c: is wrong");
}

TEST(RecipeErrors, KeysAreOneShortLine) {
  RecipeErrors errors("r.toml");
  errors.add(entry("materials.a\nb.density", {1, 1, ""}, "is wrong"));
  errors.add(entry(std::string(1000, 'k'), {2, 1, ""}, "is wrong"));
  EXPECT_EQ(text_of(errors), "r.toml:1:1: materials.a\\nb.density: is wrong\nr.toml:2:1: " +
                                 std::string(100, 'k') + "...: is wrong");
}

TEST(RecipeErrors, ForgetsAKeyThatIsThereMisspelt) {
  RecipeErrors errors("r.toml");
  RecipeErrors::Entry missing = entry("s", {}, "x or y is missing");
  missing.missing = {"s.x", "s.y"};
  errors.add(missing);
  errors.forget_missing({"s.z"});
  EXPECT_FALSE(errors.ok("s"));
  errors.forget_missing({"s.a", "s.y"});
  EXPECT_TRUE(errors.ok("s"));
}

TEST(RecipeErrors, AKeyIsAtFaultForWhatIsWithinIt) {
  RecipeErrors errors("r.toml");
  errors.add(entry("step[1].rate", {}, "is wrong"));
  errors.add(entry("list[2]", {}, "is wrong"));
  for (const char* path : {"", "step", "step[1]", "step[1].rate", "list", "list[2]"}) {
    EXPECT_FALSE(errors.ok(path)) << path;
  }
  for (const char* path : {"st", "step[0]", "step[10]", "step[1].rat", "step[1].rate.Si", "lis"}) {
    EXPECT_TRUE(errors.ok(path)) << path;
  }
}

TEST(RecipeErrors, OfVeryManyTheFirstHundredAreSaid) {
  RecipeErrors errors("r.toml");
  for (std::uint32_t n = 0; n < 20'000; ++n) {
    const std::string path = "step[" + std::to_string(n) + ']';
    EXPECT_TRUE(errors.ok(path));
    errors.add(entry(path, {n + 1, 1, ""}, "is wrong"));
  }
  const std::string text = text_of(errors);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 100);
  EXPECT_TRUE(text.ends_with("r.toml:100:1: step[99]: is wrong\n... and 19900 more"));
}

}  // namespace
}  // namespace scarp

#include "core/recipe/recipe_path.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace scarp {
namespace {

TEST(RecipePath, ReadsNamesAndPlacesInLists) {
  const RecipePath path = parse_recipe_path("step[1].step[0].duration");
  ASSERT_EQ(path.size(), 5U);
  EXPECT_EQ(std::get<std::string>(path[0]), "step");
  EXPECT_EQ(std::get<std::size_t>(path[1]), 1U);
  EXPECT_EQ(std::get<std::string>(path[4]), "duration");
  for (const char* text : {"a", "a.b", "a[0]", "a[3][4].b-c_9", "step[1].step[0].duration"}) {
    EXPECT_EQ(format_recipe_path(parse_recipe_path(text)), text);
  }
}

TEST(RecipePath, RefusesWhatIsNone) {
  for (const char* text : {"", ".", "a.", ".a", "a..b", "[0]", "a[", "a[]", "a[x]", "a[-1]", "a[0",
                           "a[0]b", "a b", "a]", "a[99999999999999999999]"}) {
    EXPECT_THROW(parse_recipe_path(text), InputError) << text;
  }
  std::string deep = "a";
  for (int n = 0; n < 100'000; ++n) deep += ".a";
  EXPECT_THROW(parse_recipe_path(deep), InputError);
}

// On one line, whatever a recipe calls its keys.
TEST(RecipePath, OfAnyKeyIsOneLine) {
  EXPECT_EQ(format_recipe_path({std::string("step"), std::size_t{0}, std::string("a\nb")}),
            "step[0].a\\nb");
}

TEST(RecipePath, KnowsWhatLiesWithin) {
  EXPECT_TRUE(is_within("step[0].name", "step"));
  EXPECT_TRUE(is_within("step[0].name", "step[0]"));
  EXPECT_TRUE(is_within("step", "step"));
  EXPECT_TRUE(is_within("step", ""));
  EXPECT_FALSE(is_within("step", "step[0]"));
  EXPECT_FALSE(is_within("stepping", "step"));
}

}  // namespace
}  // namespace scarp

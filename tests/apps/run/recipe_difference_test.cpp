#include "apps/run/recipe_difference.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

constexpr const char* recipe =
    "title = \"a\"\n[flux]\nseed = 1\nrays = 5\n[[step]]\nrate = { Si = 1 }\n";

std::string changed(const std::string& from, const std::string& to) {
  std::string text = recipe;
  return first_difference(recipe, text.replace(text.find(from), from.size(), to));
}

TEST(RecipeDifference, NamesTheFirstKeyAndBothValues) {
  EXPECT_EQ(first_difference(recipe, recipe), "");
  EXPECT_EQ(changed("seed = 1", "seed = 2"), "flux.seed is 1, there 2");
  EXPECT_EQ(changed("seed = 1", "seed = \"1\""), "flux.seed is 1, there \"1\"");
  EXPECT_EQ(changed("Si = 1", "Si = 2"), "step[0].rate.Si is 1, there 2");
  EXPECT_EQ(changed("rays = 5\n", ""), "flux.rays is 5, there missing");
  EXPECT_EQ(changed("seed = 1\n", "seed = 1\nmax_rays = 7\n"), "flux.max_rays is missing, there 7");
  EXPECT_EQ(first_difference(recipe, std::string(recipe) + "[[step]]\nrate = 2\n"),
            "step[1] is missing, there a table");
}

}  // namespace
}  // namespace scarp

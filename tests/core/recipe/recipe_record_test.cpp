#include "core/recipe/recipe_record.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

TEST(RecipeRecord, WritesValuesThenTablesThenArrays) {
  RecipeRecord record;
  record.append("step").set("name", "\"a\"");
  record.append("step").append("step").set("n", "1");
  record.table("domain").set("spacing", "\"1 nm\"");
  record.table("domain").table("a b").set("x", "2");
  record.table("empty");
  record.set("title", "\"t\"");
  record.set("title", "\"last\"");
  EXPECT_EQ(record.toml(), R"(title = "last"

[domain]
spacing = "1 nm"

[domain."a b"]
x = 2

[[step]]
name = "a"

[[step]]

[[step.step]]
n = 1
)");
}

}  // namespace
}  // namespace scarp

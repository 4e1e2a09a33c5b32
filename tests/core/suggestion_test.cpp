#include "core/suggestion.h"

#include <gtest/gtest.h>

#include <vector>

namespace scarp {
namespace {

const std::vector<std::string> keys{"spacing", "extent", "boundary", "mode"};

TEST(Suggestion, FindsTheKeyThatWasMeant) {
  EXPECT_EQ(nearest_name("spaccing", keys), "spacing");  // one letter too many
  EXPECT_EQ(nearest_name("extnt", keys), "extent");      // one too few
  EXPECT_EQ(nearest_name("bounbary", keys), "boundary");
  EXPECT_EQ(nearest_name("mdoe", keys), "mode");  // two swapped
  EXPECT_EQ(nearest_name("Mode", keys), "mode");
}

TEST(Suggestion, IsSilentWhenNothingIsNear) {
  EXPECT_EQ(nearest_name("sticking", keys), "");
  EXPECT_EQ(nearest_name("", keys), "");
  EXPECT_EQ(nearest_name("Q", std::vector<std::string>{"W", "Si"}), "");
  EXPECT_EQ(suggestion("zzz", keys), "");
  EXPECT_EQ(suggestion("spaccing", keys), " (did you mean spacing?)");
}

}  // namespace
}  // namespace scarp

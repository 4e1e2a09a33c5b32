#include "core/printable.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace scarp {
namespace {

TEST(Printable, ShowsControlCharactersInsteadOfSendingThem) {
  EXPECT_EQ(printable("a\x1b[31mb\x07"), "a\\x1b[31mb\\x07");
  EXPECT_EQ(printable("\x7f \xc2\x9b"
                      "2J \xc2\xb5m \xc3\xa9"),
            "\\x7f \\x9b2J \xc2\xb5m \xc3\xa9");
  EXPECT_EQ(printable("two\n\tlines\r"), "two\n\tlines\\x0d");
  EXPECT_TRUE(has_control_characters("a\x1b"));
  EXPECT_TRUE(has_control_characters("\xc2\x85"));
  EXPECT_FALSE(has_control_characters("two\n\tlines, \xc2\xb5m"));
}

TEST(Printable, PathsAreOneLineOfAnyLength) {
  const std::string longest(300, 'x');
  EXPECT_EQ(shown(longest + "/a\nb\t\x1b.toml"), longest + "/a\\nb\\t\\x1b.toml");
}

TEST(Printable, WhatAMessageRepeatsIsOneShortLine) {
  EXPECT_EQ(repeated("a\nb\tc\x1b"), "a\\nb\\tc\\x1b");
  const std::string micro = "\xc2\xb5";
  std::string longest;
  for (int n = 0; n < 100; ++n) longest += micro;
  EXPECT_EQ(repeated(longest), longest);
  EXPECT_EQ(repeated(longest + "x"), longest + "...");
  EXPECT_EQ(repeated("x" + longest), "x" + longest.substr(micro.size()) + "...");
  EXPECT_EQ(in_quotes("x\n"), "\"x\\n\"");
}

}  // namespace
}  // namespace scarp

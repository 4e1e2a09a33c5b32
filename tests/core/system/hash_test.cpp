#include "core/system/hash.h"

#include <gtest/gtest.h>

#include <vector>

namespace scarp {
namespace {

// The published value of XXH3 (128 bits) for no input at all.
TEST(Hash, OfNothingIsThePublishedOne) {
  EXPECT_EQ(Hash().hex(), "99aa06d3014798d86001c324468d497f");
}

TEST(Hash, DependsOnTheBytesAndNotOnThePieces) {
  std::string text;
  for (int i = 0; i < 10000; ++i) text.push_back(static_cast<char>(i * 31));
  Hash whole;
  whole.add(text);
  Hash pieces;
  for (std::size_t i = 0; i < text.size(); i += 77) pieces.add(text.substr(i, 77));
  EXPECT_EQ(whole.hex(), pieces.hex());

  text[5000] ^= 1;
  Hash other;
  other.add(text);
  EXPECT_NE(whole.hex(), other.hex());
}

TEST(Hash, SeesEveryBitOfANumber) {
  Hash zero;
  zero.add_value(0.0);
  Hash minus_zero;
  minus_zero.add_value(-0.0);
  EXPECT_NE(zero.hex(), minus_zero.hex());

  const std::vector<float> values{1, 2};
  Hash together;
  together.add_values(std::span<const float>(values));
  Hash apart;
  apart.add_value(1.0F);
  apart.add_value(2.0F);
  EXPECT_EQ(together.hex(), apart.hex());
}

}  // namespace
}  // namespace scarp

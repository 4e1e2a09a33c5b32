#include "core/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "core/running_statistics.h"

namespace scarp {
namespace {

// Known answers published with the generator (Salmon et al. 2011, Random123 kat_vectors, philox4x32
// 10).
TEST(Philox, GivesThePublishedVectors) {
  EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}),
            (std::array<std::uint32_t, 4>{0x6627e8d5U, 0xe169c58dU, 0xbc57ac4cU, 0x9b00dbd8U}));
  EXPECT_EQ(
      philox({0xffffffffU, 0xffffffffU, 0xffffffffU, 0xffffffffU}, {0xffffffffU, 0xffffffffU}),
      (std::array<std::uint32_t, 4>{0x408f276dU, 0x41c83b0eU, 0xa20bc7c6U, 0x6d5451fdU}));
}

TEST(RandomStream, IsAPureFunctionOfItsKey) {
  const RandomStream::Key key{.seed = 1, .time_step = 2, .species = 3, .ray = 4};
  RandomStream first(key);
  RandomStream second(key);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(first.bits(), second.bits());
}

// A stream may be left and taken up again at a block, and blocks of many rays drawn together.
TEST(RandomStreams, GiveTheNumbersOfEachRayFromAnyBlockOn) {
  const RandomStream::Key key{.seed = 1ULL << 40, .time_step = 2, .species = 3};
  const RandomStreams streams(key);
  for (const std::size_t count : {std::size_t{1}, std::size_t{5}, RandomStreams::Blocks::most}) {
    RandomStreams::Blocks blocks;
    for (std::uint64_t k = 0; k < count; ++k)
      blocks.add(k << 30, static_cast<std::uint32_t>(k % 3));
    streams.draw(blocks);
    for (std::uint64_t k = 0; k < count; ++k) {
      const auto block = static_cast<std::uint32_t>(k % 3);
      RandomStream whole({.seed = key.seed, .time_step = 2, .species = 3, .ray = k << 30});
      for (std::uint32_t skipped = 0; skipped < 4 * block; ++skipped) whole.bits();
      EXPECT_EQ(whole.next_block(), block);
      RandomStream rest = streams.of_ray(k << 30, block);
      for (const auto& words : blocks.words) {
        const std::uint32_t number = whole.bits();
        EXPECT_EQ(rest.bits(), number);
        EXPECT_EQ(words[k], number);
      }
    }
  }
}

// A recipe gives the same results in later versions: the numbers of a key never change. Computed
// from the published generator by another program.
TEST(RandomStream, HasTheNumbersOfEarlierVersions) {
  RandomStream stream(
      {.seed = (5ULL << 32) + 1, .time_step = 2, .species = 3, .ray = (7ULL << 32) + 4});
  for (const std::uint32_t expected :
       {0x7605fed4U, 0x8d30d699U, 0x5f6310baU, 0x0b6d1acbU, 0x70265f5fU, 0xe4d00f8bU})
    EXPECT_EQ(stream.bits(), expected);
}

TEST(RandomStream, DiffersWithEveryPartOfTheKey) {
  std::set<std::uint32_t> firsts;
  std::size_t streams = 0;
  for (const std::uint64_t n : {0ULL, 1ULL, 2ULL, 1ULL << 40, (1ULL << 40) + 1}) {
    const auto small = static_cast<std::uint32_t>(n % 7 + 1);
    for (const RandomStream::Key& key :
         {RandomStream::Key{.seed = n + 1}, RandomStream::Key{.ray = n + 1},
          RandomStream::Key{.time_step = small}, RandomStream::Key{.species = small}}) {
      firsts.insert(RandomStream(key).bits());
      ++streams;
    }
  }
  // n % 7 is 0, 1, 2, 2, 3: one small key of each kind comes twice.
  EXPECT_EQ(firsts.size(), streams - 2);
}

TEST(RandomStream, NumbersAreUniform) {
  constexpr int count = 400000;
  constexpr int bins = 100;
  RandomStream random({.seed = 11});
  RunningStatistics statistics;
  std::vector<int> hits(bins);
  for (int i = 0; i < count; ++i) {
    const double x = random.uniform();
    ASSERT_GE(x, 0);
    ASSERT_LT(x, 1);
    statistics.add(x);
    ++hits[static_cast<std::size_t>(x * bins)];
  }
  EXPECT_NEAR(statistics.mean(), 0.5, 5 * statistics.std_error());
  // (x - 1/2)^2 has the mean 1/12 and the variance 1/180.
  EXPECT_NEAR(statistics.variance(), 1.0 / 12, 5 * std::sqrt(1.0 / 180 / count));
  double chi_square = 0;
  for (const int n : hits) {
    chi_square += std::pow(n - count / bins, 2) / (static_cast<double>(count) / bins);
  }
  EXPECT_NEAR(chi_square, bins - 1, 5 * std::sqrt(2.0 * (bins - 1)));
}

TEST(RandomStream, NeighbouringRaysAreNotCorrelated) {
  constexpr int count = 200000;
  RunningStatistics product;
  for (int i = 0; i < count; ++i) {
    RandomStream a({.seed = 5, .ray = static_cast<std::uint64_t>(i)});
    RandomStream b({.seed = 5, .ray = static_cast<std::uint64_t>(i) + 1});
    product.add((a.uniform() - 0.5) * (b.uniform() - 0.5));
  }
  EXPECT_NEAR(product.mean(), 0, 5 * product.std_error());
}

}  // namespace
}  // namespace scarp

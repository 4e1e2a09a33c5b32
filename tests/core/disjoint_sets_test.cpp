#include "core/disjoint_sets.h"

#include <gtest/gtest.h>

#include "core/random.h"

namespace scarp {
namespace {

TEST(DisjointSets, AreNumberedByTheirLowest) {
  DisjointSets sets(6);
  sets.join(5, 3);
  sets.join(4, 5);
  sets.join(1, 1);
  EXPECT_EQ(sets.lowest(5), 3U);
  EXPECT_EQ(sets.lowest(4), 3U);
  EXPECT_EQ(sets.lowest(1), 1U);
  sets.join(4, 0);
  EXPECT_EQ(sets.lowest(3), 0U);
  EXPECT_EQ(sets.lowest(2), 2U);
}

// Whatever the order of joins, against numbers handed on until nothing changes.
TEST(DisjointSets, AreThoseOfAGraph) {
  RandomStream random({.seed = 1});
  constexpr std::uint32_t count = 200;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs(150);
  for (auto& [a, b] : pairs) {
    a = random.bits() % count;
    b = random.bits() % count;
  }
  DisjointSets sets(count);
  for (const auto& [a, b] : pairs) sets.join(a, b);
  std::vector<std::uint32_t> lowest(count);
  std::iota(lowest.begin(), lowest.end(), 0U);
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& [a, b] : pairs) {
      if (lowest[a] == lowest[b]) continue;
      lowest[a] = lowest[b] = std::min(lowest[a], lowest[b]);
      changed = true;
    }
  }
  for (std::uint32_t i = 0; i < count; ++i) EXPECT_EQ(sets.lowest(i), lowest[i]);
}

}  // namespace
}  // namespace scarp

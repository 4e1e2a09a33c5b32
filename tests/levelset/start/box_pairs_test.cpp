#include "levelset/start/box_pairs.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace scarp {
namespace {

using IntegerBox = PlaneBox<std::int64_t>;
using Pair = std::pair<std::size_t, std::size_t>;

TEST(BoxPairs, AreThoseThatOverlapEachOnce) {
  std::mt19937 random(1);
  const auto within = [&](int n) { return static_cast<std::int64_t>(random() % n); };
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<IntegerBox> boxes(1 + random() % 40);
    for (IntegerBox& box : boxes) {
      box.lower = {within(20), within(20)};
      // Points, lines and boxes as high as all of the plane.
      box.upper = {box.lower[0] + within(6), box.lower[1] + within(trial % 2 == 0 ? 4 : 20)};
    }
    std::set<Pair> expected;
    for (std::size_t n = 0; n < boxes.size(); ++n) {
      for (std::size_t m = 0; m < n; ++m) {
        bool apart = false;
        for (std::size_t axis = 0; axis < 2; ++axis) {
          apart = apart || boxes[n].upper[axis] < boxes[m].lower[axis] ||
                  boxes[m].upper[axis] < boxes[n].lower[axis];
        }
        if (!apart) expected.insert({m, n});
      }
    }
    std::multiset<Pair> found;
    EXPECT_FALSE(any_pair_of_boxes<std::int64_t>(boxes, [&](std::size_t n, std::size_t m) {
      found.insert({std::min(n, m), std::max(n, m)});
      return false;
    }));
    EXPECT_EQ(std::multiset<Pair>(expected.begin(), expected.end()), found) << trial;
  }
}

TEST(BoxPairs, StopAtTheFirstThatIsWanted) {
  const std::vector<IntegerBox> boxes(5, IntegerBox{{0, 0}, {1, 1}});
  int calls = 0;
  EXPECT_TRUE(any_pair_of_boxes<std::int64_t>(
      boxes, [&](std::size_t, std::size_t) { return ++calls == 3; }));
  EXPECT_EQ(calls, 3);
  EXPECT_FALSE(any_pair_of_boxes<std::int64_t>({}, [](std::size_t, std::size_t) { return true; }));
}

}  // namespace
}  // namespace scarp

#include "core/parallel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <set>
#include <vector>

namespace scarp {
namespace {

TEST(ParallelFor, CoversEveryIndexOnce) {
  for (const std::size_t count : {0U, 1U, 63U, 64U, 65U, 10000U}) {
    std::vector<std::atomic<int>> visits(count);
    parallel_for(count, 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ++visits[i];
    });
    for (const auto& n : visits) EXPECT_EQ(n, 1);
  }
}

std::set<std::pair<std::size_t, std::size_t>> ranges(std::size_t count, std::size_t grain) {
  std::mutex mutex;
  std::set<std::pair<std::size_t, std::size_t>> found;
  parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
    const std::lock_guard lock(mutex);
    found.emplace(begin, end);
  });
  return found;
}

TEST(ParallelReduce, JoinsTheRangesInTheirOrder) {
  // A sum of floats tells one order from another.
  std::vector<double> values;
  for (int i = 0; i < 1000; ++i) values.push_back((i % 2 == 0 ? 1e16 : -1e16) / (i + 1));
  const auto sum_of = [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += values[i];
    return sum;
  };
  double expected = 0;
  for (std::size_t i = 0; i < values.size(); i += 7) {
    expected += sum_of(i, std::min<std::size_t>(i + 7, values.size()));
  }
  EXPECT_NE(expected, sum_of(0, values.size()));
  for (const int threads : {1, 2, 8}) {
    const ThreadLimit limit(threads);
    const auto add = [](double a, double b) { return a + b; };
    EXPECT_EQ(parallel_reduce(values.size(), 7, 0.0, sum_of, add), expected);
    EXPECT_EQ(parallel_reduce(0, 7, 5.0, sum_of, add), 5.0);
  }
}

TEST(InParallel, CallsBothOnceAndLetsThemUseTheThreads) {
  for (const int threads : {1, 2, 8}) {
    const ThreadLimit limit(threads);
    std::atomic<int> first = 0;
    std::atomic<int> second = 0;
    const auto count = [](std::atomic<int>& calls) {
      parallel_for(1000, 1, [&](std::size_t begin, std::size_t end) {
        calls += static_cast<int>(end - begin);
      });
    };
    in_parallel([&] { count(first); }, [&] { count(second); });
    EXPECT_EQ(first, 1000);
    EXPECT_EQ(second, 1000);
  }
}

TEST(ParallelFor, RangesDoNotDependOnTheNumberOfThreads) {
  const std::set<std::pair<std::size_t, std::size_t>> expected{{0, 4}, {4, 8}, {8, 10}};
  for (const int threads : {1, 2, 8}) {
    const ThreadLimit limit(threads);
    EXPECT_EQ(ranges(10, 4), expected);
  }
}

TEST(ThreadLimit, HoldsWhileItLives) {
  const int before = thread_count();
  {
    const ThreadLimit limit(1);
    EXPECT_EQ(thread_count(), 1);
  }
  EXPECT_EQ(thread_count(), before);
  const ThreadLimit none(0);
  EXPECT_EQ(thread_count(), before);
}

}  // namespace
}  // namespace scarp

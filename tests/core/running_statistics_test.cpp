#include "core/running_statistics.h"

#include <gtest/gtest.h>

#include "core/random.h"

namespace scarp {
namespace {

TEST(RunningStatistics, GivesTheValuesOfTheDefinition) {
  RunningStatistics statistics;
  for (const double value : {2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0}) statistics.add(value);
  EXPECT_EQ(statistics.count(), 8U);
  EXPECT_DOUBLE_EQ(statistics.mean(), 5);
  EXPECT_DOUBLE_EQ(statistics.variance(), 32.0 / 7);
  EXPECT_DOUBLE_EQ(statistics.std_error(), std::sqrt(32.0 / 7 / 8));
}

TEST(RunningStatistics, KeepsSmallVarianceBesideALargeMean) {
  RunningStatistics statistics;
  for (int i = 0; i < 1000; ++i) statistics.add(1e9 + (i % 2));
  EXPECT_NEAR(statistics.variance(), 250.0 / 999, 1e-6);
}

TEST(RunningStatistics, MergesPartsIntoTheWhole) {
  RandomStream random({.seed = 5});
  RunningStatistics whole;
  RunningStatistics parts[3];
  for (int i = 0; i < 1000; ++i) {
    const double value = random.uniform();
    whole.add(value);
    parts[i < 10 ? 0 : i < 700 ? 1 : 2].add(value);
  }
  RunningStatistics merged;
  for (const RunningStatistics& part : parts) merged.merge(part);
  merged.merge({});
  EXPECT_EQ(merged.count(), whole.count());
  EXPECT_NEAR(merged.mean(), whole.mean(), 1e-14);
  EXPECT_NEAR(merged.variance(), whole.variance(), 1e-14);
}

TEST(RunningStatistics, HasNoErrorBarOfFewerThanTwoValues) {
  RunningStatistics statistics;
  EXPECT_EQ(statistics.std_error(), 0);
  statistics.add(3);
  EXPECT_EQ(statistics.mean(), 3);
  EXPECT_EQ(statistics.variance(), 0);
}

}  // namespace
}  // namespace scarp

#include "core/stage_timer.h"

#include <gtest/gtest.h>

#include <thread>

namespace scarp {
namespace {

TEST(StageTimer, AddsUpByStageInTheOrderTheyWereMet) {
  StageTimer timer;
  timer.add("flux", 1.5);
  timer.add("advect", 2);
  timer.add("flux", 0.25);
  EXPECT_EQ(timer.seconds("flux"), 1.75);
  EXPECT_EQ(timer.seconds("none"), 0);
  ASSERT_EQ(timer.stages().size(), 2U);
  EXPECT_EQ(timer.stages()[0].first, "flux");

  StageTimer total;
  total.add("advect", 1);
  total.add(timer);
  EXPECT_EQ(total.seconds("advect"), 3);
  EXPECT_EQ(total.seconds("flux"), 1.75);
}

TEST(StageTimer, MeasuresTheLifeOfAMeasurement) {
  StageTimer timer;
  {
    const auto measurement = timer.measure("sleep");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_GE(timer.seconds("sleep"), 0.02);
  EXPECT_LT(timer.seconds("sleep"), 5);
}

}  // namespace
}  // namespace scarp

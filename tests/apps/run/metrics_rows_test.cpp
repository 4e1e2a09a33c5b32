#include "apps/run/metrics_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/error.h"
#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class MetricsFile : public ::testing::Test {
 protected:
  MetricsRows rows(const std::string& text, std::uint32_t first) const {
    std::ofstream(folder_ / "metrics.csv") << text;
    return read_metrics_rows(folder_ / "metrics.csv", "x,time_step\n", first);
  }

  TemporaryFolder folder_;
};

TEST_F(MetricsFile, EndsWithTheLastRowThatIsWholeAndInOrder) {
  EXPECT_THAT(rows("x,time_step\na,0\nb,1\nc,2\n", 0).lines, ElementsAre("a,0", "b,1", "c,2"));
  EXPECT_THAT(rows("x,time_step\na,0\nb,1\nc,2", 0).lines, ElementsAre("a,0", "b,1"));
  EXPECT_THAT(rows("x,time_step\na,0\nc,2\nb,1\n", 0).lines, ElementsAre("a,0"));
  EXPECT_THAT(rows("x,time_step\n", 0).lines, ElementsAre());
  EXPECT_EQ(rows("x,time_step\na,0\nb,1\n", 0).end(), 2U);
  EXPECT_THAT(rows("x,time_step\r\na,0\r\nb,1\r\n", 0).lines, ElementsAre("a,0", "b,1"));
}

TEST_F(MetricsFile, MayBeginLaterThanItsRun) {
  const MetricsRows later = rows("x,time_step\na,7\nb,8\n", 5);
  EXPECT_EQ(later.begin, 7U);
  EXPECT_EQ(later.end(), 9U);
  EXPECT_THAT(later.before(5), ElementsAre());
  EXPECT_THAT(later.before(8), ElementsAre("a,7"));
  EXPECT_THAT(later.before(20), ElementsAre("a,7", "b,8"));
  // A row of before the run is none of its own.
  EXPECT_THAT(rows("x,time_step\na,3\nb,4\n", 5).lines, ElementsAre());
}

TEST_F(MetricsFile, OfAnotherRunIsRefused) {
  EXPECT_THAT([&] { rows("y,time_step\na,0\n", 0); },
              ThrowsMessage<InputError>(HasSubstr("its first line is not that of this run")));
}

}  // namespace
}  // namespace scarp

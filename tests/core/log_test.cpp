#include "core/log.h"

#include <gtest/gtest.h>

#include <sstream>

namespace scarp {
namespace {

TEST(Log, WritesPlainLines) {
  std::ostringstream out;
  const Log log(out);
  log.info("step 1 of 3: 100 % {}");
  log.warn("a cap");
  EXPECT_EQ(out.str(), "step 1 of 3: 100 % {}\nwarning: a cap\n");
}

TEST(Log, IsQuietOnRequestButWarns) {
  std::ostringstream out;
  const Log log(out, Log::Level::warnings);
  log.info("step 1 of 3");
  log.warn("a cap");
  EXPECT_EQ(out.str(), "warning: a cap\n");
}

TEST(Log, SaysNothingByDefault) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  const Log log;
  log.info("nobody hears this");
  log.warn("nor this");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Log, TwoLogsDoNotShareAnything) {
  std::ostringstream first;
  std::ostringstream second;
  const Log a(first);
  const Log b(second, Log::Level::warnings);
  a.info("a");
  b.info("b");
  EXPECT_EQ(first.str(), "a\n");
  EXPECT_EQ(second.str(), "");
}

}  // namespace
}  // namespace scarp

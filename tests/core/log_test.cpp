#include "core/log.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <thread>

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
  Log().info("nobody hears this");
  Log().warn("nor this");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Log, LinesOfThreadsDoNotMix) {
  constexpr int count = 2000;
  const std::string one(100, '1');
  const std::string two(100, '2');
  std::ostringstream out;
  const Log log(out);
  const auto write = [&log](const std::string& line) {
    for (int n = 0; n < count; ++n) log.info(line);
  };
  {
    const std::jthread first(write, one);
    const std::jthread second(write, two);
  }
  std::istringstream in(out.str());
  int lines = 0;
  for (std::string line; std::getline(in, line); ++lines) EXPECT_TRUE(line == one || line == two);
  EXPECT_EQ(lines, 2 * count);
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

#include "core/plain_number.h"

#include <gtest/gtest.h>

#include <limits>

namespace scarp {
namespace {

TEST(PlainNumber, HasNoExponentWherePeopleWriteNone) {
  EXPECT_EQ(plain_number(1000, 3), "1000");
  EXPECT_EQ(plain_number(-1234.5, 3), "-1234");
  EXPECT_EQ(plain_number(10800, 4), "10800");
  EXPECT_EQ(plain_number(208.94, 4), "208.9");
  EXPECT_EQ(plain_number(9.996, 3), "10");
  EXPECT_EQ(plain_number(99.96, 3), "100");
  EXPECT_EQ(plain_number(40, 3), "40");
  EXPECT_EQ(plain_number(0.012345, 3), "0.0123");
  EXPECT_EQ(plain_number(0, 3), "0");
  EXPECT_EQ(plain_number(-2.5, 3), "-2.5");
}

TEST(PlainNumber, HasOneForVerySmallAndVeryLargeOnes) {
  EXPECT_EQ(plain_number(1.23456e-5, 3), "1.23e-05");
  EXPECT_EQ(plain_number(2.5e12, 3), "2.5e+12");
  EXPECT_EQ(plain_number(std::numeric_limits<double>::infinity(), 3), "inf");
}

TEST(PlainDuration, HasTheUnitThatPeopleWouldUse) {
  EXPECT_EQ(plain_duration(0.4), "0 s");
  EXPECT_EQ(plain_duration(99), "99 s");
  EXPECT_EQ(plain_duration(100), "2 min");
  EXPECT_EQ(plain_duration(5940), "99 min");
  EXPECT_EQ(plain_duration(6000), "1.7 h");
  EXPECT_EQ(plain_duration(86400), "24.0 h");
}

}  // namespace
}  // namespace scarp

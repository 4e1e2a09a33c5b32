#include "core/error.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

TEST(Assertion, PrintsBothOperandsAndWhere) {
  const int counted = 3;
  EXPECT_DEATH(SCARP_ASSERT(counted, ==, 4),
               "error_test.cpp:[0-9]+: scarp made a mistake: counted == 4 does not hold: 3 against "
               "4. Please report it.");
}

TEST(Assertion, LooksAtItsOperandsOnce) {
  int calls = 0;
  SCARP_ASSERT(++calls, <, 5);
  EXPECT_EQ(calls, 1);
}

}  // namespace
}  // namespace scarp

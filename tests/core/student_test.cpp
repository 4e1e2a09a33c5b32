#include "core/student.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scarp {
namespace {

// Two-sided 95 % points as tables have them.
TEST(Student, HasTheProbabilitiesOfTheTables) {
  EXPECT_NEAR(student_probability(12.7062, 1), 0.95, 1e-6);
  EXPECT_NEAR(student_probability(4.30265, 2), 0.95, 1e-6);
  EXPECT_NEAR(student_probability(3.18245, 3), 0.95, 1e-6);
  EXPECT_NEAR(student_probability(2.77645, 4), 0.95, 1e-6);
  EXPECT_NEAR(student_probability(2.22814, 10), 0.95, 1e-6);
  EXPECT_NEAR(student_probability(2.04227, 30), 0.95, 1e-6);
}

TEST(Student, ThreeStandardErrorsOfManyValuesAreThree) {
  EXPECT_NEAR(three_standard_errors(100000), 3, 1e-3);
  EXPECT_NEAR(three_standard_errors(4), 6.62, 0.01);
  EXPECT_NEAR(student_probability(three_standard_errors(7), 7), std::erf(3 / std::sqrt(2.0)), 1e-9);
  EXPECT_EQ(three_standard_errors(0), INFINITY);
  EXPECT_NEAR(three_standard_errors_chance(), 0.0027, 1e-5);
}

TEST(Student, StandardErrorsLeaveTheChanceThatIsAskedFor) {
  EXPECT_NEAR(standard_errors(0.05, 4), 2.77645, 1e-5);
  for (const double chance : {0.5, 1e-3, 1e-6})
    EXPECT_NEAR(1 - student_probability(standard_errors(chance, 4), 4), chance, 1e-6 * chance);
}

}  // namespace
}  // namespace scarp

#include "models/formula.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "core/error.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using testing::ThrowsMessage;

const std::vector<std::string> names{"F", "ion", "sputter_2"};

float value(const std::string& text, float f = 0.5F, float ion = 0.25F, float sputter = 4) {
  return RateFormula(text, names).at(std::array{f, ion, sputter});
}

TEST(RateFormula, CalculatesAsOneReadsIt) {
  EXPECT_EQ(value("2 nm/s"), 2);
  EXPECT_EQ(value("6 um/min"), 100);
  EXPECT_EQ(value("-8 nm/s * F"), -4);
  EXPECT_EQ(value("1 nm/s + 2 nm/s * F - 8 nm/s * ion"), 0);
  EXPECT_EQ(value("8 nm/s - 2 nm/s - 1 nm/s"), 5);
  EXPECT_EQ(value("8 nm/s / 2 / 2"), 2);
  EXPECT_EQ(value("8 nm/s / 2 * F"), 2);
  EXPECT_EQ(value("-(1 nm/s + 1nm/s) * (F + ion) * sputter_2"), -6);
  EXPECT_EQ(value("--1 nm/s"), 1);
  EXPECT_EQ(value("1 nm/s * -F"), -0.5F);
  EXPECT_EQ(value("2 nm/s / 1 nm/s * 3 nm/s"), 6);
  EXPECT_EQ(value("min(F, ion) * 4 nm/s"), 1);
  EXPECT_EQ(value("max(F * 4 nm/s, 3 nm/s)"), 3);
  EXPECT_EQ(value("sqrt(sputter_2) * 1e1 nm/s"), 20);
  EXPECT_NEAR(value("exp(-F) * 1 nm/s"), std::exp(-0.5), 1e-7);
  EXPECT_EQ(value("0"), 0);
}

TEST(RateFormula, TakesPowersBeforeProductsAndSigns) {
  EXPECT_NEAR(value("-4 nm/s * F^2"), -1, 1e-6);
  EXPECT_NEAR(value("1 nm/s * sputter_2^0.5"), 2, 1e-6);
  EXPECT_NEAR(value("1 nm/s * sputter_2^-1"), 0.25, 1e-7);
  EXPECT_EQ(value("1 nm/s * F^0.3", 0), 0);
  EXPECT_TRUE(std::isinf(value("1 nm/s * F^-0.3", 0)));
  EXPECT_TRUE(std::isnan(value("1 nm/s * (F - 1)^0.5")));
  EXPECT_TRUE(std::isnan(value("sqrt(F - 1) * 1 nm/s")));
  EXPECT_TRUE(std::isinf(value("1 nm/s / (F - F)")));
  for (const char* other : {"1, (F - F) / (F - F)", "(F - F) / (F - F), 1"}) {
    EXPECT_TRUE(std::isnan(value("1 nm/s * min(" + std::string(other) + ")")));
    EXPECT_TRUE(std::isnan(value("1 nm/s * max(" + std::string(other) + ")")));
  }
}

TEST(RateFormula, HasToBeARate) {
  const auto parsing = [](const std::string& text) { return [=] { RateFormula(text, names); }; };
  EXPECT_THAT(parsing("F"), ThrowsMessage<InputError>(HasSubstr("a number, not a rate")));
  EXPECT_THAT(parsing("5"), ThrowsMessage<InputError>(HasSubstr("a number, not a rate")));
  EXPECT_THAT(parsing("1 nm/s + F"), ThrowsMessage<InputError>(StartsWith("column 8: a rate and")));
  EXPECT_THAT(parsing("1 nm/s * 2 nm/s"), ThrowsMessage<InputError>(StartsWith("column 8: ")));
  EXPECT_THAT(parsing("F / 2 nm/s"), ThrowsMessage<InputError>(StartsWith("column 3: ")));
  EXPECT_THAT(parsing("(1 nm/s)^2"), ThrowsMessage<InputError>(HasSubstr("power of a rate")));
  EXPECT_THAT(parsing("sqrt(1 nm/s)"), ThrowsMessage<InputError>(HasSubstr("sqrt of a rate")));
  EXPECT_THAT(parsing("max(F, 1 nm/s)"), ThrowsMessage<InputError>(HasSubstr("max of a rate")));
}

TEST(RateFormula, PointsAtWhatIsWrong) {
  const auto expect = [](const std::string& text, const std::string& message) {
    EXPECT_THAT([&] { RateFormula(text, names); }, ThrowsMessage<InputError>(HasSubstr(message)))
        << text;
  };
  expect("", "column 1: the formula ends too early");
  expect("1 nm/s *", "column 9: the formula ends too early");
  expect("1 nm/s * (F", "column 12: expected ) for the ( in column 10");
  expect("1 nm/s F", "column 8: expected an operator or the end");
  expect("1 nm/s * f", "column 10: there is no f (did you mean F?); there are F, ion, sputter_2");
  expect("1 um * F", "column 1: ");  // a length
  expect("1 nm/s * F^ion", "column 12: expected a number as the exponent");
  expect("1 nm/s * F^11", "column 11: an exponent is at most 10");
  expect("1 nm/s * min(F)", "column 15: min takes two values");
  expect("1 nm/s * sqrt F", "column 14: expected ( after sqrt");
  expect("1 nm/s * sqrt(F", "column 16: expected ) after the values of sqrt");
  expect("5 \xC2\xB5m/min * G", "column 12: there is no G");
  expect("1 nm/s * F \xE2\x88\x92 1 nm/s", "column 12: expected an operator or the end");
  expect("1 nm/s * #", "column 10: expected a number, a name or (");
  expect("1 nm/s * 1e999", "column 10: ");
  expect(std::string(5000, '('), "longer than 4096");
  expect(std::string(4000, '('), "nested too deeply");
  expect(std::string(4000, '-'), "column 4001: the formula ends too early");
}

TEST(RateFormula, HoldsTheDeepestFormulaThatItReads) {
  std::string text = "1 nm/s * F + 0 nm/s * F";
  for (int k = 0; k < 63; ++k) text = "1 nm/s * F + F * max(0 nm/s, " + text + ")";
  EXPECT_NEAR(value(text, 0.5F), 1, 1e-6);
  EXPECT_THROW(value("max(0 nm/s, " + text + ")"), InputError);
}

TEST(RateFormula, HoldsManyParenthesesSideBySide) {
  std::string text = "0";
  for (int k = 0; k < 200; ++k) text += " +\t(F)";
  EXPECT_EQ(value("1 nm/s * (" + text + ")", 0.5F), 100);
}

TEST(RateFormula, TakesWordsOfAsciiAsNames) {
  for (const char* name : {"F", "_", "SF6_plus", "minimum"}) EXPECT_TRUE(is_formula_name(name));
  for (const char* name : {"", "6F", "a b", "a-b", "\xC3\xA9", "min", "max", "sqrt", "exp"})
    EXPECT_FALSE(is_formula_name(name)) << name;
}

TEST(RateFormula, KeepsItsText) { EXPECT_EQ(RateFormula(" 2 nm/s*F", names).text(), " 2 nm/s*F"); }

}  // namespace
}  // namespace scarp

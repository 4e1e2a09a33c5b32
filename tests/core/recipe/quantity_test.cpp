#include "core/recipe/quantity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

std::string message(std::string_view text, Dimension dimension) {
  try {
    parse_quantity(text, dimension);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Quantity, ReadsEveryDimensionInTheUnitOfTheInside) {
  EXPECT_EQ(parse_quantity("4 um", Dimension::length), 4000);
  EXPECT_EQ(parse_quantity("3 A", Dimension::length), 0.3);
  EXPECT_EQ(parse_quantity("2.5 mm", Dimension::length), 2.5e6);
  EXPECT_EQ(parse_quantity("1.6 min", Dimension::time), 96);
  EXPECT_EQ(parse_quantity("2 h", Dimension::time), 7200);
  EXPECT_EQ(parse_quantity("100 eV", Dimension::energy), 100);
  EXPECT_EQ(parse_quantity("0.1 keV", Dimension::energy), 100);
  EXPECT_DOUBLE_EQ(parse_quantity("180 deg", Dimension::angle), std::numbers::pi);
  EXPECT_EQ(parse_quantity("0.5 rad", Dimension::angle), 0.5);
  EXPECT_DOUBLE_EQ(parse_quantity("1 um/min", Dimension::rate), 1000.0 / 60);
  EXPECT_EQ(parse_quantity("4 nm/s", Dimension::rate), 4);
  EXPECT_EQ(parse_quantity("12e15 /cm2/s", Dimension::flux), 12);
  EXPECT_EQ(parse_quantity("1e19 /m2/s", Dimension::flux), 1);
  EXPECT_EQ(parse_quantity("5.02e22 /cm3", Dimension::density), 5.02);
  EXPECT_EQ(parse_quantity("3.36e15 /cm2", Dimension::areal_density), 3.36);
  EXPECT_EQ(parse_quantity("3.36e19 /m2", Dimension::areal_density), 3.36);
  EXPECT_DOUBLE_EQ(parse_quantity("220 degC", Dimension::temperature), 493.15);
  EXPECT_DOUBLE_EQ(parse_quantity("760 Torr", Dimension::pressure), 101325);
  EXPECT_EQ(parse_quantity("1e-6 cm2/s", Dimension::diffusivity), 1e8);
  EXPECT_EQ(parse_quantity("50 nm2/s", Dimension::diffusivity), 50);
  EXPECT_EQ(parse_quantity("20 %", Dimension::percentage), 0.2);
  EXPECT_EQ(parse_quantity("0.5%", Dimension::percentage), 0.005);
  EXPECT_EQ(parse_quantity("0.1", Dimension::number), 0.1);
}

TEST(Quantity, KnowsTheSizeOfEveryUnit) {
  struct Case {
    Dimension dimension;
    std::string unit;
    double size;  // in the unit of the inside
  };
  const double degree = std::numbers::pi / 180;
  const double torr = 101325.0 / 760;
  const std::vector<Case> cases{{Dimension::length, "nm", 1},
                                {Dimension::length, "um", 1e3},
                                {Dimension::length, "mm", 1e6},
                                {Dimension::length, "cm", 1e7},
                                {Dimension::length, "m", 1e9},
                                {Dimension::length, "A", 0.1},
                                {Dimension::length, "angstrom", 0.1},
                                {Dimension::time, "s", 1},
                                {Dimension::time, "ms", 1e-3},
                                {Dimension::time, "us", 1e-6},
                                {Dimension::time, "min", 60},
                                {Dimension::time, "h", 3600},
                                {Dimension::energy, "eV", 1},
                                {Dimension::energy, "meV", 1e-3},
                                {Dimension::energy, "keV", 1e3},
                                {Dimension::energy, "MeV", 1e6},
                                {Dimension::angle, "deg", degree},
                                {Dimension::angle, "\u00b0", degree},
                                {Dimension::angle, "rad", 1},
                                {Dimension::angle, "mrad", 1e-3},
                                {Dimension::temperature, "K", 1},
                                {Dimension::pressure, "Pa", 1},
                                {Dimension::pressure, "mPa", 1e-3},
                                {Dimension::pressure, "kPa", 1e3},
                                {Dimension::pressure, "bar", 1e5},
                                {Dimension::pressure, "mbar", 100},
                                {Dimension::pressure, "atm", 101325},
                                {Dimension::pressure, "Torr", torr},
                                {Dimension::pressure, "mTorr", 1e-3 * torr}};
  for (const Case& each : cases)
    EXPECT_DOUBLE_EQ(parse_quantity("7 " + each.unit, each.dimension), 7 * each.size) << each.unit;
  EXPECT_DOUBLE_EQ(parse_quantity("7 \u00b0C", Dimension::temperature), 280.15);
}

// What a hint says has to be what was meant: the same value, or none.
TEST(Quantity, HintsAreOfTheSameSize) {
  const std::vector<std::tuple<std::string, Dimension, std::string>> cases{
      {"0.8 micron", Dimension::length, "write \"0.8 um\""},
      {"10 NM", Dimension::length, "write \"10 nm\""},
      {"2 minutes", Dimension::time, "write \"2 min\""},
      {"90 Seconds", Dimension::time, "write \"90 s\""},
      {"20 C", Dimension::temperature, "write \"20 degC\""},
      {"1 micron/hour", Dimension::rate, "write \"1 um/h\""},
      {"5 nm per sec", Dimension::rate, "write \"5 nm/s\""},
      {"300 ev", Dimension::energy, "write \"300 eV\""},
      {"5 mTORR", Dimension::pressure, "write \"5 mTorr\""},
      {"2 m", Dimension::time, "a time is wanted, in s, min or h"},
      {"3 furlong", Dimension::length, "\"furlong\" is not a unit; write it in nm or um"},
      {"0,8 um", Dimension::length, "a comma is no decimal point; write \"0.8 um\""},
      {"1,000 nm", Dimension::length, "write \"1.000 nm\" or \"1000 nm\""},
      {"1'000 nm", Dimension::length, "write \"1000 nm\""},
      {"1 000 nm", Dimension::length, "write \"1000 nm\""},
      {"1 000 000 nm", Dimension::length, "write \"1000000 nm\""},
      {"1,000,000 nm", Dimension::length, "write \"1000000 nm\""},
      {"1.000.000 nm", Dimension::length, "write \"1000000 nm\""},
      {"1.000,5 nm", Dimension::length, "write \"1000.5 nm\""},
      {"1,000.5 nm", Dimension::length, "write \"1000.5 nm\""},
      {"1'000.5 nm", Dimension::length, "write \"1000.5 nm\""},
      {"0,5", Dimension::number, "write \"0.5\""}};
  for (const auto& [text, dimension, hint] : cases) {
    const std::string said = message(text, dimension);
    EXPECT_THAT(said, testing::HasSubstr(hint));
  }
  EXPECT_EQ(parse_quantity("200 \u00c5", Dimension::length), 20);
  EXPECT_EQ(parse_quantity("200 \u212b", Dimension::length), 20);
  EXPECT_DOUBLE_EQ(parse_quantity("600 \u00c5/min", Dimension::rate), 1);
}

TEST(Quantity, ReadsTheUsualSpellingsOfAUnit) {
  for (const char* text : {"12e15 /cm2/s", "1.2e16 1/cm2/s", "12e15 cm^-2 s^-1", "12E15 cm-2 s-1",
                           "12e+15 s^-1 cm^-2", "12e15 cm^-2/s", "12e15/cm^2/s"}) {
    EXPECT_EQ(parse_quantity(text, Dimension::flux), 12) << text;
  }
  for (const char* text :
       {"4um", " 4 um ", "+4 um", "4.0 um", "4. um", ".4e1 \u00b5m", "4 \u03bcm"}) {
    EXPECT_EQ(parse_quantity(text, Dimension::length), 4000) << text;
  }
  EXPECT_EQ(parse_quantity("5eV", Dimension::energy), 5);
}

TEST(Quantity, GivesTheSameBitsInUnitsThatDifferByPowersOfTen) {
  EXPECT_EQ(parse_quantity("0.57 um", Dimension::length),
            parse_quantity("570 nm", Dimension::length));
  EXPECT_EQ(parse_quantity("1e-4 mm", Dimension::length), 100);
  EXPECT_EQ(parse_quantity("0.0001003 m", Dimension::length), 100300);
}

// Machines have few locales: the test makes one with a decimal comma.
TEST(Quantity, DoesNotDependOnTheLocale) {
  const TemporaryFolder folder;
  const std::string source = (folder / "comma.src").string();
  std::ofstream(source) << "LC_NUMERIC\ndecimal_point \",\"\nthousands_sep \".\"\n"
                           "grouping 3;3\nEND LC_NUMERIC\n";
  const std::string command =
      "localedef -c --quiet -i " + source + " " + (folder / "comma").string() + " 2>/dev/null";
  // It tells of the categories that are missing here.
  [[maybe_unused]] const int status = std::system(command.c_str());
  setenv("LOCPATH", folder.string().c_str(), 1);
  const std::string before = std::setlocale(LC_ALL, nullptr);
  if (std::setlocale(LC_ALL, "comma") == nullptr) GTEST_SKIP() << "localedef makes no locale";
  EXPECT_EQ(std::strtod("0,5", nullptr), 0.5);  // as the locale says
  EXPECT_EQ(parse_quantity("0.5 nm", Dimension::length), 0.5);
  EXPECT_EQ(parse_quantity("1500.25 nm", Dimension::length), 1500.25);
  EXPECT_EQ(format_quantity(0.5, Dimension::length), "0.5 nm");
  std::setlocale(LC_ALL, before.c_str());
  unsetenv("LOCPATH");
}

TEST(Quantity, SaysWhatIsWrongAndShowsWhatIsRight) {
  EXPECT_EQ(message("5", Dimension::length), "\"5\" has no unit; write for example \"5 nm\"");
  EXPECT_EQ(message("5 s", Dimension::length),
            "\"5 s\" is a time; a length is wanted, in nm or um");
  EXPECT_EQ(message("1 um", Dimension::rate),
            "\"1 um\" is a length; a rate is wanted, in nm/s, nm/min or um/min");
  EXPECT_EQ(message("5 nmm", Dimension::length),
            "\"5 nmm\": \"nmm\" is not a unit; write it in nm or um");
  EXPECT_EQ(message("5 nm nm", Dimension::length),
            "\"5 nm nm\" is not a length; write it in nm or um");
  EXPECT_EQ(message("", Dimension::time), "\"\" is not a time; write for example \"5 s\"");
  EXPECT_EQ(message("nan nm", Dimension::length),
            "\"nan nm\" is not a length; write for example \"5 nm\"");
  EXPECT_EQ(message("12", Dimension::flux),
            "\"12\" has no unit; write for example \"1e15 /cm2/s\"");
  EXPECT_EQ(message("1e15 /cm2/s", Dimension::areal_density),
            "\"1e15 /cm2/s\" is a flux; an areal density is wanted, in /cm2");
  EXPECT_EQ(message("1e400 nm", Dimension::length),
            "\"1e400 nm\" is beyond the numbers that can be held");
}

TEST(Quantity, RefusesWhatIsNotANumberWithAUnit) {
  for (const char* text :
       {"inf nm", "-inf nm", "0x10 nm", "1,5 nm", "1..5 nm", "nm", "- nm", "5 nm!", "5 /nm",
        "5 nm/", "5 //nm", "5 nm5", "5 1e9999 nm", "5 nm^99", "1e99999999999 nm", "5 degC nm"}) {
    EXPECT_THROW(parse_quantity(text, Dimension::length), InputError) << text;
  }
  EXPECT_THROW(parse_quantity("5 degC/s", Dimension::temperature), InputError);
  EXPECT_THROW(parse_quantity("5 nm", Dimension::number), InputError);
  EXPECT_THROW(parse_quantity("5 //cm2/s", Dimension::flux), InputError);
}

TEST(Quantity, WritesAShortText) {
  EXPECT_EQ(format_quantity(4000, Dimension::length), "4 um");
  EXPECT_EQ(format_quantity(0.6, Dimension::length), "0.6 nm");
  EXPECT_EQ(format_quantity(-400, Dimension::length), "-400 nm");
  EXPECT_EQ(format_quantity(1234567, Dimension::length), "1234.567 um");
  EXPECT_EQ(format_quantity(96, Dimension::time), "96 s");
  EXPECT_EQ(format_quantity(7200, Dimension::time), "2 h");
  EXPECT_EQ(format_quantity(1000.0 / 60, Dimension::rate), "1 um/min");
  EXPECT_EQ(format_quantity(parse_quantity("10 deg", Dimension::angle), Dimension::angle),
            "10 deg");
  EXPECT_EQ(format_quantity(12, Dimension::flux), "1.2e16 /cm2/s");
  EXPECT_EQ(format_quantity(0.2, Dimension::percentage), "20 %");
  EXPECT_EQ(format_quantity(5.02, Dimension::density), "5.02e22 /cm3");
  EXPECT_EQ(format_quantity(3.36, Dimension::areal_density), "3.36e15 /cm2");
  EXPECT_EQ(format_quantity(1e8, Dimension::diffusivity), "1e-6 cm2/s");
  EXPECT_EQ(format_quantity(50, Dimension::diffusivity), "5e-13 cm2/s");
  EXPECT_EQ(format_quantity(0, Dimension::time), "0 s");
  EXPECT_EQ(format_quantity(0.1, Dimension::number), "0.1");
}

TEST(Quantity, WritesNumbersAsTheyAreRead) {
  EXPECT_EQ(format_number(0.1), "0.1");
  EXPECT_EQ(format_number(-250000), "-250000");
  EXPECT_EQ(format_number(0.00025), "0.00025");
  EXPECT_EQ(format_number(0.000025), "2.5e-5");
  EXPECT_EQ(format_number(1e22), "1e22");
  EXPECT_EQ(format_number(1.5e-300), "1.5e-300");
}

TEST(Quantity, ReadsWhatItWroteToTheLastBit) {
  RandomStream random({.seed = 3});
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t bits = (std::uint64_t{random.bits()} << 32) | random.bits();
    double value = 0;
    std::memcpy(&value, &bits, sizeof value);
    // Beyond this a change of unit would leave the range of double.
    if (!std::isfinite(value) || std::abs(value) > 1e280 || std::abs(value) < 1e-280) continue;
    for (int d = 0; d <= static_cast<int>(Dimension::number); ++d) {
      const auto dimension = static_cast<Dimension>(d);
      const std::string text = format_quantity(value, dimension);
      ASSERT_EQ(parse_quantity(text, dimension), value) << text;
    }
  }
}

}  // namespace
}  // namespace scarp

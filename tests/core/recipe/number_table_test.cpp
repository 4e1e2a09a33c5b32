#include "core/recipe/number_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <numbers>

#include "core/error.h"

namespace scarp {
namespace {

using testing::ElementsAre;

constexpr std::array angles{Column{"angle", Dimension::angle}, Column{"density"}};

NumberTable read(const std::string& csv) { return read_csv("t.csv", csv, angles); }

TEST(NumberTable, HoldsTheRowsOfACsvFileInTheUnitsOfTheInside) {
  const NumberTable table = read("# probe\nangle [deg], density [1/sr]\n0,2\n\n90, 1e-1\n");
  EXPECT_THAT(table.column(0), ElementsAre(0, std::numbers::pi / 2));
  EXPECT_THAT(table.column(1), ElementsAre(2, 0.1));
  EXPECT_THAT(table.lines, ElementsAre(3, 5));
  EXPECT_THAT(read("angle [rad],density\n1,2\n").values[0], ElementsAre(1, 2));
  EXPECT_TRUE(read("angle [rad],density\n").values.empty());
}

TEST(NumberTable, HasAHeadThatNamesColumnsAndUnits) {
  EXPECT_EQ(csv_head(angles), "angle [deg],density");
  EXPECT_THAT(read(csv_head(angles) + "\n45,1\n").column(0), ElementsAre(std::numbers::pi / 4));
}

TEST(NumberTable, OfAFileNamesTheLineThatIsWrong) {
  const auto message = [](const std::string& csv) {
    try {
      read(csv);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  using testing::EndsWith;
  const std::string names = "t.csv:1: has to name the columns: \"angle [deg],density\"";
  EXPECT_THAT(message(""), EndsWith(names));
  for (const std::string head : {"angle [deg]", "angle [deg],density,more", "angle [deg,density",
                                 "density,angle [deg]", "0,1", "angle (deg),density"})
    EXPECT_THAT(message(head + '\n'), EndsWith(names + "; it is \"" + head + '"'));
  EXPECT_THAT(message("angle,density\n"),
              EndsWith("t.csv:1: gives no unit for angle; write \"angle [deg],density\", with the "
                       "units that the numbers below have"));
  EXPECT_THAT(message("angle [eV],density\n"),
              EndsWith("t.csv:1: \"1 eV\" is an energy; an angle is wanted, in deg or rad"));
  EXPECT_THAT(message("angle [deg],density\n1,2\n1;2\n"),
              EndsWith("t.csv:3: has 1 columns; 2 are wanted"));
  EXPECT_THAT(message("angle [deg],density\n1 rad,2\n"), testing::HasSubstr("t.csv:2: "));
}

}  // namespace
}  // namespace scarp

#include "core/recipe/csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace scarp {
namespace {

using testing::ElementsAre;

TEST(Csv, GivesTheCellsOfLinesThatHoldSomething) {
  const auto lines = parse_csv("a [eV], b\n\n# measured\n  1 ,2\t\n,\n3");
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_THAT(lines[0].cells, ElementsAre("a [eV]", "b"));
  EXPECT_THAT(lines[1].cells, ElementsAre("1", "2"));
  EXPECT_THAT(lines[2].cells, ElementsAre("", ""));
  EXPECT_THAT(lines[3].cells, ElementsAre("3"));
  EXPECT_EQ(lines[0].number, 1U);
  EXPECT_EQ(lines[1].number, 4U);
  EXPECT_EQ(lines[3].number, 6U);
}

TEST(Csv, TakesWhatSpreadsheetsAddForNothing) {
  const auto lines = parse_csv("\xEF\xBB\xBFx,y\r\n1,2\r\n");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_THAT(lines[0].cells, ElementsAre("x", "y"));
  EXPECT_THAT(lines[1].cells, ElementsAre("1", "2"));
  EXPECT_TRUE(parse_csv("").empty());
}

TEST(Csv, CellsInQuotesComeBackAsTheyWere) {
  const std::string name = "a \"thin\", long film";
  const auto lines = parse_csv("1," + csv_field(name) + ",,2\n \"x\" , y\"z\n");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_THAT(lines[0].cells, ElementsAre("1", name, "", "2"));
  EXPECT_THAT(lines[1].cells, ElementsAre("x", "y\"z"));
}

}  // namespace
}  // namespace scarp

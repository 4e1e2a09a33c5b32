#include "apps/run/svg.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace scarp {
namespace {

using ::testing::ElementsAre;

TEST(Escaped, NothingOpensOrEndsWhatXmlHas) {
  EXPECT_EQ(escaped("a]]>b <i> & \"c\""), "a]]&gt;b &lt;i&gt; &amp; &quot;c&quot;");
}

TEST(SvgLine, BeginsOnceAndHasAsManyDecimalsAsAskedFor) {
  const std::vector<std::array<double, 2>> points{{0, 1.26}, {2, -3}};
  EXPECT_EQ(svg_line(points), "M0.0 1.3L2.0 -3.0");
  EXPECT_EQ(svg_line(points, 2), "M0.00 1.26L2.00 -3.00");
  EXPECT_EQ(svg_line({}), "");
}

TEST(SvgText, IsEscaped) {
  EXPECT_EQ(svg_text(1, 2, "a < b", "end"),
            "<text x=\"1.0\" y=\"2.0\" text-anchor=\"end\">a &lt; b</text>\n");
}

TEST(RoundNumbers, AreOneTwoOrFiveTimesAPowerOfTen) {
  EXPECT_DOUBLE_EQ(rounded_up(1), 1);
  EXPECT_DOUBLE_EQ(rounded_up(1.01), 2);
  EXPECT_DOUBLE_EQ(rounded_up(0.03), 0.05);
  EXPECT_DOUBLE_EQ(rounded_up(700), 1000);
  EXPECT_DOUBLE_EQ(rounded_down(1.99), 1);
  EXPECT_DOUBLE_EQ(rounded_down(2), 2);
  EXPECT_DOUBLE_EQ(rounded_down(0.049), 0.02);
  EXPECT_DOUBLE_EQ(rounded_down(700), 500);
}

TEST(Ticks, DivideARangeIntoSoManyPartsAtMost) {
  EXPECT_THAT(ticks_within(-9, 11, 5), ElementsAre(-5, 0, 5, 10));
  EXPECT_THAT(ticks_within(-9, 11, 10), ElementsAre(-8, -6, -4, -2, 0, 2, 4, 6, 8, 10));
}

TEST(LegendRows, EndBeforeTheRightSideUnlessANameIsTooLong) {
  LegendRows rows(10, 100, 200, 18);
  EXPECT_THAT(rows.place(500), ElementsAre(10, 200));
  EXPECT_THAT(rows.place(60), ElementsAre(10, 218));
  EXPECT_THAT(rows.place(30), ElementsAre(70, 218));
  EXPECT_THAT(rows.place(1), ElementsAre(10, 236));
  EXPECT_EQ(rows.more_height(), 36);
}

}  // namespace
}  // namespace scarp

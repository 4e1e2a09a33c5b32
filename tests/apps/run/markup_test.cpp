#include "apps/run/markup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace scarp {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A run with three films has nine thicknesses in one plot.
TEST(PlotSvg, CurvesBeyondTheColoursOfAPageAreDashed) {
  Plot plot{.title = "Films", .x_label = "t [s]", .y_label = "[nm]", .curves = {}};
  for (std::size_t n = 0; n < 9; ++n) {
    const auto height = static_cast<double>(n);
    plot.curves.push_back({.name = "film", .colour = n, .lines = {{{0, height}, {1, height}}}});
  }
  const std::string svg = plot_svg(plot);
  EXPECT_THAT(svg, HasSubstr("class=\"curve c5\""));
  EXPECT_THAT(svg, HasSubstr("class=\"curve c0 dashed\""));
  EXPECT_THAT(svg, HasSubstr("class=\"curve c2 dashed\""));
  EXPECT_THAT(svg, Not(HasSubstr("curve c6")));
}

// Fluxes of a flat wafer.
TEST(PlotSvg, WhatDiffersByItsRoundingIsOneValue) {
  const Plot plot{.title = "Flux",
                  .x_label = "x [nm]",
                  .y_label = "",
                  .curves = {{.name = "flux", .lines = {{{0, 1}, {1, 1 - 1e-16}, {2, 1}}}}}};
  EXPECT_LT(plot_svg(plot).size(), 10000U);
}

// Widths of a wall that does not move, as a mesh in single precision gives them.
TEST(PlotSvg, LabelsOfAConstantDiffer) {
  const auto upright = [](double low, double high) {
    Plot plot{.title = "Widths", .x_label = "t [s]", .y_label = "[nm]", .curves = {}};
    plot.curves = {{.name = "cd", .lines = {{{0, low}, {1, high}, {2, low}}}}};
    const std::string svg = plot_svg(plot);
    std::vector<std::string> labels;
    const std::string mark = "text-anchor=\"end\">";
    for (std::size_t at = 0; (at = svg.find(mark, at)) != std::string::npos;) {
      at += mark.size();
      labels.push_back(svg.substr(at, svg.find('<', at) - at));
    }
    return labels;
  };
  EXPECT_THAT(upright(40.99970, 40.99971), testing::Contains("40"));
  for (const auto& labels : {upright(40.99970, 40.99971), upright(1e6, 1e6 + 20), upright(3, 4)}) {
    const std::set<std::string> different(labels.begin(), labels.end());
    EXPECT_GE(labels.size(), 3U);
    EXPECT_EQ(different.size(), labels.size());
  }
}

TEST(BarSvg, PartsFollowOnEachOther) {
  const std::vector<BarPart> parts{{"flux", 3}, {"advection", 1}};
  const std::string svg = bar_svg("Time", "s", parts);
  EXPECT_THAT(svg, HasSubstr("Time: 4 s"));
  EXPECT_THAT(svg, HasSubstr("flux: 3 s (75 %)"));
  EXPECT_THAT(svg, HasSubstr("advection: 1 s (25 %)"));
  // Places and lengths of the two pieces.
  const auto piece = [&](const std::string& colour) {
    const std::string mark = "<path class=\"bar " + colour + "\" d=\"M";
    std::array<double, 3> found{};
    const std::size_t at = svg.find(mark);
    EXPECT_NE(at, std::string::npos);
    std::istringstream in(svg.substr(at + mark.size(), 40));
    char letter = 0;
    in >> found[0] >> found[1] >> letter >> found[2];
    EXPECT_EQ(letter, 'h');
    return found;
  };
  const auto flux = piece("c0");
  const auto advection = piece("c1");
  EXPECT_NEAR(flux[0] + flux[2], advection[0], 0.11);
  EXPECT_NEAR(flux[2], 3 * advection[2], 0.4);
  EXPECT_EQ(flux[1], advection[1]);
}

}  // namespace
}  // namespace scarp

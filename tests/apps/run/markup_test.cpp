#include "apps/run/markup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace scarp

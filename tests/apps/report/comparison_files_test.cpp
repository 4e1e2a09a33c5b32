#include "apps/report/comparison_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>

namespace scarp {
namespace {

/// The lines of the curves of a page by their classes, in their order.
std::map<std::string, std::vector<std::string>> curves_of(const std::string& page) {
  std::map<std::string, std::vector<std::string>> curves;
  const std::string mark = "<path class=\"curve ";
  for (std::size_t at = 0; (at = page.find(mark, at)) != std::string::npos;) {
    at += mark.size();
    const std::size_t end = page.find('"', at);
    const std::size_t line = page.find("d=\"", end) + 3;
    const std::string points = page.substr(line, page.find('"', line) - line);
    // Samples in the legend go a way to the right.
    if (points.find('h') == std::string::npos) curves[page.substr(at, end - at)].push_back(points);
  }
  return curves;
}

TEST(ComparisonPage, WhatIsTheSameLiesOnEachOther) {
  const std::vector<Polyline> surface{{.points = {{0, 0}, {300, -50}, {1000, 20}}}};
  Comparison comparison{.first = "one", .second = "other", .spacing = 10};
  comparison.profiles = {{.time = 5, .first = surface, .second = surface}};
  comparison.fluxes = {{.time = 5,
                        .name = "gas",
                        .place = {0, 400, 800},
                        .first = {1, 0.5, 0.8},
                        .second = {1, 0.5, 0.8}}};
  const PageEntry entry{.comparison = comparison};
  const auto curves =
      curves_of(comparison_page(std::span(&entry, 1), {.title = "Both", .recipe = ""}));
  ASSERT_TRUE(curves.contains("c0"));
  ASSERT_TRUE(curves.contains("c1 dashed"));
  EXPECT_GE(curves.at("c0").size(), 2U);
  // Profiles and fluxes; the distance between profiles comes between them.
  EXPECT_EQ(curves.at("c0").front(), curves.at("c1 dashed").front());
  EXPECT_EQ(curves.at("c0").back(), curves.at("c1 dashed").back());
}

}  // namespace
}  // namespace scarp

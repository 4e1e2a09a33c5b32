#include "apps/picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/temporary_folder.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

/// A flat layer 1 um wide with its top at a height.
LayerProfile flat(const Materials& materials, const char* name, double z) {
  return {materials.id(name), {{{{-500, z}, {500, z}}}}};
}

std::string picture(const std::vector<LayerProfile>& layers, const Materials& materials) {
  const TemporaryFolder folder;
  const fs::path file = folder / "picture.svg";
  write_svg(file, {.title = "t", .layers = layers, .left = -500, .right = 500}, materials);
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// The colour of a material in the legend; empty if it is not there.
std::string colour(const std::string& svg, const std::string& name) {
  const std::size_t at = svg.find('>' + name + "</text>");
  if (at == std::string::npos) return "";
  const std::size_t fill = svg.rfind("fill=\"", at) + 6;
  return svg.substr(fill, svg.find('"', fill) - fill);
}

TEST(Picture, AMaterialHasTheSameColourInEveryPicture) {
  const Materials m;
  const std::string one = picture({flat(m, "Si", 0), flat(m, "resist", 10)}, m);
  const std::string two = picture({flat(m, "Si", 0), flat(m, "SiO2", 5), flat(m, "resist", 10)}, m);
  EXPECT_FALSE(colour(one, "resist").empty());
  EXPECT_EQ(colour(one, "resist"), colour(two, "resist"));
  EXPECT_EQ(colour(one, "Si"), colour(two, "Si"));
  EXPECT_THAT(one, HasSubstr("fill=\"" + colour(one, "resist") + "\" fill-rule"));
}

TEST(Picture, AllBuiltInMaterialsDiffer) {
  const Materials m;
  std::vector<LayerProfile> layers;
  for (const std::string& name : m.names()) {
    layers.push_back(flat(m, name.c_str(), static_cast<double>(layers.size())));
  }
  const std::string svg = picture(layers, m);
  std::vector<std::string> colours;
  for (const std::string& name : m.names()) {
    EXPECT_THAT(colours, Not(::testing::Contains(colour(svg, name)))) << name;
    colours.push_back(colour(svg, name));
  }
}

TEST(Picture, TheLegendLeavesOutWhatIsGone) {
  const Materials m;
  const std::string svg = picture({flat(m, "Si", 0), flat(m, "SiO2", 0), flat(m, "resist", 10)}, m);
  EXPECT_EQ(colour(svg, "SiO2"), "");
  EXPECT_NE(colour(svg, "Si"), "");
  EXPECT_NE(colour(svg, "resist"), "");
}

TEST(Picture, TheLegendLeavesOutTracesBetweenLayersButNoThinFilm) {
  const Materials m;
  LayerProfile trace = flat(m, "SiO2", 0);
  trace.lines[0].points.insert(trace.lines[0].points.begin() + 1, {0, 0.001});
  const std::string svg =
      picture({flat(m, "Si", 0), trace, {m.id("Si3N4"), {}}, flat(m, "resist", 0.01)}, m);
  EXPECT_EQ(colour(svg, "SiO2"), "");
  EXPECT_EQ(colour(svg, "Si3N4"), "");
  EXPECT_NE(colour(svg, "Si"), "");
  EXPECT_NE(colour(svg, "resist"), "");
}

TEST(Picture, TheLegendEndsBeforeTheScaleBar) {
  Materials m;
  std::vector<LayerProfile> layers;
  for (int k = 0; k < 12; ++k) {
    const std::string name = "a material with a long name " + std::to_string(k);
    m.add({name, 1});
    layers.push_back(flat(m, name.c_str(), k));
  }
  const std::string svg = picture(layers, m);
  const std::size_t bar = svg.find("<path d=\"M", svg.find("</g>")) + 10;
  const double bar_begins = std::strtod(svg.c_str() + bar, nullptr);
  EXPECT_GT(bar_begins, 300);
  std::size_t at = svg.find("<rect x=", svg.find("</g>"));
  std::size_t count = 0;
  for (; at != std::string::npos; at = svg.find("<rect x=", at + 1), ++count) {
    EXPECT_LT(std::strtod(svg.c_str() + at + 9, nullptr) + 20 + 7 * 29, bar_begins);
  }
  EXPECT_EQ(count, 12U);
}

}  // namespace
}  // namespace scarp

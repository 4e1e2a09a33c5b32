#include "apps/run/picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
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

TEST(Picture, EarlierSurfacesAreNestedContoursFromBlueToRed) {
  const Materials m;
  const TemporaryFolder folder;
  const fs::path file = folder / "picture.svg";
  const auto at = [](double z) { return std::vector<Polyline>{{{{-500, z}, {500, z}}}}; };
  const ProfileView view{.title = "t",
                         .layers = {flat(m, "Si", -40)},
                         .left = -500,
                         .right = 500,
                         .earlier = {{.time = 5, .lines = at(90)},
                                     {.time = 10, .lines = at(20)},
                                     {.time = 15, .lines = at(0)}}};
  write_svg(file, view, m);
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  const std::string svg = text.str();
  EXPECT_THAT(svg, HasSubstr("stroke=\"hsl(240, 85%, 38%)\""));
  EXPECT_THAT(svg, HasSubstr("stroke=\"hsl(120, 85%, 38%)\""));
  EXPECT_THAT(svg, HasSubstr("stroke=\"hsl(0, 85%, 38%)\""));
  EXPECT_THAT(svg, HasSubstr(">t = 5 s</text>"));
  EXPECT_THAT(svg, HasSubstr(">t = 15 s</text>"));
  // The window holds all of them: one pixel is 1000 / 672 nm, with 60 nm of room at both ends.
  EXPECT_THAT(svg, HasSubstr("M24.00 64.32L696.00 64.32\" fill=\"none\""));
}

// A pixel is 1000 / 672 nm: of the bend a fifth of a pixel is seen, of the ripple nothing.
TEST(Picture, LinesKeepThePointsThatAreSeen) {
  const Materials m;
  // The line alone, without what closes it along the sides and the bottom.
  const auto drawn = [&](const Polyline& line) {
    const std::string svg = picture({{m.id("Si"), {line}}}, m);
    const std::size_t begin = svg.find("<path d=\"") + 9;
    const std::string path = svg.substr(begin, svg.find('"', begin) - begin);
    return path.substr(0, path.rfind('L', path.rfind('L') - 1));
  };
  Polyline trench;
  for (double x = -500; x < -84; ++x) trench.points.push_back({x, 0.05 * std::fmod(x, 2)});
  for (double z = 0; z > -168; --z) trench.points.push_back({-84, z});
  for (double x = -84; x < 84; ++x) trench.points.push_back({x, -168});
  for (double z = -168; z < 0; ++z) trench.points.push_back({84, z});
  for (double x = 84; x <= 500; ++x) trench.points.push_back({x, 0});
  EXPECT_THAT(
      drawn(trench),
      MatchesRegex("M24.00 [0-9.]+(L303.55 [0-9.]+){2}(L416.45 [0-9.]+){2}L696.00 [0-9.]+"));
  EXPECT_THAT(drawn({{{-500, 0}, {0, 0.3}, {500, 0}}}),
              MatchesRegex("M24.00 [0-9.]+L360.00 [0-9.]+L696.00 [0-9.]+"));
  EXPECT_THAT(drawn({{{-500, 0}, {0, 0.1}, {500, 0}}}),
              MatchesRegex("M24.00 [0-9.]+L696.00 [0-9.]+"));
}

TEST(Picture, ManyEarlierSurfacesAreThinnedOutEvenly) {
  std::vector<EarlierSurface> surfaces;
  surfaces.reserve(100);
  for (int n = 0; n < 100; ++n) surfaces.push_back({.time = 1.0 * n, .lines = {}});
  const std::vector<EarlierSurface> some = some_of(surfaces);
  ASSERT_EQ(some.size(), 40U);
  EXPECT_EQ(some.front().time, 0);
  EXPECT_EQ(some.back().time, 99);
  for (std::size_t n = 1; n < some.size(); ++n)
    EXPECT_NEAR(some[n].time - some[n - 1].time, 2.5, 0.51);
  EXPECT_EQ(some_of(std::span(surfaces).first(7)).size(), 7U);
  EXPECT_EQ(some_of(std::span(surfaces).first(1)).size(), 1U);
}

/// Whether a path of straight lines fills a point, by the even-odd rule.
bool fills(const std::string& path, double x, double y) {
  bool inside = false;
  std::istringstream outlines(path);
  for (std::string outline; std::getline(outlines, outline, 'Z');) {
    for (char& c : outline) c = c == 'M' || c == 'L' ? ' ' : c;
    std::istringstream numbers(outline);
    std::vector<std::array<double, 2>> points;
    for (std::array<double, 2> p{}; numbers >> p[0] >> p[1];) points.push_back(p);
    for (std::size_t n = 0; n < points.size(); ++n) {
      const auto& [x0, y0] = points[n];
      const auto& [x1, y1] = points[(n + 1) % points.size()];
      if ((y0 > y) != (y1 > y) && x < x0 + (y - y0) / (y1 - y0) * (x1 - x0)) inside = !inside;
    }
  }
  return inside;
}

TEST(Picture, FillsTheSolidAndNeitherHolesNorWhatIsAboveIt) {
  const Materials m;
  LayerProfile layer = flat(m, "Si", 0);
  layer.lines.push_back({{{-500, -20}, {-300, -100}, {-500, -180}}});  // at the left side
  layer.lines.push_back({{{500, -180}, {300, -100}, {500, -20}}});     // at the right side
  layer.lines.push_back({{{0, -50}, {50, -100}, {0, -150}, {-50, -100}, {0, -50}}});  // a loop
  const std::string svg = picture({layer}, m);
  const std::size_t begin = svg.find("<path d=\"") + 9;
  const std::string path = svg.substr(begin, svg.find('"', begin) - begin);

  // The surface is the first line: its ends tell the scale.
  std::istringstream first(path.substr(1, path.find('Z')));
  double left = 0;
  double top = 0;
  first >> left >> top;
  const double scale = (std::strtod(path.c_str() + path.find('L') + 1, nullptr) - left) / 1000;
  const auto is_solid = [&](double x, double z) {
    return fills(path, left + (x + 500) * scale, top - z * scale);
  };
  EXPECT_TRUE(is_solid(-200, -100));
  EXPECT_TRUE(is_solid(200, -10));
  EXPECT_TRUE(is_solid(-490, -190));
  EXPECT_FALSE(is_solid(-450, -100));
  EXPECT_FALSE(is_solid(450, -100));
  EXPECT_FALSE(is_solid(0, -100));
  EXPECT_FALSE(is_solid(100, 5));
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

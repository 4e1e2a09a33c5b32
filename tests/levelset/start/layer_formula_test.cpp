#include "levelset/start/layer_formula.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <string>

#include "core/error.h"
#include "levelset/start/polygon.h"

namespace scarp {
namespace {

using testing::HasSubstr;

const RegionGrid formula_grid = region_grid({.spacing = 1, .cells = {100, 100}});

std::string formula_fault(const std::string& text) {
  try {
    LayerFormula{text};
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(LayerFormula, NamesEachLayerOnce) {
  const LayerFormula formula("1/0 + 5 - (1/0 & 1)");
  const std::vector<GdsLayer> wanted{{.layer = 1, .datatype = 0}, {.layer = 5}, {.layer = 1}};
  EXPECT_EQ(formula.layers(), wanted);
}

TEST(LayerFormula, SaysWhatIsWrong) {
  for (const auto& [text, why] : {std::pair{"", "ends too early"},
                                  {"1 +", "ends too early"},
                                  {"1 + + 2", "has no layer at \"+ 2\""},
                                  {"-1", "has no layer at \"-1\""},
                                  {"metal", "has no layer at \"metal\""},
                                  {"1 2", "has no +, - or & before \"2\""},
                                  {"1/ + 2", "has no datatype after the /"},
                                  {"(1 + 2", "has a bracket that nothing closes"},
                                  {"1 + 2)", "has a bracket that nothing opens"},
                                  {"65536", "has a number above 65535"}}) {
    EXPECT_THAT(formula_fault(text), HasSubstr(why)) << text;
    EXPECT_THAT(formula_fault(text), HasSubstr("for example \"1/0 + (2 - 3/0)\"")) << text;
  }
  EXPECT_THAT(formula_fault(std::string(1000, '(')), HasSubstr("has more than 100 brackets"));
}

/// Layers 0 to 4, of rectangles that overlap.
std::vector<std::vector<Loop>> random_layers(std::mt19937& random) {
  std::vector<std::vector<Loop>> layers(5);
  const auto pick = [&](int most) { return static_cast<double>(random() % most); };
  for (auto& layer : layers) {
    for (int n = 0; n < 4; ++n) {
      const Point2 lower{pick(80) - 50, pick(80) - 50};
      layer.push_back(box_loop(lower, {lower[0] + 1 + pick(30), lower[1] + 1 + pick(30)}));
    }
  }
  return layers;
}

bool any_holds(const std::vector<Loop>& boxes, double x, double y) {
  return std::ranges::any_of(boxes, [&](const Loop& box) {
    return box[0][0] < x && x < box[2][0] && box[0][1] < y && y < box[2][1];
  });
}

// Corners are whole numbers: squares of that size are in or out as a whole.
TEST(LayerFormula, HoldsWhatItSaysOfRandomLayers) {
  std::mt19937 random(7);
  for (int seed = 0; seed < 20; ++seed) {
    const auto drawn = random_layers(random);
    std::vector<std::vector<Loop>> regions;
    regions.reserve(drawn.size());
    for (const auto& layer : drawn) regions.push_back(formula_grid.united(layer));
    const auto area_of = [&](const std::string& text) {
      const LayerFormula formula(text);
      std::vector<std::vector<Loop>> chosen;
      for (const GdsLayer& layer : formula.layers())
        chosen.push_back(regions[static_cast<std::size_t>(layer.layer)]);
      return area(formula.region(formula_grid, chosen));
    };
    int sum = 0;
    int loose = 0;
    int bracketed = 0;
    for (int x = -60; x < 80; ++x) {
      for (int y = -60; y < 80; ++y) {
        std::array<bool, 5> in{};
        for (std::size_t n = 0; n < 5; ++n) in[n] = any_holds(drawn[n], x + 0.5, y + 0.5);
        sum += in[0] || in[1] ? 1 : 0;
        loose += ((in[0] && !in[1]) || (in[2] && in[3])) && !in[4] ? 1 : 0;
        bracketed += in[0] && !((in[1] || in[2]) && in[3]) ? 1 : 0;
      }
    }
    EXPECT_DOUBLE_EQ(area_of("0+1"), sum);
    EXPECT_DOUBLE_EQ(area_of("0 - 1 + 2 & 3 - 4"), loose);
    EXPECT_DOUBLE_EQ(area_of("0 - (1 + 2) & 3"), bracketed);
  }
}

}  // namespace
}  // namespace scarp

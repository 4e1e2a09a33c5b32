#include "apps/report/render.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include "apps/run/picture.h"
#include "core/error.h"
#include "core/parallel.h"
#include "levelset/start/shapes.h"
#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr Frame frame{.spacing = 10, .cells = {30, 20}};

Rgb pixel(const Image& image, double x, double y) {
  const auto column = static_cast<std::size_t>(x * image.width);
  const auto row = static_cast<std::size_t>(y * image.height);
  return image.pixels[row * static_cast<std::size_t>(image.width) + column];
}

Rgb times(double factor, const Rgb& colour) {
  Rgb result{};
  for (std::size_t n = 0; n < 3; ++n)
    result[n] = static_cast<std::uint8_t>(std::lround(factor * colour[n]));
  return result;
}

TEST(Render, AFlatWaferFromAboveSeesAllOfTheSky) {
  const Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{.material = 0}});
  const Image image = render(layers, {.elevation = 90, .width = 120});
  EXPECT_EQ(image.width, 120);
  EXPECT_EQ(pixel(image, 0.001, 0.001), (Rgb{255, 255, 255}));
  // The light comes along (-0.5, -0.4, 1).
  const double lit = 1 / std::sqrt(0.25 + 0.16 + 1);
  EXPECT_EQ(pixel(image, 0.5, 0.5), times(0.22 + 0.43 + 0.35 * lit, material_colour(0)));
}

TEST(Render, TheCutShowsTheMaterialsWithin) {
  const Layers layers =
      build_layers(frame, std::vector<Shape>{WaferShape{.material = 0},
                                             LayerShape{.material = 2, .thickness = 80},
                                             TrenchShape{.width = 100, .cut = {.depth = 120}}});
  const Image image = render(
      layers,
      {.cut = RenderCut{.axis = 1, .position = 0}, .azimuth = 0, .elevation = 1, .width = 200});
  // From the front: oxide above silicon on both sides of the trench, which has nothing behind it.
  EXPECT_EQ(pixel(image, 0.2, 0.25), material_colour(2));
  EXPECT_EQ(pixel(image, 0.8, 0.25), material_colour(2));
  EXPECT_EQ(pixel(image, 0.2, 0.8), material_colour(0));
  EXPECT_EQ(pixel(image, 0.5, 0.9), material_colour(0));
  EXPECT_EQ(pixel(image, 0.5, 0.3), (Rgb{255, 255, 255}));
}

// What is deposited later is a copy of the top until then.
TEST(Render, ALayerThatAddsNothingHasNoColour) {
  Layers layers =
      build_layers(frame, std::vector<Shape>{WaferShape{.material = 0},
                                             LayerShape{.material = 2, .thickness = 80},
                                             TrenchShape{.width = 104, .cut = {.depth = 123}}});
  const RenderOptions front{
      .cut = RenderCut{.axis = 1, .position = 3}, .azimuth = 0, .elevation = 1, .width = 1200};
  const Image before = render(layers, front);
  add_layer(layers, 5);
  const Image after = render(layers, front);
  EXPECT_EQ(before.pixels, after.pixels);
  EXPECT_THAT(after.pixels, Not(Contains(material_colour(5))));
}

// Facets in the corner of wall and floor are as high as a spacing.
TEST(Render, WhereMaterialsMeetTheBorderIsStraight) {
  constexpr double depth = 84;
  const Layers layers =
      build_layers(frame, std::vector<Shape>{WaferShape{.material = 0},
                                             LayerShape{.material = 2, .thickness = depth},
                                             TrenchShape{.width = 126, .cut = {.depth = depth}}});
  const Image image = render(layers, {.azimuth = 90, .elevation = 60, .width = 600});
  // From the side: up the wall blue grows over red, on the silicon it hardly does.
  const auto is_oxide = [](const Rgb& colour) { return colour[2] > 1.6 * colour[0]; };
  std::vector<int> rows;
  for (int column = image.width / 10; column < image.width * 9 / 10; ++column) {
    const auto at = [&](int row) {
      return image.pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                          static_cast<std::size_t>(column)];
    };
    int row = image.height / 2;
    while (row > 0 && !is_oxide(at(row))) --row;
    rows.push_back(row);
  }
  const auto [low, high] = std::ranges::minmax(rows);
  EXPECT_GT(low, image.height / 10);
  const double pixel = 200.0 / image.width;
  EXPECT_LE((high - low) * pixel, 0.2 * frame.spacing);
}

TEST(Render, TheBottomOfAHoleIsDarkerThanTheField) {
  const Layers layers = build_layers(
      frame, std::vector<Shape>{WaferShape{}, HoleShape{.radius = 50, .cut = {.depth = 150}}});
  const Image image = render(layers, {.elevation = 90, .width = 120});
  EXPECT_LT(pixel(image, 0.5, 0.5)[0], 0.75 * pixel(image, 0.1, 0.5)[0]);
}

// Tiles of two by two pixels reach beyond it.
TEST(Render, APictureOfOddSizeIsComplete) {
  const Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}});
  bool has_odd_height = false;
  for (const int width : {121, 123, 125, 127}) {
    const Image image = render(layers, {.elevation = 90, .width = width});
    has_odd_height = has_odd_height || image.height % 2 == 1;
    EXPECT_THAT(image.pixels, Not(Contains(Rgb{0, 0, 0}))) << width;
  }
  EXPECT_TRUE(has_odd_height);
}

// A deep hole is not drawn on a picture of many screens.
TEST(Render, IsAtMostTwiceAsHighAsAskedToBeWide) {
  const Layers layers = build_layers(
      frame, std::vector<Shape>{WaferShape{}, HoleShape{.radius = 50, .cut = {.depth = 1500}}});
  const Image image = render(layers, {.width = 60, .sky_rays = 1});
  EXPECT_EQ(image.height, 120);
  EXPECT_LT(image.width, 40);
  EXPECT_GT(image.width, 4);
}

TEST(Render, HasTheSameBitsForAnyNumberOfThreads) {
  const Layers layers = build_layers(
      frame, std::vector<Shape>{WaferShape{}, HoleShape{.radius = 50, .cut = {.depth = 150}}});
  const auto with = [&](int threads) {
    const ThreadLimit limit(threads);
    return render(layers, {.width = 80}).pixels;
  };
  EXPECT_EQ(with(1), with(2));
}

TEST(Render, ACrossSectionIsRefused) {
  const Layers layers = build_layers({.spacing = 10, .cells = {30, 1}, .two_dimensional = true},
                                     std::vector<Shape>{WaferShape{}});
  EXPECT_THROW(render(layers, {}), InputError);
}

class RenderCommand : public Program {};

TEST_F(RenderCommand, WritesAPictureThatIsReadBack) {
  const Outcome run = scarp("run " + small_trench("-o " + path("out")));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  const Outcome outcome =
      scarp("render " + path("out") + " -o " + path("picture.png") + " --width 100 --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&png, path("picture.png").c_str()), 0) << png.message;
  EXPECT_EQ(png.width, 100U);
  EXPECT_EQ(png.height, json_of(outcome)["height"]);
  png_image_free(&png);

  EXPECT_THAT(scarp("render " + path("out") + " -o x.jpg").messages,
              HasSubstr("pictures are .png"));
  EXPECT_THAT(scarp("render " + path("out") + " --cut 'y = 1 m'").messages,
              HasSubstr("--cut: \"y = 1 m\" lies outside the domain"));
  EXPECT_EQ(scarp("render " + path("out") + " --elevation 0").exit_code, 2);
  for (const std::string angle : {"nan", "inf", "-inf"})
    EXPECT_EQ(scarp("render " + path("out") + " --azimuth " + angle).exit_code, 2) << angle;
}

}  // namespace
}  // namespace scarp

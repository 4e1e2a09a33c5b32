#include "apps/simulator/section.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "core/error.h"
#include "levelset/start/shapes.h"
#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr Frame square_domain{.spacing = 10, .cells = {40, 20}};

TEST(SectionLine, IsReadAcrossAnAxisOrAlongALine) {
  const SectionLine y = parse_section(" y=50 nm", square_domain);
  EXPECT_EQ(y.lateral, "x");
  EXPECT_EQ(y.left, -200);
  EXPECT_EQ(y.right, 200);
  EXPECT_EQ(y.plane.place(3), (std::array<double, 2>{3, 50}));
  const SectionLine x = parse_section("x = -0.2 um", square_domain);
  EXPECT_EQ(x.lateral, "y");
  EXPECT_EQ(x.right, 100);
  EXPECT_NEAR(x.plane.place(3)[0], -200, 1e-3);
  EXPECT_EQ(x.plane.place(3)[1], 3);
  const SectionLine line = parse_section("from -30 nm, 0 nm to 0 nm, 40 nm", square_domain);
  EXPECT_EQ(line.lateral, "s");
  EXPECT_EQ(line.left, 0);
  EXPECT_NEAR(line.right, 50, 1e-12);
  EXPECT_NEAR(line.plane.place(50)[0], 0, 1e-12);
  EXPECT_NEAR(line.plane.place(50)[1], 40, 1e-12);
}

TEST(SectionLine, ThatIsWrongSaysHowItIsWritten) {
  const auto refused = [](const char* text, const char* why, const Frame& frame = square_domain) {
    EXPECT_THAT([&] { parse_section(text, frame); }, ThrowsMessage<InputError>(HasSubstr(why)))
        << text;
  };
  refused("middle", "is no line; write \"y = 0 nm\"");
  refused("z = 0 nm", "names no axis");
  refused("x = 5", "has no unit");
  refused("x = 201 nm", "lies outside the domain, which goes from -200 nm to 200 nm in x");
  refused("from 0 nm, 0 nm", "has no end");
  refused("from 0 nm to 5 nm", "has an end without a comma");
  refused("from 0 nm, 0 nm to 0 nm, 0 nm", "has no length");
  refused("from 0 nm, 0 nm to 0 nm, 120 nm", "lies outside the domain");
  Frame flat = square_domain;
  flat.cells[1] = 1;
  flat.two_dimensional = true;
  refused("x = 0 nm", "a cross-section has but", flat);
}

TEST(SectionLine, CutsLayersWhereItGoes) {
  TrenchShape trench{.width = 83};
  trench.cut.depth = 104;
  const Layers layers =
      build_layers(square_domain, std::vector<Shape>{WaferShape{.material = 0}, trench,
                                                     LayerShape{.material = 2, .thickness = 31}});
  const std::vector<TriMesh> surfaces = layer_surfaces(layers);
  // At 30 degrees to the axis of the trench it is twice as wide.
  const double dx = 60;
  const double dy = dx * std::numbers::sqrt3;
  const SectionLine line{
      .plane = {.origin = {-dx, -0.5 * dy}, .along = {0.5, 0.5 * std::numbers::sqrt3}},
      .left = 0,
      .right = 2 * dx,
      .lateral = "s"};
  const std::vector<LayerProfile> profile = cut(layers, surfaces, line);
  ASSERT_EQ(profile.size(), 2U);
  EXPECT_EQ(profile[1].material, 2);
  ASSERT_EQ(profile[0].lines.size(), 1U);
  const auto& points = profile[0].lines[0].points;
  EXPECT_NEAR(std::abs(points.front()[0] - points.back()[0]), 2 * dx, 1e-9);
  // From the first wall, 2 (60 - 41.5) along, to the end of the line, in the middle beyond it.
  EXPECT_NEAR(area_above_zero(profile[0].lines), -104 * (2 * dx - 2 * (dx - 41.5)),
              0.01 * 104 * 83);
  EXPECT_EQ(exposed_lines(profile), profile[1].lines);
}

// Both sides of the domain are in it.
TEST(SectionLine, MayLieOnASide) {
  const Layers layers = build_layers(square_domain, std::vector<Shape>{WaferShape{.material = 0}});
  const std::vector<TriMesh> surfaces = layer_surfaces(layers);
  const Sides sides = layers.frame.sides();
  for (const int axis : {0, 1}) {
    for (const double position : {sides.lower[axis], sides.upper[axis]}) {
      const std::string text = fmt::format("{} = {} nm", axis == 0 ? "x" : "y", position);
      const auto profile = cut(layers, surfaces, parse_section(text, layers.frame));
      ASSERT_EQ(profile[0].lines.size(), 1U) << text;
      EXPECT_NEAR(std::abs(profile[0].lines[0].points.front()[0]), sides.upper[1 - axis], 1e-3);
    }
  }
}

class SectionCommand : public Program {
 protected:
  std::string sections() const {
    return "--set output.sections='[\"x = 1 um\", \"from -4 um, -1 um to 4 um, 1 um\"]'";
  }
};

TEST_F(SectionCommand, OfARunIsWhatItsRecipeWrites) {
  ASSERT_EQ(scarp("run " + small_trench(sections() + " -o " + path("out"))).exit_code, 0);
  for (const char* name : {"profiles.svg", "section_1.svg", "section_2.svg", "section_1_0003.csv",
                           "section_2_0003.svg"})
    EXPECT_TRUE(std::filesystem::exists(path(std::string("out/") + name))) << name;
  const Outcome cut = scarp("section " + path("out") + " 'x = 1 um' --json -o " + path("cut"));
  ASSERT_EQ(cut.exit_code, 0) << cut.messages;
  EXPECT_EQ(json_of(cut)["earlier_surfaces"], 3);
  EXPECT_EQ(read_file(path("cut.csv")), read_file(path("out/section_1_0003.csv")));
  EXPECT_EQ(read_file(path("cut.csv")).substr(0, 31), "material,layer,line,y_nm,z_nm\nS");
  // Pictures say where they are cut.
  for (const auto& [name, line] :
       {std::pair("out/profiles.svg", "y = 0 nm, after "),
        {"out/section_1.svg", "x = 1 um, after "},
        {"out/section_1_0003.svg", "x = 1 um, after "},
        {"out/section_2.svg", "from -4 um, -1 um to 4 um, 1 um, after "}})
    EXPECT_THAT(read_file(path(name)), HasSubstr(std::string(": ") + line)) << name;

  const Outcome one = scarp("section " + path("out/state_0003.vdb") + " -o " + path("one"));
  ASSERT_EQ(one.exit_code, 0) << one.messages;
  EXPECT_EQ(read_file(path("one.csv")), read_file(path("out/profile_0003.csv")));
  const std::string metrics = read_file(path("out/metrics.csv"));
  for (const char* name : {"out/metrics", "out/profile_0001", "out/section_1_0003"}) {
    const Outcome taken = scarp("section " + path("out") + " -o " + path(name));
    EXPECT_EQ(taken.exit_code, 2);
    EXPECT_THAT(taken.messages, HasSubstr("is a file that the run writes there")) << name;
  }
  EXPECT_EQ(scarp("section " + path("out") + " -o ''").exit_code, 2);
  EXPECT_EQ(read_file(path("out/metrics.csv")), metrics);
  const Outcome wrong = scarp("section " + path("out") + " 'x = 9 um'");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.messages, HasSubstr("line: \"x = 9 um\" lies outside the domain"));
}

TEST_F(SectionCommand, OfAnInterruptedRunHasTheSameContours) {
  ASSERT_EQ(scarp("run " + small_trench(sections() + " -o " + path("one"))).exit_code, 0);
  std::filesystem::copy(path("one"), path("two"));
  for (const char* later : {"two/state_0003.vdb", "two/summary.json", "two/section_1.svg"})
    std::filesystem::remove(path(later));
  ASSERT_EQ(scarp("run " + small_trench(sections() + " --resume -o " + path("two"))).exit_code, 0);
  for (const char* name : {"profiles.svg", "section_1.svg", "section_2.svg"}) {
    EXPECT_EQ(read_file(path(std::string("one/") + name)),
              read_file(path(std::string("two/") + name)));
  }
  // Another run there leaves none of them behind.
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("two"))).exit_code, 0);
  EXPECT_FALSE(files("two").contains("section_1.svg"));
  EXPECT_FALSE(files("two").contains("section_2_0001.csv"));
}

TEST_F(SectionCommand, ThatIsWrongInARecipeIsTold) {
  const Outcome wrong =
      scarp("check " + small_trench("--set output.sections='[\"x = 0 um\", \"x = 90 um\"]'"));
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.messages, HasSubstr("output.sections[1]: \"x = 90 um\" lies outside"));
}

}  // namespace
}  // namespace scarp

#include "apps/report/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TriMesh triangle(float height = 0) {
  return {.vertices = {{0, 0, height}, {10, 0, height}, {0, 10, height}},
          .triangles = {{0, 1, 2}},
          .materials = {0}};
}

SceneOutput output_at(double time, const std::vector<FacetArray>& fields = {}) {
  return {.time = time, .moment = "after etch", .surface = pack(triangle(), fields)};
}

/// As many outputs as the numbers say, each of about the given size.
Scene scene_with(const std::vector<std::size_t>& counts, std::size_t bytes) {
  Scene scene;
  for (const std::size_t count : counts) {
    ScenePane pane{.name = "run", .output_count = count};
    for (std::size_t n = 0; n < count; ++n) {
      pane.outputs.push_back(output_at(static_cast<double>(n)));
      pane.outputs.back().surface.bytes = std::string(bytes, 'x');
    }
    scene.panes.push_back(pane);
  }
  return scene;
}

std::vector<double> times_of(const ScenePane& pane) {
  std::vector<double> times;
  for (const SceneOutput& output : pane.outputs) times.push_back(output.time);
  return times;
}

class SceneHtml : public ::testing::Test {
 protected:
  void SetUp() override {}
};

TEST(Scene, WhatFitsStays) {
  Scene scene = scene_with({7}, 3000);
  thin_out(scene, 50'000);
  EXPECT_EQ(scene.panes[0].outputs.size(), 7U);
}

TEST(Scene, IsThinnedOutEvenly) {
  Scene scene = scene_with({101}, 3000);  // 4400 in a page
  thin_out(scene, 50'000);
  EXPECT_THAT(times_of(scene.panes[0]), ElementsAre(0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100));
  thin_out(scene, 10'000);
  EXPECT_THAT(times_of(scene.panes[0]), ElementsAre(0, 100));
}

TEST(Scene, PanesAreThinnedOutTogether) {
  Scene scene = scene_with({9, 9}, 3000);
  thin_out(scene, 30'000);
  EXPECT_THAT(times_of(scene.panes[0]), ElementsAre(0, 4, 8));
  EXPECT_EQ(times_of(scene.panes[0]), times_of(scene.panes[1]));
}

TEST(Scene, TheLastOutputAlwaysStays) {
  Scene scene = scene_with({5}, 3000);
  thin_out(scene, 1);
  EXPECT_THAT(times_of(scene.panes[0]), ElementsAre(4));
}

// Recipes number materials of their own from the same number on.
TEST(Scene, MaterialsOfAnotherRunGetNumbersOfTheirOwn) {
  Scene scene{.material_names = {"Si", "SiO2", "liner"}};
  FieldMesh surface{.mesh = triangle(),
                    .fields = {{.name = "speed_nm_s", .values = {2}},
                               {.name = "material", .values = {2, 1, 3, 9}}}};
  const std::vector<std::string> names{"Si", "SiO2", "seed", "liner"};
  renumber_materials(surface, names, scene);
  EXPECT_THAT(scene.material_names, ElementsAre("Si", "SiO2", "liner", "seed"));
  EXPECT_THAT(surface.fields[0].values, ElementsAre(2));
  EXPECT_THAT(surface.fields[1].values, ElementsAre(3, 1, 2, 9));
}

TEST_F(SceneHtml, SaysWhatWasLeftOut) {
  Scene scene = scene_with({101}, 3000);
  EXPECT_THAT(scene_html(scene, "s", ""), Not(HasSubstr("evenly chosen")));
  thin_out(scene, 50'000);
  EXPECT_THAT(scene_html(scene, "s", ""), HasSubstr("Of 101 outputs 11 are here, evenly chosen"));
}

TEST_F(SceneHtml, HasUnitsAndTheRangeOfAllOutputs) {
  Scene scene{.material_names = {"Si"}, .panes = {{.name = ""}}};
  scene.panes[0].outputs = {output_at(0, {{.name = "speed_nm_s", .values = {-3}}}),
                            output_at(1, {{.name = "flux_std_error_F", .values = {0.5F}},
                                          {.name = "speed_nm_s", .values = {2}}})};
  const nlohmann::json found = scene_description(scene_html(scene, "s", ""));
  ASSERT_EQ(found["fields"].size(), 2U);
  EXPECT_EQ(found["fields"][0]["label"], "speed");
  EXPECT_EQ(found["fields"][0]["unit"], "nm/s");
  EXPECT_EQ(found["fields"][0]["low"], -3);
  EXPECT_EQ(found["fields"][0]["high"], 2);
  EXPECT_EQ(found["fields"][1]["label"], "flux std error F");
  EXPECT_EQ(found["materials"]["0"]["name"], "Si");
  EXPECT_EQ(found["panes"][0]["outputs"][1]["time_s"], 1);
  EXPECT_EQ(found["panes"][0]["outputs"][1]["moment"], "after etch");
}

TEST_F(SceneHtml, NamesCannotEndTheirElement) {
  const std::string hostile = "</script><script>alert(\"1\")</script><!--\xff";
  Scene scene{.material_names = {hostile}, .panes = {{.name = hostile}}};
  scene.panes[0].outputs = {output_at(0, {{.name = hostile, .values = {1}}})};
  scene.panes[0].outputs[0].moment = hostile;
  const std::string html = scene_html(scene, "s", "");
  EXPECT_THAT(html, Not(HasSubstr("<script>")));
  EXPECT_THAT(html, Not(HasSubstr("<!--")));
  EXPECT_THAT(scene_description(html)["materials"]["0"]["name"].get<std::string>(),
              HasSubstr("</script><script>"));
}

}  // namespace
}  // namespace scarp

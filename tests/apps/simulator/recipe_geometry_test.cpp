#include "apps/simulator/recipe_geometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <string>

#include "apps/run/recipe_difference.h"
#include "apps/simulator/recipe.h"
#include "core/error.h"
#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

using testing::HasSubstr;

namespace fs = std::filesystem;

class RecipeGeometry : public testing::Test {
 protected:
  /// A recipe whose wafer is followed by the given tables.
  Recipe read(const std::string& geometry) const {
    std::ofstream(folder_ / "r.toml") << R"([domain]
spacing = "10 nm"
extent = ["0.4 um", "0.4 um"]
[[geometry]]
shape = "wafer"
material = "Si"
)" + geometry + R"(
[[step]]
model = "isotropic"
duration = "1 s"
etch_rate = "1 nm/s"
)";
    return read_recipe(recipe_in(folder_ / "r.toml"));
  }

  std::string message(const std::string& geometry) const {
    try {
      read(geometry);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }

  TemporaryFolder folder_;
};

template <class T>
const T& second(const Recipe& recipe) {
  return std::get<T>(recipe.start.shapes.at(1));
}

TEST_F(RecipeGeometry, OpeningsRoundAndRepeat) {
  const Recipe recipe = read(R"([[geometry]]
shape = "hole"
radius = "40 nm"
depth = "80 nm"
taper = "-5 deg"
bottom_radius = "20 nm"
top_radius = "10 nm"
repeat = [3, 2]
pitch = ["130 nm", "0.15 um"]
)");
  const auto& hole = second<HoleShape>(recipe);
  EXPECT_EQ(hole.cut.bottom_radius, 20);
  EXPECT_EQ(hole.cut.top_radius, 10);
  EXPECT_EQ(hole.repeat.count, (std::array{3, 2}));
  EXPECT_EQ(hole.repeat.pitch, (std::array{130.0, 150.0}));
}

TEST_F(RecipeGeometry, RowsRepeatAcrossThemselves) {
  const Recipe recipe = read(R"([[geometry]]
shape = "trench"
width = "40 nm"
depth = "80 nm"
along = "x"
repeat = 3
pitch = "100 nm"
)");
  EXPECT_EQ(second<TrenchShape>(recipe).repeat.count, (std::array{1, 3}));
}

TEST_F(RecipeGeometry, AStackNamesItsMaterials) {
  const std::string stack = R"([[geometry]]
shape = "stack"
materials = ["SiO2", "Si3N4"]
thicknesses = ["30 nm", "20 nm"]
count = 4
)";
  const Recipe recipe = read(stack);
  const auto& shape = second<StackShape>(recipe);
  EXPECT_EQ(shape.count, 4);
  ASSERT_EQ(shape.layers.size(), 2U);
  EXPECT_EQ(shape.layers[1].thickness, 20);
  EXPECT_THAT(message(std::string(stack).replace(stack.find("\"30 nm\", "), 9, "")),
              HasSubstr("geometry[1].thicknesses: has 1 entries for 2 materials"));
}

TEST_F(RecipeGeometry, PolygonsComeFromLists) {
  const std::string mask = R"([[geometry]]
shape = "mask"
material = "resist"
thickness = "100 nm"
opening = { shape = "polygon", points = [["-50 nm", "-50 nm"], ["50 nm", "-50 nm"], ["0 nm", "60 nm"]] }
[materials.resist]
density = "5e22 /cm3"
)";
  const Recipe recipe = read(mask);
  EXPECT_EQ(std::get<PolygonOutline>(second<MaskShape>(recipe).outline).loops[0][2],
            (Point2{0, 60}));
  EXPECT_THAT(
      message(std::string(mask).replace(mask.find("[\"0 nm\", \"60 nm\"]"), 17,
                                        "[\"50 nm\", \"50 nm\"], [\"-50 nm\", \"-90 nm\"]")),
      HasSubstr("geometry[1].opening.points: edge 0 and edge 2 cross or touch"));
}

TEST_F(RecipeGeometry, FilesAreLookedForBesideTheRecipe) {
  std::ofstream(folder_ / "roof.obj")
      << "v -300 -300 5\nv 300 -300 5\nv 300 300 9\nv -300 300 9\nf 1 2 3\nf 1 3 4\n";
  const std::string mesh = R"([[geometry]]
shape = "mesh"
file = "roof.obj"
unit = "1 nm"
offset = ["0 nm", "0 nm", "50 nm"]
material = "SiO2"
)";
  const Recipe recipe = read(mesh);
  EXPECT_EQ(second<MeshShape>(recipe).mesh->vertices[2], (Vec3f{300, 300, 59}));
  EXPECT_THAT(recipe.resolved, HasSubstr((folder_ / "roof.obj").string()));
  std::ofstream(folder_ / "roof.obj", std::ios::app) << "# the same roof\n";
  const std::string changed = read(mesh).resolved;
  EXPECT_NE(changed, recipe.resolved);
  EXPECT_THAT(first_difference(changed, recipe.resolved),
              testing::AllOf(HasSubstr("a file has changed: file = "), HasSubstr("roof.obj")));
  std::ofstream(folder_ / "roof.obj") << "v -3 -3 5\nv 3 -3 5\nv 3 3 9\nf 1 2 3\n";
  EXPECT_THAT(message(mesh), HasSubstr("geometry[1].file: is open inside the domain: the edge"));
  fs::remove(folder_ / "roof.obj");
  EXPECT_THAT(message(mesh), HasSubstr("roof.obj"));
}

// Not once for its hash and once for its triangles: in between it may change.
TEST_F(RecipeGeometry, AMeshIsReadOnce) {
  std::ofstream(folder_ / "roof.obj")
      << "v -300 -300 5\nv 300 -300 5\nv 300 300 9\nv -300 300 9\nf 1 2 3\nf 1 3 4\n";
  const int watch = inotify_init1(IN_NONBLOCK);
  ASSERT_GE(inotify_add_watch(watch, (folder_ / "roof.obj").c_str(), IN_OPEN), 0);
  const Recipe recipe = read(
      "[[geometry]]\nshape = \"mesh\"\nfile = \"roof.obj\"\nunit = \"1 nm\"\n"
      "offset = [\"0 nm\", \"0 nm\", \"50 nm\"]\nmaterial = \"SiO2\"\n");
  std::array<inotify_event, 8> opened{};
  EXPECT_EQ(::read(watch, opened.data(), sizeof opened), sizeof(inotify_event));  // once
  close(watch);
  EXPECT_EQ(second<MeshShape>(recipe).mesh->triangles.size(), 2U);
  EXPECT_THAT(recipe.resolved, HasSubstr("# holds "));
}

TEST_F(RecipeGeometry, ALayoutThatIsNoneIsRefused) {
  std::ofstream(folder_ / "layout.gds") << "not a layout";
  EXPECT_THAT(
      message(R"([[geometry]]
shape = "mask"
material = "SiO2"
thickness = "100 nm"
opening = { shape = "gds", file = "layout.gds", layer = 3 }
)"),
      testing::AllOf(HasSubstr("geometry[1].opening.file: "), HasSubstr("is not a GDSII file")));
}

}  // namespace
}  // namespace scarp

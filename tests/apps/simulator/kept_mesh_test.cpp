// Meshes that serve for more than one time step.

#include "apps/simulator/kept_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "apps/simulator/simulator.h"
#include "core/parallel.h"
#include "levelset/surface/extract_surface.h"
#include "mesh/distance.h"
#include "tests/apps/columns.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

/// A square of 20 x 20 cells of 1 nm at some height, of one material left of x, of another beyond.
TriMesh square(float height, float border) {
  constexpr std::uint32_t cells = 20;
  TriMesh mesh;
  for (std::uint32_t j = 0; j <= cells; ++j)
    for (std::uint32_t i = 0; i <= cells; ++i)
      mesh.vertices.push_back({static_cast<float>(i), static_cast<float>(j), height});
  for (std::uint32_t j = 0; j < cells; ++j) {
    for (std::uint32_t i = 0; i < cells; ++i) {
      const std::uint32_t v = j * (cells + 1) + i;
      const std::uint32_t up = v + cells + 1;
      mesh.triangles.insert(mesh.triangles.end(), {{v, v + 1, up}, {v + 1, up + 1, up}});
      mesh.materials.insert(mesh.materials.end(), 2, static_cast<float>(i) < border ? 3 : 5);
    }
  }
  return mesh;
}

TEST(MaterialsIfClose, AreThoseOfASurfaceThatHardlyMoved) {
  const TriMesh mesh = square(0, 20);
  EXPECT_EQ(materials_if_close(mesh, square(0.2F, 10), 0.25), square(0, 10).materials);
  EXPECT_EQ(materials_if_close(mesh, square(0.2F, 10), 0.15), std::nullopt);
}

// A single vertex, on either side.
TEST(MaterialsIfClose, NeedEveryVertexToBeClose) {
  const TriMesh mesh = square(0, 20);
  TriMesh moved = mesh;
  moved.vertices[220].z = 0.3F;
  EXPECT_EQ(materials_if_close(mesh, moved, 0.25), std::nullopt);
  EXPECT_EQ(materials_if_close(moved, mesh, 0.25), std::nullopt);
  EXPECT_NE(materials_if_close(mesh, moved, 0.35), std::nullopt);
}

TEST(MaterialsIfClose, MissWhatIsGoneOrNew) {
  const TriMesh mesh = square(0, 20);
  TriMesh holed = mesh;
  std::erase_if(holed.triangles, [&](const Triangle& t) {
    const Vec3f r = mesh.vertices[t[0]];
    return r.x > 5 && r.x < 9 && r.y > 5 && r.y < 9;
  });
  holed.materials.resize(holed.triangles.size());
  EXPECT_EQ(materials_if_close(mesh, holed, 0.25), std::nullopt);
  EXPECT_EQ(materials_if_close(holed, mesh, 0.25), std::nullopt);
}

TEST(MaterialsIfClose, MissACornerOfAFacetThatIsGone) {
  TriMesh coarse;
  coarse.vertices = {{0, 0, 0}, {20, 0, 0}, {20, 20, 0}, {0, 20, 0}};
  coarse.triangles = {{0, 1, 2}, {0, 2, 3}};
  TriMesh cut = square(0, 20);
  std::erase_if(cut.triangles, [&](const Triangle& t) {
    return cut.vertices[t[0]].x + cut.vertices[t[0]].y > 36;
  });
  cut.materials.resize(cut.triangles.size());
  EXPECT_EQ(materials_if_close(coarse, cut, 0.25), std::nullopt);
  EXPECT_NE(materials_if_close(coarse, square(0, 20), 0.25), std::nullopt);
}

// A border of materials within a facet cannot be shown by it.
TEST(MaterialsIfClose, NeedBordersWhereFacetsHaveThem) {
  TriMesh coarse;
  coarse.vertices = {{0, 0, 0}, {20, 0, 0}, {20, 20, 0}, {0, 20, 0}};
  coarse.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_EQ(materials_if_close(coarse, square(0, 10), 0.25), std::nullopt);
  EXPECT_EQ(materials_if_close(coarse, square(0, 0), 0.25), (std::vector<MaterialId>{5, 5}));
}

/// A film that comes and goes in a trench by less than a tenth of a spacing, a little more each
/// time.
std::string short_cycles(const std::string& keep) {
  return R"(
[domain]
spacing = "20 nm"
extent = ["0.8 um", "0.2 um"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "0.4 um"
depth = "0.4 um"
[flux]
target_error = 0.05
keep_mesh_within = )" +
         keep + R"(
[[step]]
name = "cycle"
repeat = 6
[[step.step]]
model = "single_particle"
duration = "1 s"
material = "SiO2"
growth_rate = "1 nm/s"
sticking = 0.1
[[step.step]]
model = "single_particle"
duration = "1 s"
etch_rate = { SiO2 = "0.5 nm/s", Si = "0 nm/s" }
sticking = 0.5
)";
}

class KeptMeshes : public Program {
 protected:
  void run(const std::string& keep, const std::string& folder, const std::string& more = "") const {
    write("r.toml", short_cycles(keep));
    const Outcome run = scarp("run " + path("r.toml") + " --quiet -o " + path(folder) + " " + more);
    ASSERT_EQ(run.exit_code, 0) << run.messages;
  }

  std::size_t mesh_count(const std::string& folder) const {
    const auto made_at = columns_of(folder_ / folder / "metrics.csv")["mesh_made_at"];
    return std::set<std::string>(made_at.begin(), made_at.end()).size();
  }
};

// Half a nanometre per cycle: with a tenth of a spacing a mesh serves for some cycles.
TEST_F(KeptMeshes, ServeForCyclesThatHardlyMoveTheSurface) {
  run("0", "new");
  run("0.1", "kept");
  EXPECT_EQ(mesh_count("new"), 12U);
  EXPECT_GE(mesh_count("kept"), 2U);  // the film that grows in all is 0.15 spacings thick
  EXPECT_LE(mesh_count("kept"), 5U);
}

// Ions are sent anew on whatever mesh, so that it is better made anew, too; and what is followed
// from the source leaves nothing to keep.
TEST_F(KeptMeshes, ServeWhereRaysCanServeAgain) {
  run("0.1", "forward", "--set flux.engine='\"forward\"'");
  EXPECT_EQ(mesh_count("forward"), 12U);
  run("0.1", "lobe", "--set step[0].step[0].source_power=3 --set step[0].step[1].source_power=3");
  EXPECT_EQ(mesh_count("lobe"), 12U);
}

TEST_F(KeptMeshes, ARunThatIsResumedFindsThemAgain) {
  run("0.1", "whole");
  for (int last = 2; last < 12; last += 3) {
    SCOPED_TRACE(last);
    fs::remove_all(folder_ / "cut");
    fs::copy(folder_ / "whole", folder_ / "cut", fs::copy_options::recursive);
    fs::remove(folder_ / "cut" / "summary.json");
    for (int n = last + 1; n <= 12; ++n)
      fs::remove(folder_ / "cut" / ("state_" + std::to_string(10000 + n).substr(1) + ".vdb"));
    run("0.1", "cut", "--resume");
    expect_same_bits("whole", "cut");
  }
}

TEST_F(KeptMeshes, BitsDoNotDependOnThreads) {
  run("0.1", "one", "--threads 1");
  run("0.1", "two", "--threads 2");
  expect_same_bits("one", "two");
}

/// The top layer at the end of the cycles.
LevelSet final_surface(const std::string& keep, int seed) {
  Recipe recipe = read_text(short_cycles(keep));
  recipe.flux.options.seed = static_cast<std::uint64_t>(seed);
  recipe.flux.options.target_error = 0.01;
  State state = start_state(recipe.domain.frame, recipe.start);
  while (!finished(state, recipe.steps)) {
    begin_step(state, recipe.steps);
    advance(state, recipe, survey(state, recipe), 1e9);
  }
  return std::move(state.layers.stack.back().phi);
}

// The surface is where it is without, but for a part of the tenth of a spacing by which a mesh may
// be off: its fluxes are those of a trench that is a tenth wider or narrower, one in two hundred.
TEST(KeptMeshAccuracy, ProfilesAreThoseOfMeshesMadeAnew) {
  const TriMesh kept = extract_surface(final_surface("0.1", 1));
  const TriMesh anew = extract_surface(final_surface("0", 1));
  const TriMesh other = extract_surface(final_surface("0", 2));
  const double spacing = 20;
  const double off = surface_distance(kept, anew).forward.rms;
  const double noise = surface_distance(other, anew).forward.rms;
  EXPECT_LT(off, 2 * noise + 0.001 * spacing) << noise;
}

}  // namespace
}  // namespace scarp

// Surfaces of revolution from their section: the mesh, known fluxes in holes, and error bars.

#include "flux/revolution.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/flux/ion_traces.h"
#include "tests/flux/reference_bins.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using Engine = FluxOptions::Engine;

constexpr double field = 4;
constexpr double pi = std::numbers::pi;

// A hole of diameter 20 from its axis to a flat field, as a strip of one spacing.
exact::Shape hole_section(double aspect_ratio, int cells = 40) {
  const double depth = 20 * aspect_ratio;
  const Vec3d y{0, 1, 0};
  exact::Builder builder;
  builder.grid({0, 0, -depth}, {10, 0, 0}, 10, y, 1);
  builder.grid({10, 0, -depth}, {0, 0, depth}, cells, y, 1);
  builder.grid({10, 0, 0}, {field, 0, 0}, 4, y, 1);
  return {builder.mesh, {.lower = {0, 0}, .upper = {10 + field, 1}}};
}

FluxOptions options_of(const exact::Shape& shape, Engine engine) {
  return {.engine = engine,
          .sides = shape.sides,
          .axisymmetric = true,
          .spacing = 1,
          .target_error = 0.003};
}

Vec3d middle(const TriMesh& mesh, std::size_t f) {
  const auto [a, b, c] = corners(mesh, f);
  return (a + b + c) / 3.0;
}

TEST(RevolutionTest, HasTheAreaOfASurfaceOfRevolution) {
  const exact::Shape hole = hole_section(1);
  const Revolution revolution(hole.mesh, hole.sides);
  double area = 0;
  for (const double each : facet_areas(revolution.mesh())) area += each;
  const double side = 10 + field;
  // The corner beyond the outermost ring included.
  const double expected = (2 * pi * 10 * 20) / 4 + side * side;
  EXPECT_NEAR(area, expected, 1e-3 * expected);
}

// Only edges on the four sides have one facet, and normals are those of the section, turned.
TEST(RevolutionTest, IsClosedBetweenTheSides) {
  const exact::Shape hole = hole_section(1);
  const Revolution revolution(hole.mesh, hole.sides);
  const TriMesh& mesh = revolution.mesh();
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++edges[std::minmax(t[k], t[(k + 1) % 3])];
  const double side = 10 + field;
  for (const auto& [edge, count] : edges) {
    ASSERT_LE(count, 2);
    if (count == 2) continue;
    const Vec3f a = mesh.vertices[edge.first];
    const Vec3f b = mesh.vertices[edge.second];
    const auto both_at = [&](double at, int axis) { return a[axis] == at && b[axis] == at; };
    EXPECT_TRUE(both_at(0, 0) || both_at(side, 0) || both_at(0, 1) || both_at(side, 1));
  }
  const std::vector<Vec3f> normals = facet_normals(mesh);
  for (std::size_t f = 0; f < normals.size(); ++f) {
    const Vec3d r = middle(mesh, f);
    const bool is_wall = r.z > -20 + 1e-6 && r.z < -1e-6;
    const Vec3d inward = Vec3d{-r.x, -r.y, 0} / std::hypot(r.x, r.y);
    EXPECT_NEAR(dot(Vec3d(normals[f]), is_wall ? inward : Vec3d{0, 0, 1}), 1, 1e-3);
  }
}

TEST(RevolutionTest, TakesValuesThereAndBack) {
  const exact::Shape hole = hole_section(1);
  const Revolution revolution(hole.mesh, hole.sides);
  std::vector<float> values;
  for (std::size_t f = 0; f < hole.mesh.triangles.size(); ++f)
    values.push_back(static_cast<float>(f / 2));  // both facets of a cell are the same ring
  EXPECT_EQ(revolution.on_section(revolution.revolved(values)), values);
}

// Material 1 from a height on that runs through the facets of one ring, and so through both of its
// materials on the strip: each goes around with its own area.
TEST(RevolutionTest, KeepsTheAreasOfMaterials) {
  exact::Shape hole = hole_section(1);
  TriMesh& section = hole.mesh;
  std::array<double, 2> expected{};
  for (std::size_t f = 0; f < section.triangles.size(); ++f) {
    section.materials.push_back(middle(section, f).z > -10.25 ? 1 : 0);
    if (middle(section, f).z < -1e-3 && middle(section, f).z > -20 + 1e-3)
      expected[section.materials[f]] += facet_areas(section)[f] * 2 * pi * 10 / 4;
  }
  ASSERT_NE(expected[0], expected[1]);
  const Revolution revolution(section, hole.sides);
  const TriMesh& mesh = revolution.mesh();
  std::array<double, 2> found{};
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    if (middle(mesh, f).z > -20 + 1e-3 && middle(mesh, f).z < -1e-3)
      found[mesh.materials[f]] += facet_areas(mesh)[f];
  }
  for (const std::size_t m : {0, 1}) EXPECT_NEAR(found[m], expected[m], 1e-3 * expected[m]);
  // Values of both kinds of facets come back to where they were.
  std::vector<float> values;
  for (std::size_t f = 0; f < section.triangles.size(); ++f)
    values.push_back(static_cast<float>(2 * (f / 2) + section.materials[f]));
  EXPECT_EQ(revolution.on_section(revolution.revolved(values)), values);
  const double side = 10 + field;
  double area = 0;
  for (const double each : facet_areas(mesh)) area += each;
  const double whole = (2 * pi * 10 * 20) / 4 + side * side;
  EXPECT_NEAR(area, whole, 1e-3 * whole);
}

// Material 1 on the facets with an edge on the axis, which have no area around it; and a needle on
// the axis, thinner than rays can start from.
TEST(RevolutionTest, WhatLiesOnTheAxisHasNoArea) {
  exact::Shape hole = hole_section(1);
  TriMesh& section = hole.mesh;
  const auto edge_is_on_axis = [&](std::size_t f) {
    int corners = 0;
    for (const std::uint32_t v : section.triangles[f])
      corners += section.vertices[v].x == 0 ? 1 : 0;
    return corners == 2;
  };
  // Whichever of the two facets at the axis comes first.
  for (int order = 0; order < 2; ++order) {
    std::ranges::reverse(section.triangles);
    section.materials.clear();
    for (std::size_t f = 0; f < section.triangles.size(); ++f)
      section.materials.push_back(edge_is_on_axis(f) ? 1 : 0);
    ASSERT_EQ(std::ranges::count(section.materials, 1), 1);
    const Revolution around(section, hole.sides);
    EXPECT_EQ(std::ranges::count(around.mesh().materials, 1), 0);
  }

  const Vec3d y{0, 1, 0};
  exact::Builder builder;
  builder.grid({0, 0, 2}, {1e-3, 0, -2}, 1, y, 1);
  builder.grid({1e-3, 0, 0}, {10 - 1e-3, 0, 0}, 10, y, 1);
  const Revolution needle(builder.mesh, {.lower = {0, 0}, .upper = {10, 1}});
  for (const Vec3f r : needle.mesh().vertices) EXPECT_EQ(r.z, 0);
  std::vector<float> rings(needle.mesh().triangles.size());
  std::iota(rings.begin(), rings.end(), 0.0F);
  // The needle gets what arrives around it, at the innermost ring.
  const std::vector<float> back = needle.on_section(rings);
  EXPECT_EQ(back[0], back[2]);
  EXPECT_EQ(back[1], back[2]);
}

// Also where it consists of several pieces, and the outermost ring comes first.
TEST(RevolutionTest, ALongNeedleGetsWhatArrivesAtTheRingNextToIt) {
  const Vec3d y{0, 1, 0};
  exact::Builder builder;
  builder.grid({1e-3, 0, 0}, {10 - 1e-3, 0, 0}, 10, y, 1);
  std::ranges::reverse(builder.mesh.triangles);
  const std::size_t of_rings = builder.mesh.triangles.size();
  builder.grid({0, 0, 3}, {1e-3, 0, -3}, 3, y, 1);
  const Revolution needle(builder.mesh, {.lower = {0, 0}, .upper = {10, 1}});
  std::vector<float> rings(needle.mesh().triangles.size());
  std::iota(rings.begin(), rings.end(), 0.0F);
  const std::vector<float> back = needle.on_section(rings);
  for (std::size_t f = of_rings; f < back.size(); ++f) EXPECT_EQ(back[f], back[of_rings - 1]) << f;
  EXPECT_NE(back[0], back[of_rings - 1]);
}

TEST(RevolutionTest, RefusesWhatIsNoSection) {
  exact::Builder slope;
  slope.grid({0, 0, 0}, {10, 0, 0}, 4, {0, 1, 1}, 1);
  const Sides sides{.lower = {0, 0}, .upper = {10, 1}};
  EXPECT_THROW(Revolution(slope.mesh, sides), InputError);
  exact::Builder beyond;
  beyond.grid({-1, 0, 0}, {11, 0, 0}, 11, {0, 1, 0}, 1);
  EXPECT_THROW(Revolution(beyond.mesh, sides), InputError);
}

// Exact mean fluxes of reference/flux_hole_bins.csv.
void expect_reference(double aspect_ratio, double sticking, Engine engine) {
  const exact::Shape hole = hole_section(aspect_ratio);
  const Species gas{.name = "gas", .sticking = {static_cast<float>(sticking)}};
  const FluxField flux = solve_flux(hole.mesh, {&gas, 1}, options_of(hole, engine)).front();
  EXPECT_TRUE(flux.target_reached());
  EXPECT_EQ(flux.audit.lost(), 0);
  const std::vector<double> areas = facet_areas(hole.mesh);
  for (const exact::ReferenceBin& bin : exact::reference_bins("hole", aspect_ratio, sticking)) {
    double area = 0;
    double mean = 0;
    double error = 0;  // as if all were off together
    for (const std::uint32_t f : exact::facets_in(bin, hole.mesh, "hole")) {
      const double of_ring = areas[f] * middle(hole.mesh, f).x;
      area += of_ring;
      mean += of_ring * static_cast<double>(flux.arrivals().mean[f]);
      error += of_ring * static_cast<double>(flux.arrivals().std_error[f]);
    }
    if (area == 0) continue;
    EXPECT_NEAR(mean / area, bin.flux, 4 * error / area + 0.005 * bin.flux)
        << aspect_ratio << " " << sticking << " " << bin.surface << " " << bin.from;
  }
}

TEST(RevolutionTest, BothEnginesGiveTheFluxInHoles) {
  for (const double sticking : {1.0, 0.1, 0.01}) {
    expect_reference(1, sticking, Engine::gather);
    expect_reference(5, sticking, Engine::gather);
    expect_reference(1, sticking, Engine::forward);
  }
}

// A floor may end next to the axis in a wall of hardly any radius: its rays are few.
TEST(RevolutionTest, WhatNearlyTouchesTheAxisTakesNoMoreThanItsWidth) {
  for (const double radius : {1e-3, 1e-6, 1e-9}) {
    const Vec3d y{0, 1, 0};
    exact::Builder builder;
    builder.grid({0, 0, -20.5}, {radius, 0, 0}, 1, y, 1);
    builder.grid({radius, 0, -20.5}, {0, 0, 0.5}, 1, y, 1);
    builder.grid({radius, 0, -20}, {10 - radius, 0, 0}, 10, y, 1);
    builder.grid({10, 0, -20}, {0, 0, 20}, 40, y, 1);
    builder.grid({10, 0, 0}, {field, 0, 0}, 4, y, 1);
    const exact::Shape hole{builder.mesh, {.lower = {0, 0}, .upper = {10 + field, 1}}};
    for (const Species& each : {Species{.name = "gas", .sticking = {1}}, exact::plasma_ions()}) {
      FluxOptions options = options_of(hole, Engine::automatic);
      options.target_error = 0.01;
      const FluxField flux = solve_flux(hole.mesh, {&each, 1}, options).front();
      EXPECT_TRUE(flux.target_reached()) << each.name << " " << radius;
      EXPECT_LT(flux.rays, 1 << 20);
      for (const float error : flux.arrivals().std_error) ASSERT_TRUE(std::isfinite(error));
    }
  }
}

TEST(RevolutionTest, AFlatWaferGetsAllOfTheSource) {
  exact::Builder builder;
  builder.grid({0, 0, 0}, {12, 0, 0}, 12, {0, 1, 0}, 1);
  const exact::Shape flat{builder.mesh, {.lower = {0, 0}, .upper = {12, 1}}};
  const Species gas{.name = "gas", .sticking = {1}};
  for (const Engine engine : {Engine::gather, Engine::forward}) {
    const FluxField flux = solve_flux(flat.mesh, {&gas, 1}, options_of(flat, engine)).front();
    const Tally& tally = flux.arrivals();
    ASSERT_EQ(tally.mean.size(), flat.mesh.triangles.size());
    for (std::size_t f = 0; f < tally.mean.size(); ++f)
      EXPECT_NEAR(tally.mean[f], 1, 4 * tally.std_error[f] + 1e-5) << f;
  }
}

// The mean of a tally where taken(radius, z) says, with its error. A section's facets come in pairs
// that are one ring.
template <class Taken>
exact::Mean mean_around(const exact::Shape& shape, const Tally& tally, bool is_section,
                        const Taken& taken) {
  const std::vector<double> areas = facet_areas(shape.mesh);
  exact::Mean mean;
  double area = 0;
  for (std::size_t f = 0; f < areas.size(); ++f) {
    const Vec3d r = middle(shape.mesh, f);
    const double radius = is_section ? r.x : std::hypot(r.x, r.y);
    if (!taken(radius, r.z)) continue;
    const double own = areas[f] * (is_section ? radius : 1);
    area += own;
    mean.value += own * static_cast<double>(tally.mean[f]);
    mean.error += (is_section ? 2 : 1) * std::pow(own * static_cast<double>(tally.std_error[f]), 2);
  }
  return {mean.value / area, std::sqrt(mean.error) / area};
}

// Arrivals and yields in a prism of 128 sides in three dimensions, with what its walls reflect
// towards the axis.
TEST(RevolutionTest, ReflectedIonsAreThoseOfThreeDimensions) {
  const exact::Shape section = hole_section(3);
  const exact::Shape hole = exact::hole(3);
  const Species ions = exact::plasma_ions();
  FluxOptions options = options_of(section, Engine::automatic);
  options.target_error = 0.01;
  const FluxField round = solve_flux(section.mesh, {&ions, 1}, options).front();
  options.axisymmetric = false;
  options.sides = hole.sides;
  const FluxField solid = solve_flux(hole.mesh, {&ions, 1}, options).front();
  EXPECT_EQ(round.engine, FluxEngine::gather_forward);
  ASSERT_EQ(round.tallies.size(), 2U);
  const auto expect_same = [&](std::size_t tally, const auto& taken, double from) {
    const exact::Mean a = mean_around(section, round.tallies[tally], true, taken);
    const exact::Mean b = mean_around(hole, solid.tallies[tally], false, taken);
    EXPECT_NEAR(a.value, b.value, 4 * std::hypot(a.error, b.error) + 0.005 * b.value)
        << tally << " " << from;
  };
  for (std::size_t tally = 0; tally < 2; ++tally) {
    for (const double from : {0.0, 3.0, 6.0})
      expect_same(
          tally,
          [from](double radius, double z) {
            return z < -60 + 1e-6 && radius > from && radius < from + 3;
          },
          from);
    for (const double from : {0.0, 20.0, 40.0})
      expect_same(
          tally, [from](double, double z) { return z < -from - 1e-6 && z > -from - 20 + 1e-6; },
          from);
  }
}

// The spread over solutions with several seeds by what each states, over the facets of a part.
double deviation_by_error(const std::vector<Tally>& found, std::size_t begin, std::size_t end) {
  const auto count = static_cast<double>(found.size());
  double squares = 0;
  for (std::size_t f = begin; f < end; ++f) {
    double mean = 0;
    for (const Tally& each : found) mean += static_cast<double>(each.mean[f]) / count;
    for (const Tally& each : found)
      squares += std::pow(
          (static_cast<double>(each.mean[f]) - mean) / static_cast<double>(each.std_error[f]), 2);
  }
  return std::sqrt(squares / (count - 1) / static_cast<double>(end - begin));
}

// On the floor, whose few rings share a sequence of points, and on the wall.
TEST(RevolutionTest, ErrorBarsAreTrue) {
  constexpr std::size_t floor_end = 2 * 10;
  constexpr std::size_t wall_end = floor_end + std::size_t{2} * 40;
  const exact::Shape hole = hole_section(2);
  const Species gas{.name = "gas", .sticking = {0.1F}};
  for (const Engine engine : {Engine::gather, Engine::forward}) {
    FluxOptions options = options_of(hole, engine);
    options.rays = engine == Engine::gather ? 1 << 13 : 1 << 15;
    std::vector<Tally> found;
    for (options.seed = 1; options.seed <= 60; ++options.seed)
      found.push_back(solve_flux(hole.mesh, {&gas, 1}, options).front().arrivals());
    for (const auto& [begin, end] :
         {std::pair<std::size_t, std::size_t>(0, floor_end), {floor_end, wall_end}}) {
      const double deviation = deviation_by_error(found, begin, end);
      EXPECT_GT(deviation, 0.9) << begin;
      EXPECT_LT(deviation, 1.15) << begin;
    }
  }
}

TEST(RevolutionTest, BitsDoNotDependOnThreads) {
  const exact::Shape hole = hole_section(2);
  const Species gas{.name = "gas", .sticking = {0.1F}};
  for (const Engine engine : {Engine::gather, Engine::forward}) {
    std::vector<std::vector<float>> results;
    for (const int threads : {1, 2, 8}) {
      const ThreadLimit limit(threads);
      results.push_back(
          solve_flux(hole.mesh, {&gas, 1}, options_of(hole, engine)).front().arrivals().mean);
    }
    EXPECT_EQ(results[0], results[1]);
    EXPECT_EQ(results[0], results[2]);
  }
}

// What leaves rings leaves the whole of them, and sticking may depend on what arrives.
TEST(RevolutionTest, EmissionAndFeedbackAreTakenThereAndBack) {
  const exact::Shape hole = hole_section(1);
  const std::vector<Species> species{
      {.name = "gas", .sticking = {1}},
      {.name = "desorbed", .source = {.kind = SourceLobe::Kind::none}, .sticking = {1}}};
  StickingFeedback feedback{.species = {true, false}};
  int updates = 0;
  feedback.update = [&](std::span<const std::span<const float>> flux,
                        std::vector<std::vector<float>>& sticking) {
    EXPECT_EQ(flux[0].size(), hole.mesh.triangles.size());
    EXPECT_EQ(sticking[0].size(), hole.mesh.triangles.size());
    if (++updates > 2) return false;
    std::ranges::fill(sticking[0], 0.5F);
    return true;
  };
  SurfaceEmission emission{.species = {false, true}};
  emission.of = [&](std::span<const std::span<const float>> flux) {
    std::vector<float> leaves;
    for (const float arrives : flux[0]) leaves.push_back(0.25F * arrives);
    return std::vector<std::vector<float>>{leaves};
  };
  const auto flux =
      solve_flux(hole.mesh, species, options_of(hole, Engine::automatic), feedback, emission);
  EXPECT_GT(updates, 2);
  const Species half{.name = "gas", .sticking = {0.5F}};
  const FluxField alone =
      solve_flux(hole.mesh, {&half, 1}, options_of(hole, Engine::gather)).front();
  for (std::size_t f = 0; f < hole.mesh.triangles.size(); ++f)
    EXPECT_NEAR(
        flux[0].arrivals().mean[f], alone.arrivals().mean[f],
        4 * std::hypot(flux[0].arrivals().std_error[f], alone.arrivals().std_error[f]) + 0.002);
  // All that sticks leaves a quarter of what arrived; what does not escape sticks again.
  EXPECT_NEAR(flux[1].audit.emitted, 0.25 / 0.5 * flux[0].audit.absorbed,
              0.01 * flux[1].audit.emitted);
}

// By a sticking that falls as much as the flux rises all of an error is passed on, of one species;
// of the other nothing is told.
TEST(RevolutionTest, ErrorsGoOnByTheStickingThatTheyLeadTo) {
  const exact::Shape hole = hole_section(2);
  const std::vector<Species> species{{.name = "gas", .sticking = {0.5F}},
                                     {.name = "other", .sticking = {0.5F}}};
  FluxOptions options = options_of(hole, Engine::gather);
  options.rays = 1 << 16;
  const auto errors = [&](bool is_told) {
    StickingFeedback feedback{.species = {true, false}};
    feedback.update = [](auto, auto&) { return false; };
    if (is_told) {
      feedback.sticking_at = [&](std::span<const std::span<const float>> flux) {
        EXPECT_EQ(flux[0].size(), hole.mesh.triangles.size());
        std::vector<float> sticking;
        for (const float arrives : flux[0]) sticking.push_back(0.5F / arrives);
        return std::vector<std::vector<float>>{sticking, {}};
      };
    }
    const auto flux = solve_flux(hole.mesh, species, options, feedback);
    return std::pair{flux[0].max_facet_error, flux[1].max_facet_error};
  };
  const auto held = errors(false);
  const auto followed = errors(true);
  EXPECT_GT(followed.first, 1.5 * held.first);
  EXPECT_EQ(followed.second, held.second);
}

TEST(RevolutionTest, RefusesWhatIsNotTheSameAllAround) {
  const exact::Shape hole = hole_section(1);
  Species gas{.name = "gas", .sticking = {1}};
  gas.source.direction = normalized(Vec3d{0.1, 0, -1});
  EXPECT_THROW(solve_flux(hole.mesh, {&gas, 1}, options_of(hole, Engine::gather)), InputError);
  gas.source.rotating = true;
  EXPECT_NO_THROW(solve_flux(hole.mesh, {&gas, 1}, options_of(hole, Engine::automatic)));
}

}  // namespace
}  // namespace scarp

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <tuple>
#include <vector>

#include "core/running_statistics.h"
#include "flux/rays/patches.h"
#include "flux/revolution.h"
#include "flux/solve.h"
#include "tests/flux/calibration.h"
#include "tests/flux/shapes.h"
#include "tests/sanitizers.h"

namespace scarp {
namespace {

using exact::Shape;
using exact::Stated;
using Engine = FluxOptions::Engine;

FluxField flux_on(const Shape& shape, float sticking, FluxOptions options) {
  const Species gas{.name = "gas", .sticking = {sticking}};
  options.sides = shape.sides;
  options.spacing = 1;
  return solve_flux(shape.mesh, {&gas, 1}, options).front();
}

std::vector<std::size_t> numbers_from(std::size_t begin, std::size_t end) {
  std::vector<std::size_t> numbers(end - begin);
  std::iota(numbers.begin(), numbers.end(), begin);
  return numbers;
}

struct Bars {
  Engine engine;
  double aspect_ratio;
  float sticking;
  std::uint64_t rays;
  std::uint64_t seeds = 96;
};

void expect_true_bars(const Bars& c) {
  const Shape shape = exact::trench(c.aspect_ratio, 4, 8, 10);
  std::vector<Stated> on_facets;
  std::vector<Stated> on_patches;
  for (std::uint64_t seed = 1; seed <= c.seeds; ++seed) {
    const Tally tally =
        flux_on(shape, c.sticking, {.engine = c.engine, .rays = c.rays, .seed = seed}).arrivals();
    on_facets.push_back(exact::on_facets(tally));
    on_patches.push_back(exact::on_patches(tally));
  }
  exact::expect_true(exact::calibration_of(on_facets), "facets");
  exact::expect_true(exact::calibration_of(on_patches), "patches");
}

class ErrorBars : public ::testing::TestWithParam<Bars> {};

TEST_P(ErrorBars, AreTrue) { expect_true_bars(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Cases, ErrorBars,
                         ::testing::Values(Bars{Engine::forward, 2, 0.1F, 1 << 12},
                                           Bars{Engine::forward, 2, 0.5F, 1 << 14},
                                           Bars{Engine::gather, 2, 0.1F, 1 << 12},
                                           Bars{Engine::gather, 2, 0.5F, 1 << 12}));

// Facets are few there: those of the floor alone, and of a wall.
TEST(ErrorBarsOfSections, AreTrueOnFloorAndWall) {
  constexpr int depth = 60;
  const Shape shape = exact::fine_trench(depth, 1);
  constexpr std::size_t floor = std::size_t{2} * (4 + depth);
  constexpr std::size_t floor_end = floor + std::size_t{2} * 20;
  for (const float sticking : {1.0F, 0.1F}) {
    FluxOptions options{.engine = Engine::gather, .rays = 1 << 13};
    options.two_dimensional = true;
    std::vector<Stated> on_wall;
    std::vector<Stated> on_floor;
    for (options.seed = 1; options.seed <= 200; ++options.seed) {
      const Stated all = exact::on_facets(flux_on(shape, sticking, options).arrivals());
      on_wall.push_back(exact::at_places(all, numbers_from(8, floor)));
      on_floor.push_back(exact::at_places(all, numbers_from(floor, floor_end)));
    }
    exact::expect_true(exact::calibration_of(on_wall), "wall");
    exact::expect_true(exact::calibration_of(on_floor), "floor");
  }
}

// Beside it a field sees only the sky, without any error.
TEST(ErrorBarsOfFloors, AreTrueInAHole) {
  const Shape shape = exact::hole(2, 14, 5, 24);
  const RayScene scene = exact::scene_of(shape);
  const Patches patches(shape.mesh, scene);
  std::vector<std::size_t> floor;
  for (std::size_t p = 0; p < patches.list().size(); ++p) {
    const std::uint32_t f = patches.list()[p].facets.front();
    if (scene.normal(f).z > 0.5 && Vec3d(scene.corners(f)[0]).z < scene.lowest() + 1)
      floor.push_back(p);
  }
  std::vector<Stated> runs;
  for (std::uint64_t seed = 1; seed <= 80; ++seed)
    runs.push_back(exact::at_places(
        exact::on_patches(
            flux_on(shape, 0.1F, {.engine = Engine::gather, .target_error = 0.02, .seed = seed})
                .arrivals()),
        floor));
  exact::expect_true(exact::calibration_of(runs), "floor");
}

// Three elements make the floor of a slab: half differences of so few hardly tell an error.
TEST(ErrorBarsOfFloors, AreTrueOfAFewElements) {
  const Vec3d y{0, 1.06, 0};
  exact::Builder builder;
  builder.grid({-10.6, 0, 0}, {5.3, 0, 0}, 4, y, 1);
  builder.grid({-5.3, 0, 0}, {0, 0, -21.2}, 24, y, 1);
  const std::size_t floor = builder.mesh.triangles.size();
  builder.grid({-5.3, 0, -21.2}, {10.6, 0, 0}, 12, y, 1);
  const std::size_t floor_end = builder.mesh.triangles.size();
  builder.grid({5.3, 0, -21.2}, {0, 0, 21.2}, 24, y, 1);
  builder.grid({5.3, 0, 0}, {5.3, 0, 0}, 4, y, 1);
  const Shape shape{builder.mesh, {.lower = {-10.6, 0}, .upper = {10.6, y.y}}};
  std::vector<Stated> runs;
  for (std::uint64_t seed = 1; seed <= 300; ++seed)
    runs.push_back(exact::at_places(
        exact::on_facets(
            flux_on(shape, 0.3F, {.engine = Engine::gather, .target_error = 0.02, .seed = seed})
                .arrivals()),
        numbers_from(floor, floor_end)));
  exact::expect_true(exact::calibration_of(runs), "floor");
}

// A square shaft, six times as deep as wide; the facets of its floor come first.
struct Shaft {
  Shape shape;
  std::size_t floor_facets = 0;
};

Shaft shaft(double width) {
  constexpr double rim = 3;
  const double half = width / 2;
  const double depth = 6 * width;
  const int across = static_cast<int>(width);
  const int rows = static_cast<int>(depth);
  exact::Builder builder;
  builder.grid({-half, -half, -depth}, {width, 0, 0}, across, {0, width, 0}, across);
  const std::size_t floor = builder.mesh.triangles.size();
  builder.grid({-half, -half, 0}, {0, 0, -depth}, rows, {0, width, 0}, across);
  builder.grid({half, half, 0}, {0, 0, -depth}, rows, {0, -width, 0}, across);
  builder.grid({half, -half, 0}, {0, 0, -depth}, rows, {-width, 0, 0}, across);
  builder.grid({-half, half, 0}, {0, 0, -depth}, rows, {width, 0, 0}, across);
  builder.grid({-half - rim, -half - rim, 0}, {width + 2 * rim, 0, 0}, across, {0, rim, 0}, 2);
  builder.grid({-half - rim, half, 0}, {width + 2 * rim, 0, 0}, across, {0, rim, 0}, 2);
  builder.grid({-half - rim, -half, 0}, {rim, 0, 0}, 2, {0, width, 0}, across);
  builder.grid({half, -half, 0}, {rim, 0, 0}, 2, {0, width, 0}, across);
  return {{builder.mesh, {.lower = {-half - rim, -half - rim}, .upper = {half + rim, half + rim}}},
          floor};
}

// In cells of four spacings four elements would make the floor.
TEST(ErrorBarsOfFloors, AreTrueAtTheBottomOfAShaft) {
  const Shaft deep = shaft(8);
  std::vector<Stated> runs;
  for (std::uint64_t seed = 1; seed <= 400; ++seed)
    runs.push_back(exact::at_places(
        exact::on_facets(flux_on(deep.shape, 0.3F,
                                 {.engine = Engine::gather, .target_error = 0.02, .seed = seed})
                             .arrivals()),
        numbers_from(0, deep.floor_facets)));
  const exact::Calibration found = exact::calibration_of(runs);
  EXPECT_LT(found.deviation - 2 * found.deviation_error, 1.05);
  exact::expect_true(found, "floor");
}

// A slab of a trench twice as deep as wide, in cells of one spacing.
Shape thin_slab() {
  const Vec3d y{0, 2.4, 0};
  exact::Builder builder;
  builder.grid({-12, 0, 0}, {6, 0, 0}, 4, y, 2);
  builder.grid({-6, 0, 0}, {0, 0, -24}, 24, y, 2);
  builder.grid({-6, 0, -24}, {12, 0, 0}, 12, y, 2);
  builder.grid({6, 0, -24}, {0, 0, 24}, 24, y, 2);
  builder.grid({6, 0, 0}, {6, 0, 0}, 4, y, 2);
  return {builder.mesh, {.lower = {-12, 0}, .upper = {12, y.y}}};
}

// A mesh is refused whose particles miss their balance by five of its stated errors.
void expect_true_balance(const Shape& shape, const FluxOptions& options, std::uint64_t seeds) {
  RunningStatistics squares;
  double largest = 0;
  FluxOptions of_seed = options;
  of_seed.engine = Engine::gather;
  of_seed.target_error = 0.02;
  for (of_seed.seed = 1; of_seed.seed <= seeds; ++of_seed.seed) {
    const FluxAudit audit = flux_on(shape, 0.3F, of_seed).audit;
    const double z = audit.balance_error() / audit.balance_std_error;
    squares.add(z * z);
    largest = std::max(largest, std::abs(z));
  }
  EXPECT_NEAR(std::sqrt(squares.mean()), 1, 0.15);
  EXPECT_LT(largest, 5);
}

TEST(ErrorBarsOfTheBalance, AreTrue) { expect_true_balance(thin_slab(), {}, 200); }

// The section of a hole of revolution three times as deep as wide: 36 rings make its wall.
Shape half_section() {
  const Vec3d y{0, 1, 0};
  exact::Builder builder;
  builder.grid({0, 0, -36}, {6, 0, 0}, 6, y, 1);
  builder.grid({6, 0, -36}, {0, 0, 36}, 36, y, 1);
  builder.grid({6, 0, 0}, {6, 0, 0}, 6, y, 1);
  return {builder.mesh, {.lower = {0, 0}, .upper = {12, 1}}};
}

TEST(ErrorBarsOfTheBalance, AreTrueOfAFewRings) {
  FluxOptions options;
  options.axisymmetric = true;
  expect_true_balance(half_section(), options, 400);
}

TEST(ErrorBarsOfRings, AreTrueAtTheTopOfTheWall) {
  const Shape shape = half_section();
  FluxOptions options{.engine = Engine::gather, .target_error = 0.02};
  options.axisymmetric = true;
  const Revolution revolution(shape.mesh, shape.sides);
  const RayScene scene(revolution.mesh(), revolution.sides(), 1);
  const Patches patches(revolution.mesh(), scene, revolution.rings());
  std::vector<std::size_t> upper_third;
  for (std::size_t p = 0; p < patches.list().size(); ++p) {
    const std::uint32_t f = patches.list()[p].facets.front();
    const double height = Vec3d(scene.corners(f)[0]).z - scene.lowest();
    if (std::abs(scene.normal(f).z) < 0.5 && height > 24) upper_third.push_back(p);
  }
  ASSERT_GE(upper_third.size(), 3U);
  std::vector<Stated> runs;
  for (options.seed = 1; options.seed <= 500; ++options.seed)
    runs.push_back(
        exact::at_places(exact::on_patches(flux_on(shape, 0.3F, options).arrivals()), upper_third));
  exact::expect_true(exact::calibration_of(runs), "upper third");
}

// Where an error spreads over all of the trench.
TEST(SlowErrorBars, AreTrueInADeepTrenchInWhichParticlesHardlyStick) {
  expect_true_bars({Engine::gather, 20, 0.01F, 1 << 16, 300});
}

// What the sanitizers look at needs no statistics, and they make it ten times as slow.
#ifdef SCARP_UNDER_ASAN
constexpr bool has_statistics = false;
#else
constexpr bool has_statistics = true;
#endif

// A trench and a hole four times as deep as wide, by thirds of the depth.
class SlowZones : public ::testing::TestWithParam<std::tuple<const char*, const char*, double>> {
 protected:
  static constexpr double depth = 80;
  static constexpr std::size_t zone_count = 3;

  bool is_hole() const { return std::get<0>(GetParam()) == std::string("hole"); }
  Engine engine() const {
    return std::get<1>(GetParam()) == std::string("gather") ? Engine::gather : Engine::forward;
  }
  float sticking() const { return static_cast<float>(std::get<2>(GetParam())); }
  Shape shape() const { return is_hole() ? exact::hole(4, 11, 4, 32) : exact::trench(4, 4, 8, 20); }

  // Places in a zone, by the height of their middle; the field belongs to none.
  static std::vector<std::size_t> in_zone(const std::vector<double>& heights, std::size_t zone) {
    std::vector<std::size_t> places;
    for (std::size_t k = 0; k < heights.size(); ++k) {
      const double at = -heights[k] / depth * zone_count;
      if (at > 1e-6 && std::min(static_cast<std::size_t>(at), zone_count - 1) == zone)
        places.push_back(k);
    }
    return places;
  }
};

/// The flux on facets that are alike, because of how the mesh was made, as the mean of them all:
/// those of the same height and distance from the axis, or from the middle of a trench.
std::vector<double> averaged_over_alike(const Shape& shape, bool is_hole, const Tally& tally) {
  std::map<std::array<long, 3>, RunningStatistics> alike;
  std::vector<std::array<long, 3>> keys;
  for (std::size_t f = 0; f < tally.mean.size(); ++f) {
    const auto [a, b, c] = corners(shape.mesh, f);
    const Vec3d middle = (a + b + c) / 3.0;
    const double off_axis = is_hole ? std::hypot(middle.x, middle.y) : std::abs(middle.x);
    const auto key = [](double value) { return std::lround(1e3 * value); };
    keys.push_back({key(middle.z), key(off_axis), key(length(area_vector(shape.mesh, f)))});
    alike[keys.back()].add(tally.mean[f]);
  }
  std::vector<double> averages;
  averages.reserve(keys.size());
  for (const auto& each : keys) averages.push_back(alike.at(each).mean());
  return averages;
}

TEST_P(SlowZones, HaveTrueErrors) {
  const Shape mesh = shape();
  std::vector<double> facet_heights;
  for (std::size_t f = 0; f < mesh.mesh.triangles.size(); ++f) {
    const auto [a, b, c] = corners(mesh.mesh, f);
    facet_heights.push_back((a.z + b.z + c.z) / 3);
  }
  // The reference: many rays, and what is alike averaged. Its own error shifts the mean, and what
  // sticks at once is known best.
  const int reference_bits = !has_statistics ? 18 : sticking() < 1 ? 23 : 25;
  const Tally precise =
      flux_on(mesh, sticking(),
              {.engine = Engine::gather, .rays = std::uint64_t{1} << reference_bits, .seed = 999})
          .arrivals();
  Stated facet_reference = exact::on_facets(precise);
  facet_reference.value = averaged_over_alike(mesh, is_hole(), precise);
  Stated patch_reference = exact::on_patches(precise);
  std::vector<double> patch_heights;
  const Patches patches(mesh.mesh, exact::scene_of(mesh));
  for (std::size_t p = 0; p < patches.list().size(); ++p) {
    RunningStatistics height;
    double flux = 0;
    double area = 0;
    for (const std::uint32_t f : patches.list()[p].facets) {
      height.add(facet_heights[f]);
      const double of_facet = length(area_vector(mesh.mesh, f));
      flux += of_facet * facet_reference.value[f];
      area += of_facet;
    }
    patch_heights.push_back(height.mean());
    patch_reference.value[p] = flux / area;
  }

  std::vector<Stated> on_facets;
  std::vector<Stated> on_patches;
  // If all stick at once, few particles get down to the bottom, and few rays find the source from
  // there. A value and its error rise together with their number n, which shifts the mean by
  // 1 / (2 sqrt(n)): a facet of the least flux has some 25 here.
  const bool is_gather = engine() == Engine::gather;
  const int bits = 17 + (sticking() < 1 ? 0 : is_gather ? 2 : 3);
  const std::uint64_t rays = std::uint64_t{1} << bits;
  // What hardly sticks is off everywhere together: the mean over 400 seeds varies by .05 then.
  const std::uint64_t enough = is_gather && sticking() < 1 ? 1600 : 400;
  const std::uint64_t seeds = has_statistics ? enough : 4;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const Tally tally =
        flux_on(mesh, sticking(), {.engine = engine(), .rays = rays, .seed = seed}).arrivals();
    on_facets.push_back(exact::on_facets(tally));
    on_patches.push_back(exact::on_patches(tally));
  }
  const auto expect_true = [](const std::vector<Stated>& runs, const Stated& precise,
                              const std::vector<std::size_t>& places, const std::string& what) {
    ASSERT_GE(places.size(), 20U) << what;
    std::vector<Stated> in_zone;
    in_zone.reserve(runs.size());
    for (const Stated& run : runs) in_zone.push_back(at_places(run, places));
    const exact::Calibration c = exact::calibration_of(in_zone, at_places(precise, places).value);
    if (!has_statistics) return;
    EXPECT_GT(c.deviation + 2 * c.deviation_error, 0.9) << what;
    EXPECT_LT(c.deviation, 1.15) << what;
    EXPECT_LT(std::abs(c.mean), 0.1) << what;
  };
  for (std::size_t zone = 0; zone < zone_count; ++zone) {
    const std::string name = std::to_string(zone + 1) + ". third";
    expect_true(on_facets, facet_reference, in_zone(facet_heights, zone), "facets in the " + name);
    expect_true(on_patches, patch_reference, in_zone(patch_heights, zone),
                "patches in the " + name);
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, SlowZones,
                         ::testing::Combine(::testing::Values("trench", "hole"),
                                            ::testing::Values("forward", "gather"),
                                            ::testing::Values(1.0, 0.1, 0.01)));

}  // namespace
}  // namespace scarp

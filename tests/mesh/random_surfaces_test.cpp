// Random surfaces, simplified: what --max-error promises, and what no simplified mesh may have.
//
// SCARP_RANDOM_SURFACES="FIRST LAST" has SlowRandomSurfaces run other seeds than 5 to 99, for a
// campaign by hand.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "core/random.h"
#include "core/triangle_tree.h"
#include "mesh/distance.h"
#include "mesh/simplify/simplify.h"
#include "tests/mesh/generated_surface.h"
#include "tests/mesh/quality.h"
#include "tests/mesh/self_intersections.h"

namespace scarp {
namespace {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : stream_({.seed = seed, .ray = 4}) {}

  double between(double lower, double upper) { return lower + (upper - lower) * stream_.uniform(); }
  /// As likely between 1 and 2 as between 2 and 4.
  double by_size(double lower, double upper) {
    return std::exp(between(std::log(lower), std::log(upper)));
  }
  int below(int count) { return static_cast<int>(count * stream_.uniform()); }
  bool coin() { return below(2) == 1; }

 private:
  RandomStream stream_;
};

/// A box of random orientation.
Shape random_block(Dice& dice, Vec3d centre, double size) {
  const auto direction = [&dice] {
    return Vec3d{dice.between(-1, 1), dice.between(-1, 1), dice.between(-1, 1)};
  };
  const Vec3d u = normalized(direction());
  const Vec3d v = normalized(cross(u, direction()));
  const Vec3d w = cross(u, v);
  const Vec3d half{size * dice.between(0.2, 1), size * dice.between(0.2, 1),
                   size * dice.between(0.2, 1)};
  return [=](Vec3d r) {
    const Vec3d d = r - centre;
    return std::max(
        {std::abs(dot(d, u)) - half.x, std::abs(dot(d, v)) - half.y, std::abs(dot(d, w)) - half.z});
  };
}

/// What is added to the solid or cut from it.
Shape random_feature(Dice& dice, const std::array<int, 3>& cells, double level) {
  const double lateral = std::min(cells[0], cells[1]);
  const Vec3d centre{dice.between(0, cells[0]), dice.between(0, cells[1]),
                     level + dice.between(-0.25, 0.25) * cells[2]};
  const double size = dice.between(2, 2 + 0.2 * lateral);
  const double bottom = dice.between(3, 0.8 * level);
  switch (dice.below(4)) {
    case 0:
      return [=](Vec3d r) { return length(r - centre) - size; };
    case 1:
      return random_block(dice, centre, size);
    case 2:
      return tapered_hole(centre.x, centre.y, size, level, bottom, dice.between(-0.1, 0.2));
    default:
      return tapered_trench(centre.x, 0.5 * size, level, bottom, dice.between(-0.1, 0.2));
  }
}

/// A plane with bumps, pits, blocks, holes and trenches, bounded in x and y only.
Shape random_solid(Dice& dice, const std::array<int, 3>& cells) {
  struct Feature {
    Shape shape;
    bool is_cut = false;
  };
  const double level = dice.between(0.4, 0.6) * cells[2];
  std::vector<Feature> features(static_cast<std::size_t>(1 + dice.below(10)));
  for (Feature& feature : features) {
    feature = {random_feature(dice, cells, level), dice.below(3) > 0};
  }
  const double top = cells[2] - 1.7;
  return [=](Vec3d r) {
    double phi = r.z - level;
    for (const Feature& feature : features) {
      phi = feature.is_cut ? std::max(phi, -feature.shape(r)) : std::min(phi, feature.shape(r));
    }
    return std::max(std::min(phi, r.z - 1.7), r.z - top);
  };
}

struct Case {
  Grid grid;
  TriMesh mesh;
  SimplifyOptions options;
};

/// 1k to 50k vertices, about as many small as large ones; noise from 0 to .1.
Case random_case(std::uint64_t seed) {
  Dice dice(seed);
  const double side = std::sqrt(dice.by_size(1000, 50000) / 2.2);
  const double stretch = dice.by_size(0.6, 1.6);
  Case drawn;
  drawn.grid = {.cells = {static_cast<int>(side * stretch), static_cast<int>(side / stretch),
                          static_cast<int>(std::max(16.0, side * dice.between(0.3, 0.8)))},
                .noise = dice.below(4) == 0 ? 0 : dice.between(0, 0.1),
                .seed = seed};
  drawn.mesh = polygonised(drawn.grid, random_solid(dice, drawn.grid.cells));
  drawn.options = {.method = static_cast<SimplifyMethod>(dice.below(4)),
                   .placement = static_cast<PlacementMethod>(dice.below(4) == 0),
                   .sides = drawn.grid.sides(),
                   .spacing = 1,
                   .max_error = dice.by_size(0.01, 0.5)};
  if (dice.coin()) drawn.options.l_max = dice.by_size(2, 20);
  return drawn;
}

std::string name_of(const Case& drawn) {
  std::ostringstream out;
  out << drawn.mesh.vertices.size() << " vertices, noise " << drawn.grid.noise << ", method "
      << static_cast<int>(drawn.options.method) << ", placement "
      << static_cast<int>(drawn.options.placement) << ", max_error " << *drawn.options.max_error
      << ", l_max " << drawn.options.l_max;
  return out.str();
}

/// Flipped facets that do not look within 45 degrees where the side of the input looks that they
/// stand for. At a sharp edge, and in a wall thinner than the bound, a facet may lie nearer to the
/// other side, and look away from that: both sides are within the bound.
int turned_facets(const TriMesh& simplified, const TriMesh& input, double max_error) {
  const double lowest_cosine = std::sqrt(0.5);
  const TriangleTree tree(input);
  int count = 0;
  for (const std::uint32_t f : flipped_facets(simplified, input)) {
    const auto [a, b, c] = corners(simplified, f);
    const Vec3d n = area_vector(simplified, f);
    const ClosestPoint own = tree.closest_facing((a + b + c) / 3.0, n, max_error);
    const bool looks_along =
        own.found() &&
        dot(normalized(n), normalized(area_vector(input, own.triangle))) > lowest_cosine;
    count += looks_along ? 0 : 1;
  }
  return count;
}

/// Of the distances that are measured, between places up to 300 spacings from the origin.
constexpr double rounding = 1e-12;

/// What holds whatever stops it.
SurfaceDistance expect_bounded(const Case& drawn, const SimplifyResult& result) {
  const Defects defects = find_defects(result.mesh, drawn.mesh, drawn.options.sides);
  EXPECT_EQ(defects.non_manifold_edges, 0U);
  EXPECT_EQ(defects.zero_area, 0U);
  EXPECT_EQ(defects.off_plane, 0U);
  EXPECT_EQ(defects.lost_corners, 0U);
  const SurfaceDistance distance = surface_distance(drawn.mesh, result.mesh, 0.2);
  EXPECT_LE(distance.symmetric_max, result.proven_distance + rounding);
  return distance;
}

void run_campaign(std::uint64_t first, std::uint64_t last) {
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    const Case drawn = random_case(seed);
    SCOPED_TRACE("seed " + std::to_string(seed) + ": " + name_of(drawn));
    const SimplifyResult result = simplify(drawn.mesh, drawn.options);
    const SurfaceDistance distance = expect_bounded(drawn, result);
    EXPECT_LE(distance.forward.max, *drawn.options.max_error);
    EXPECT_LE(distance.reverse.max, *drawn.options.max_error);
    EXPECT_EQ(turned_facets(result.mesh, drawn.mesh, *drawn.options.max_error), 0);
    EXPECT_LE(self_intersections(result.mesh), self_intersections(drawn.mesh));
  }
}

/// Of a campaign that a number of vertices stops.
struct Counts {
  int beyond = 0;  ///< surfaces for which half a spacing does not do: they may be folded
  int turned = 0;  ///< facets of the others
  int ended = 0;   ///< surfaces that would pass through themselves with fewer vertices
};

/// The same surfaces and methods, stopped by a number of vertices.
Counts run_campaign_by_count(std::uint64_t first, std::uint64_t last) {
  constexpr double soft_bound = 0.5;
  Counts counts;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    Case drawn = random_case(seed);
    drawn.options.max_error.reset();
    drawn.options.l_max = 0;
    drawn.options.remove = Dice(seed + 1'000'000).between(0.3, 0.9);
    SCOPED_TRACE("seed " + std::to_string(seed) + ": " + std::to_string(*drawn.options.remove));
    const SimplifyResult result = simplify(drawn.mesh, drawn.options);
    if (result.stopped_by == "self_intersections") {
      ++counts.ended;
    } else {
      EXPECT_EQ(result.stopped_by, "vertices");
    }
    expect_bounded(drawn, result);
    EXPECT_LE(self_intersections(result.mesh), self_intersections(drawn.mesh));
    if (result.proven_distance <= soft_bound) {
      counts.turned += turned_facets(result.mesh, drawn.mesh, soft_bound);
    } else {
      ++counts.beyond;
    }
  }
  return counts;
}

class RandomSurfaces : public testing::TestWithParam<int> {};

TEST_P(RandomSurfaces, KeepTheirBoundAndStaySound) {
  const auto seed = static_cast<std::uint64_t>(GetParam());
  run_campaign(seed, seed);
}

TEST_P(RandomSurfaces, StaySoundWhenANumberOfVerticesStopsIt) {
  const auto seed = static_cast<std::uint64_t>(GetParam());
  const Counts counts = run_campaign_by_count(seed, seed);
  EXPECT_EQ(counts.turned, 0);
  EXPECT_EQ(counts.ended, 0);
}
INSTANTIATE_TEST_SUITE_P(Seeds, RandomSurfaces,
                         testing::Values(0, 1, 2, 3, 4, 62, 151, 303, 459, 464));

struct Seeds {
  std::uint64_t first = 5;
  std::uint64_t last = 99;
};

Seeds asked_seeds() {
  Seeds seeds;
  if (const char* asked = std::getenv("SCARP_RANDOM_SURFACES")) {
    std::istringstream(asked) >> seeds.first >> seeds.last;
  }
  return seeds;
}

TEST(SlowRandomSurfaces, KeepTheirBoundAndStaySound) {
  const Seeds seeds = asked_seeds();
  run_campaign(seeds.first, seeds.last);
}

TEST(SlowRandomSurfaces, StaySoundWhenANumberOfVerticesStopsIt) {
  const Seeds seeds = asked_seeds();
  const Counts counts = run_campaign_by_count(seeds.first, seeds.last);
  EXPECT_EQ(counts.turned, 0);
  const std::uint64_t surfaces = seeds.last - seeds.first + 1;
  std::cout << counts.beyond << " of " << surfaces << " surfaces beyond half a spacing, "
            << counts.ended << " with more vertices than asked for\n";
  EXPECT_LE(counts.beyond, 1 + 0.4 * static_cast<double>(surfaces)) << "hardly a guard";
  EXPECT_LE(counts.ended, 1 + 0.02 * static_cast<double>(surfaces)) << "hardly a number";
}

}  // namespace
}  // namespace scarp

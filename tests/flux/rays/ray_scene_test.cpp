#include "flux/rays/ray_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "flux/sampling/sampling.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using exact::Shape;
using ::testing::AllOf;
using ::testing::HasSubstr;

// A rough surface over a square of side 20, the same on opposite sides, so that it may be mirrored
// and wrapped. Slopes up to 3.
Shape rough_surface(std::uint64_t seed, int cells = 24) {
  RandomStream random({.seed = seed});
  const int count = cells * cells;
  std::vector<double> heights(count);
  for (double& height : heights) height = 2.5 * random.uniform();
  exact::Builder builder;
  const auto at = [&](int i, int j) {
    const int k = (i % cells) * cells + j % cells;
    return Vec3d{20.0 * i / cells, 20.0 * j / cells, heights[k]};
  };
  for (int i = 0; i < cells; ++i)
    for (int j = 0; j < cells; ++j)
      builder.quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
  return {builder.mesh, {.lower = {0, 0}, .upper = {20, 20}}};
}

Vec3d point_of(const RayScene& scene, std::uint32_t f, RandomStream& random) {
  const Vec3d w = sample_triangle({random.uniform(), random.uniform()});
  const auto& [a, b, c] = scene.corners(f);
  return w.x * Vec3d(a) + w.y * Vec3d(b) + w.z * Vec3d(c);
}

Ray random_ray(const RayScene& scene, RandomStream& random) {
  const std::uint32_t f = random.bits() % static_cast<std::uint32_t>(scene.facet_count());
  const UnitSquare xi{random.uniform(), random.uniform()};
  return {.r = point_of(scene, f, random), .u = sample_cosine(xi, scene.normal(f)), .from = f};
}

// Moller and Trumbore 1997: another formula than the scene's.
std::optional<double> distance_to(const std::array<Vec3f, 3>& corners, const Ray& ray) {
  const Vec3d a = Vec3d(corners[0]);
  const Vec3d ab = Vec3d(corners[1]) - a;
  const Vec3d ac = Vec3d(corners[2]) - a;
  const Vec3d p = cross(ray.u, ac);
  const double determinant = dot(ab, p);
  const Vec3d s = ray.r - a;
  const double v = dot(s, p) / determinant;
  const Vec3d q = cross(s, ab);
  const double w = dot(ray.u, q) / determinant;
  if (!(v >= 0 && w >= 0 && v + w <= 1)) return std::nullopt;
  return dot(ac, q) / determinant;
}

TEST(RayScene, FindsTheNearestOfAllFacets) {
  const RayScene scene = scene_of(rough_surface(1));
  RandomStream random({.seed = 2});
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    const Ray ray = random_ray(scene, random);
    double nearest = 1e300;
    std::uint32_t facet = Ray::no_facet;
    for (std::uint32_t f = 0; f < scene.facet_count(); ++f) {
      const auto t = distance_to(scene.corners(f), ray);
      if (f == ray.from || !t || *t < 1e-9 || *t >= nearest) continue;
      nearest = *t;
      facet = f;
    }
    if (facet == Ray::no_facet) continue;  // met a side first, or the sky
    ++hits;
    const Flight flight = scene.fly(ray);
    EXPECT_EQ(flight.end, Flight::End::front);
    EXPECT_EQ(flight.facet, facet);
    EXPECT_NEAR(length(flight.r - (ray.r + nearest * ray.u)), 0, 1e-9);
  }
  EXPECT_GT(hits, 500);
}

// In any number of groups, some of them over many sides.
TEST(RayScene, FliesManyTogetherAsEachAloneWithAllInstructions) {
  const Shape shape = rough_surface(3, 64);
  const RayScene scene = scene_of(shape);
  RandomStream random({.seed = 4});
  std::vector<Ray> rays;
  for (int i = 0; i < 5000; ++i) {
    rays.push_back(random_ray(scene, random));
    if (i % 100 == 0) rays.back().u = normalized(Vec3d{rays.back().u.x, rays.back().u.y, 0.002});
  }
  std::vector<Flight> together(rays.size());
  scene.fly(rays, together);
  const RayScene by_sse2(shape.mesh, shape.sides, 1, "isa=sse2");
  const RayScene by_sse42(shape.mesh, shape.sides, 1, "isa=sse4.2");
  const RayScene by_avx(shape.mesh, shape.sides, 1, "isa=avx");
  std::vector<Flight> in_groups(rays.size());
  for (std::size_t first = 0, count = 1; first < rays.size(); first += count, ++count) {
    count = std::min(count, rays.size() - first);
    scene.fly(std::span(rays).subspan(first, count), std::span(in_groups).subspan(first, count));
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Flight alone = scene.fly(rays[i]);
    for (const Flight& flight : {together[i], in_groups[i], by_sse2.fly(rays[i]),
                                 by_sse42.fly(rays[i]), by_avx.fly(rays[i])}) {
      ASSERT_EQ(flight.end, alone.end);
      ASSERT_EQ(flight.facet, alone.facet);
      ASSERT_EQ(flight.r, alone.r);
      ASSERT_EQ(flight.u, alone.u);
    }
  }
}

// From above, straight at vertices and edges, also those on the sides: never through.
TEST(RayScene, LetsNothingSlipBetweenFacets) {
  const RayScene scene = scene_of(rough_surface(5));
  RandomStream random({.seed = 6});
  for (std::uint32_t f = 0; f < scene.facet_count(); ++f) {
    const auto& [a, b, c] = scene.corners(f);
    for (const Vec3d goal :
         {Vec3d(a), 0.5 * (Vec3d(a) + Vec3d(b)), 0.3 * Vec3d(b) + 0.7 * Vec3d(c)}) {
      const Vec3d start{20 * random.uniform(), 20 * random.uniform(), scene.source_height()};
      const Flight flight = scene.fly({.r = start, .u = normalized(goal - start)});
      EXPECT_EQ(flight.end, Flight::End::front);
    }
  }
}

// Long walks over rough surfaces between mirrors and between wrapped sides: nothing is lost.
TEST(RayScene, LosesNothingOverManyFlights) {
  for (const Boundary boundary : {Boundary::reflective, Boundary::periodic}) {
    for (std::uint64_t seed = 10; seed < 14; ++seed) {
      const RayScene scene = scene_of(rough_surface(seed), boundary);
      RandomStream random({.seed = seed});
      Ray ray = random_ray(scene, random);
      for (int i = 0; i < 50'000; ++i) {
        const Flight flight = scene.fly(ray);
        ASSERT_TRUE(flight.end == Flight::End::front || flight.end == Flight::End::sky);
        if (flight.end == Flight::End::sky) {
          ray = random_ray(scene, random);
          continue;
        }
        const UnitSquare xi{random.uniform(), random.uniform()};
        ray = {.r = flight.r,
               .u = sample_cosine(xi, scene.normal(flight.facet)),
               .from = flight.facet};
      }
    }
  }
}

// Along the edges of a deep hole, where rounding may put the start behind the facet beyond.
TEST(RayScene, LosesNothingThatBeginsOnAnEdge) {
  const RayScene scene = scene_of(exact::hole(20));
  RandomStream random({.seed = 15});
  for (int i = 0; i < 500'000; ++i) {
    const std::uint32_t f = random.bits() % static_cast<std::uint32_t>(scene.facet_count());
    const auto& [a, b, c] = scene.corners(f);
    const Vec3d edge = Vec3d(b) - Vec3d(a);
    const Vec3d r = Vec3d(a) + random.uniform() * edge;
    const double off_plane = std::exp2(-16 * random.uniform());
    const double off_edge = std::exp2(-16 * random.uniform());
    const Vec3d along = normalized(edge);
    const Vec3d outwards = cross(along, scene.normal(f));
    const Vec3d u = normalized(along + off_edge * outwards + off_plane * scene.normal(f));
    const Flight flight = scene.fly({.r = r, .u = u, .from = f});
    ASSERT_TRUE(flight.end == Flight::End::front || flight.end == Flight::End::sky)
        << "facet " << f << " from " << r.x << " " << r.y << " " << r.z;
  }
}

TEST(RayScene, MirrorsAndWrapsAtTheSides) {
  const Shape wafer = exact::flat_wafer(20, 2);
  // Starts 1 above the wafer, 4 from the upper side of x, and comes down 8 further on.
  const Ray ray{.r = {16, 5, 1}, .u = normalized(Vec3d{8, 0, -1})};
  const Flight mirrored = scene_of(wafer).fly(ray);
  EXPECT_NEAR(length(mirrored.r - Vec3d{16, 5, 0}), 0, 1e-12);
  EXPECT_EQ(mirrored.u.x, -ray.u.x);
  const Flight wrapped = scene_of(wafer, Boundary::periodic).fly(ray);
  EXPECT_NEAR(length(wrapped.r - Vec3d{4, 5, 0}), 0, 1e-12);
  EXPECT_EQ(wrapped.u.x, ray.u.x);
  const Flight far = scene_of(wafer).fly({.r = {1, 5, 1}, .u = normalized(Vec3d{1000, 0, -1})});
  EXPECT_NEAR(far.r.x, 1, 1e-9);
}

TEST(RayScene, EndsAtTheDiagonalAsIfTheImageLayBeyondIt) {
  const Shape half = exact::rough_triangle(3, 9);
  const RayScene scene = scene_of(half);
  const RayScene whole = scene_of(exact::with_image(half));
  EXPECT_EQ(scene.source_area(), 200);
  RandomStream random({.seed = 5});
  int crossed = 0;
  for (int n = 0; n < 20'000; ++n) {
    const Ray ray = random_ray(scene, random);
    const Flight flight = scene.fly(ray);
    Flight expected = whole.fly(ray);
    ASSERT_EQ(flight.end, expected.end);
    if (expected.end != Flight::End::front) continue;
    // The middle of the facet tells which of the two halves it belongs to.
    const auto& [a, b, c] = whole.corners(expected.facet);
    if (a.y + b.y + c.y > a.x + b.x + c.x) {
      ++crossed;
      std::swap(expected.r.x, expected.r.y);
      std::swap(expected.u.x, expected.u.y);
    }
    EXPECT_LT(length(flight.r - expected.r), 1e-9);
    EXPECT_LT(length(flight.u - expected.u), 1e-12);
  }
  EXPECT_GT(crossed, 500);
}

TEST(RayScene, LosesNothingAtTheDiagonal) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const RayScene scene = scene_of(exact::rough_triangle(seed, 9));
    RandomStream random({.seed = seed + 10});
    std::vector<Ray> rays(300'000);
    for (Ray& ray : rays) ray = random_ray(scene, random);
    std::vector<Flight> flights(rays.size());
    scene.fly(rays, flights);
    for (const Flight& flight : flights)
      ASSERT_TRUE(flight.end == Flight::End::front || flight.end == Flight::End::sky);
  }
}

TEST(RayScene, RefusesAMeshBeyondTheDiagonal) {
  Shape shape = exact::flat_wafer(20, 2);
  shape.sides.diagonal = true;
  EXPECT_THROW(scene_of(shape), InputError);
}

TEST(RayScene, SaysWhereAMeshReachesOverASide) {
  Shape shape = exact::flat_wafer(20, 2);
  shape.sides.upper[0] = 15;
  try {
    scene_of(shape);
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("at (20, "), HasSubstr("x goes from 0 to 15")));
  }
}

// Embree would leave out such facets and say nothing.
TEST(RayScene, SaysWhichCornerIsNotFinite) {
  for (const float z :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30F}) {
    Shape shape = exact::flat_wafer(20, 2);
    shape.mesh.vertices[shape.mesh.triangles[3][1]].z = z;
    try {
      scene_of(shape);
      FAIL() << "no error";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr("flux: a corner of facet "), HasSubstr("finite")));
    }
  }
}

TEST(RayScene, SaysHowAFlightEnds) {
  const RayScene scene = scene_of(exact::flat_wafer(20, 2));
  EXPECT_EQ(scene.fly({.r = {5, 5, 0.5}, .u = {0, 0, 1}}).end, Flight::End::sky);
  EXPECT_EQ(scene.fly({.r = {5, 5, 0.5}, .u = {0, 0, -1}}).end, Flight::End::front);
  EXPECT_EQ(scene.fly({.r = {5, 5, -0.5}, .u = {0, 0, 1}}).end, Flight::End::back);
  EXPECT_EQ(scene.fly({.r = {5, 5, -0.5}, .u = {0, 0, -1}}).end, Flight::End::below);
  EXPECT_EQ(scene.fly({.r = {5, 5, 0.5}, .u = {1, 0, 0}}).end, Flight::End::side_limit);
}

// Of two facets at the same place the lower index is met.
TEST(RayScene, BreaksTiesByIndex) {
  Shape wafer = exact::flat_wafer(20, 1);
  std::swap(wafer.mesh.triangles[0], wafer.mesh.triangles[1]);
  wafer.mesh.triangles.push_back(wafer.mesh.triangles[0]);
  const RayScene scene = scene_of(wafer);
  for (const Vec3d r : {Vec3d{15, 5, 1}, Vec3d{5, 15, 1}}) {
    EXPECT_LT(scene.fly({.r = r, .u = {0, 0, -1}}).facet, 2U);
  }
  EXPECT_EQ(scene.fly({.r = {10, 10, 1}, .u = {0, 0, -1}}).facet, 0U);
}

TEST(RayScene, PutsVerticesNearASideOnIt) {
  Shape wafer = exact::flat_wafer(20, 2);
  for (Vec3f& r : wafer.mesh.vertices)
    if (r.x == 20) r.x = 20.00001F;
  const RayScene scene = scene_of(wafer);
  float largest = 0;
  for (std::size_t f = 0; f < scene.facet_count(); ++f)
    for (const Vec3f r : scene.corners(f)) largest = std::max(largest, r.x);
  EXPECT_EQ(largest, 20);
  for (Vec3f& r : wafer.mesh.vertices)
    if (r.x > 20) r.x = 20.1F;
  EXPECT_THROW(scene_of(wafer), InputError);
}

// Two slivers of area 5e-4 that lose it when they are placed in the domain.
TEST(RayScene, BearsSliversThatRoundingFlattens) {
  Shape wafer{.mesh = {}, .sides = {.lower = {-1000, -1000}, .upper = {1000, 1000}}};
  wafer.mesh.vertices = {{-1000, -1000, 0}, {1000, -1000, 0}, {1000, 1000, 0},
                         {-1000, 1000, 0},  {0, 0, 0},        {1e-6F, 0, 0}};
  wafer.mesh.triangles = {{0, 1, 5}, {0, 5, 4}, {1, 2, 5}, {2, 3, 5}, {3, 4, 5}, {3, 0, 4}};
  const RayScene scene = scene_of(wafer);
  for (std::size_t f = 0; f < scene.facet_count(); ++f) {
    EXPECT_EQ(scene.normal(f), (Vec3d{0, 0, 1})) << f;
    EXPECT_GT(scene.area(f), 0);
  }
  RandomStream random({.seed = 1});
  for (int i = 0; i < 1000; ++i) {
    const double x = 2000 * random.uniform();
    for (const Vec3d r : {Vec3d{x, x, 1}, Vec3d{x, 2000 - x, 1}, Vec3d{1000, 1000, 1}})
      EXPECT_EQ(scene.fly({.r = r, .u = {0, 0, -1}}).end, Flight::End::front);
  }
}

TEST(RayScene, IsInSpacingsAndKeepsAreasAndNormals) {
  const Shape shape = rough_surface(7);
  const RayScene scene(shape.mesh, shape.sides, 2);
  const auto normals = facet_normals(shape.mesh);
  const auto areas = facet_areas(shape.mesh);
  EXPECT_EQ(scene.source_area(), 100);
  for (std::size_t f = 0; f < scene.facet_count(); ++f) {
    EXPECT_NEAR(scene.area(f), areas[f] / 4, 1e-5 * areas[f]);
    EXPECT_NEAR(length(scene.normal(f) - Vec3d(normals[f])), 0, 1e-5);
  }
}

}  // namespace
}  // namespace scarp

#include "flux/reconstruct.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "core/parallel.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using exact::Shape;

double integral(const TriMesh& mesh, const std::vector<std::array<float, 3>>& values) {
  const std::vector<double> areas = facet_areas(mesh);
  double sum = 0;
  for (std::size_t f = 0; f < areas.size(); ++f)
    sum += areas[f] * (values[f][0] + values[f][1] + values[f][2]) / 3;
  return sum;
}

std::vector<float> facet_values(const TriMesh& mesh, auto&& value_at) {
  std::vector<float> values;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto [a, b, c] = corners(mesh, f);
    values.push_back(static_cast<float>(value_at((a + b + c) / 3.0)));
  }
  return values;
}

double integral(const TriMesh& mesh, const std::vector<float>& values) {
  const std::vector<double> areas = facet_areas(mesh);
  double sum = 0;
  for (std::size_t f = 0; f < areas.size(); ++f) sum += areas[f] * static_cast<double>(values[f]);
  return sum;
}

TEST(CornerValues, AreLinearInsideAFlatSurface) {
  const Shape wafer = exact::flat_wafer(20, 10);
  const auto linear = [](Vec3d r) { return 1 + 0.1 * r.x - 0.05 * r.y; };
  const auto values = corner_values(wafer.mesh, facet_values(wafer.mesh, linear));
  for (std::size_t f = 0; f < values.size(); ++f) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Vec3d r = corners(wafer.mesh, f)[corner];
      // What is missing at a side, where there are facets on one hand only, goes one ring further.
      const bool inside = r.x > 2 && r.x < 18 && r.y > 2 && r.y < 18;
      if (inside) {
        EXPECT_NEAR(values[f][corner], linear(r), 1e-5);
      }
    }
  }
}

// A mean over neighbours loses 0.01 times the square of half an edge or so.
TEST(CornerValues, LoseNothingWhereTheSlopeChanges) {
  const Shape wafer = exact::flat_wafer(20, 10);
  const auto curved = [](Vec3d r) { return 0.01 * (r.x + 3) * (r.x + 3); };
  const auto facets = facet_values(wafer.mesh, curved);
  const auto values = corner_values(wafer.mesh, facets);
  for (std::size_t f = 0; f < values.size(); ++f) {
    const auto [a, b, c] = corners(wafer.mesh, f);
    const Vec3d r = (a + b + c) / 3.0;
    const bool inside = r.x > 6 && r.x < 14 && r.y > 6 && r.y < 14;
    if (inside) {
      EXPECT_NEAR((values[f][0] + values[f][1] + values[f][2]) / 3, facets[f], 1e-5);
    }
  }
}

// Where a shadow ends, and in noise.
TEST(CornerValues, StayWithinThoseOfTheirFacetsAndKeepTheIntegral) {
  const Shape wafer = exact::flat_wafer(20, 10);
  const auto shadow = [](Vec3d r) { return r.x + 0.3 * r.y < 11 ? 0.0 : 1.0; };
  const auto noise = [](Vec3d r) { return std::fmod(1e3 * std::sin(12.9 * r.x + 78.2 * r.y), 1); };
  for (const auto& facets : {facet_values(wafer.mesh, shadow), facet_values(wafer.mesh, noise)}) {
    const auto values = corner_values(wafer.mesh, facets);
    std::map<std::uint32_t, std::array<float, 2>> ranges;
    for (std::size_t f = 0; f < facets.size(); ++f) {
      for (const std::uint32_t v : wafer.mesh.triangles[f]) {
        auto& [least, greatest] =
            ranges.try_emplace(v, std::array{facets[f], facets[f]}).first->second;
        least = std::min(least, facets[f]);
        greatest = std::max(greatest, facets[f]);
      }
    }
    for (std::size_t f = 0; f < facets.size(); ++f) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const auto& [least, greatest] = ranges.at(wafer.mesh.triangles[f][corner]);
        EXPECT_GE(values[f][corner], least);
        EXPECT_LE(values[f][corner], greatest);
      }
    }
    EXPECT_NEAR(integral(wafer.mesh, values), integral(wafer.mesh, facets), 1e-4);
  }
}

TEST(CornerValues, StepAtAnEdge) {
  const Shape shape = exact::trench(1);
  const auto normals = facet_normals(shape.mesh);
  std::vector<float> values(normals.size());
  for (std::size_t f = 0; f < values.size(); ++f) values[f] = normals[f].z > 0.5F ? 1 : 0;
  const auto result = corner_values(shape.mesh, values);
  for (std::size_t f = 0; f < values.size(); ++f)
    EXPECT_EQ(result[f], (std::array{values[f], values[f], values[f]}));
}

TEST(CornerValues, StepAtABorderOfMaterials) {
  Shape wafer = exact::flat_wafer(20, 10);
  std::vector<float> values(wafer.mesh.triangles.size());
  wafer.mesh.materials.resize(values.size());
  for (std::size_t f = 0; f < values.size(); ++f) {
    wafer.mesh.materials[f] = f < values.size() / 2 ? 1 : 0;
    values[f] = static_cast<float>(wafer.mesh.materials[f]);
  }
  const auto result = corner_values(wafer.mesh, values);
  for (std::size_t f = 0; f < values.size(); ++f)
    EXPECT_EQ(result[f], (std::array{values[f], values[f], values[f]}));
}

// A facet without area counts for no other, and a vertex without facets for nothing.
TEST(CornerValues, DoNotKnowOfDegenerateFacets) {
  Shape wafer = exact::flat_wafer(20, 10);
  const auto linear = [](Vec3d r) { return 1 + 0.1 * r.x; };
  std::vector<float> values = facet_values(wafer.mesh, linear);
  const auto expected = corner_values(wafer.mesh, values);
  const Triangle first = wafer.mesh.triangles.front();
  wafer.mesh.triangles.push_back({first[0], first[1], first[1]});
  wafer.mesh.vertices.push_back({5, 5, 5});
  values.push_back(7);
  auto result = corner_values(wafer.mesh, values);
  EXPECT_EQ(result.back(), (std::array<float, 3>{7, 7, 7}));
  result.pop_back();
  for (std::size_t f = 0; f < result.size(); ++f)
    for (std::size_t corner = 0; corner < 3; ++corner)
      EXPECT_NEAR(result[f][corner], expected[f][corner], 1e-6);
}

TEST(CornerValues, KeepTheIntegral) {
  const auto wave = [](Vec3d r) { return 1 + std::cos(0.3 * r.x) * std::cos(0.2 * r.z); };
  for (const Shape& shape : {exact::trench(2), exact::hole(2), exact::spherical_pit(0.5)}) {
    const auto values = facet_values(shape.mesh, wave);
    const auto result = corner_values(shape.mesh, values);
    const double exact = integral(shape.mesh, values);
    EXPECT_NEAR(integral(shape.mesh, result), exact, 1e-5 * exact);
  }
}

TEST(CornerValues, DoNotDependOnTheNumberOfThreads) {
  const Shape shape = exact::hole(2);
  const auto values = facet_values(shape.mesh, [](Vec3d r) { return r.x * r.z; });
  std::vector<std::vector<std::array<float, 3>>> results;
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    results.push_back(corner_values(shape.mesh, values));
  }
  EXPECT_EQ(results[0], results[1]);
}

}  // namespace
}  // namespace scarp

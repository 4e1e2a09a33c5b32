#include "mesh/regions/size_field.h"

#include <gtest/gtest.h>

#include <vector>

namespace scarp {
namespace {

/// z = height(x) over a square of cells.
template <class F>
TriMesh strip(std::uint32_t cells, const F& height) {
  TriMesh surface;
  for (std::uint32_t j = 0; j <= cells; ++j)
    for (std::uint32_t i = 0; i <= cells; ++i)
      surface.vertices.emplace_back(Vec3d{1.0 * i, 1.0 * j, height(1.0 * i)});
  for (std::uint32_t j = 0; j < cells; ++j) {
    for (std::uint32_t i = 0; i < cells; ++i) {
      const std::uint32_t v = j * (cells + 1) + i;
      surface.triangles.push_back({v, v + 1, v + cells + 2});
      surface.triangles.push_back({v, v + cells + 2, v + cells + 1});
    }
  }
  return surface;
}

TEST(SizeField, OfAPlaneIsTheLargest) {
  const std::vector<TriMesh> plane{strip(20, [](double x) { return 0.3 * x; })};
  const SizeField field(plane, 1, 4);
  EXPECT_EQ(field.at({10, 10, 3}), 4);
  EXPECT_EQ(field.at({-50, 0, 0}), 4);
}

TEST(SizeField, GrowsFromAnEdge) {
  const std::vector<TriMesh> roof{strip(20, [](double x) { return x < 10 ? x : 20 - x; })};
  const SizeField field(roof, 1, 4);
  for (const double distance : {0.0, 1.0, 3.0, 5.9})
    EXPECT_NEAR(field.at({10, 10.3, 10 - distance}), 1 + SizeField::growth * distance, 1e-6);
  EXPECT_EQ(field.at({10, 10.3, 3.9}), 4);
  EXPECT_NEAR(field.of_facet({Vec3d{10, 5, 10 - 2}, Vec3d{10, 5, 10 - 4}, Vec3d{10, 8, 10 - 3}}), 2,
              1e-6);
}

// Two surfaces that come together, as where three materials meet.
TEST(SizeField, IsASpacingNextToFilms) {
  const auto thickness = [](double x) { return x < 10 ? 0.0 : 0.09 * (x - 10); };
  const std::vector<TriMesh> surfaces{strip(20, [](double) { return 0.0; }),
                                      strip(20, [&](double x) { return thickness(x); })};
  const SizeField field(surfaces, 1, 4);
  EXPECT_EQ(field.at({15, 10, 0}), 1);
  EXPECT_EQ(field.at({19.5, 10, 0}), 1);
  EXPECT_GT(field.at({8, 10, 0}), 1.9);
  EXPECT_EQ(field.at({2, 10, 0}), 4);
  // What lies in one place is no film, and what is far apart neither.
  const std::vector<TriMesh> apart{surfaces[0], surfaces[0], strip(20, [](double) { return 1.1; })};
  EXPECT_EQ(SizeField(apart, 1, 4).at({10, 10, 0}), 4);
}

TEST(SizeField, AltitudesCountInPartsOfIt) {
  const std::vector<TriMesh> roof{strip(20, [](double x) { return x < 10 ? x : 20 - x; })};
  SizeField field(roof, 1, 4);
  const std::array<Vec3d, 3> far{Vec3d{1, 1, 1}, Vec3d{5, 1, 1}, Vec3d{3, 1.2, 1}};
  EXPECT_NEAR(relative_altitude(far, field, 0.1), 0.05, 1e-12);
  EXPECT_EQ(relative_altitude(far, field, 0.04), 0.04);
  field.limit(1);
  EXPECT_EQ(relative_altitude(far, field, 0.1), 0.1);
}

}  // namespace
}  // namespace scarp

#include "core/triangulate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

namespace scarp {
namespace {

using Points = std::vector<std::array<double, 2>>;

double area_of(const Points& points, std::span<const Triangle> triangles, double& least) {
  double sum = 0;
  least = 1e300;
  for (const auto& [a, b, c] : triangles) {
    const double area = 0.5 * ((points[b][0] - points[a][0]) * (points[c][1] - points[a][1]) -
                               (points[b][1] - points[a][1]) * (points[c][0] - points[a][0]));
    sum += area;
    least = std::min(least, area);
  }
  return sum;
}

VertexLoop circle(Points& points, double radius, std::array<double, 2> centre, int count) {
  VertexLoop loop;
  for (int n = 0; n < std::abs(count); ++n) {
    const double angle = 2 * std::numbers::pi * n / count;
    loop.push_back(static_cast<std::uint32_t>(points.size()));
    points.push_back({centre[0] + radius * std::cos(angle), centre[1] + radius * std::sin(angle)});
  }
  return loop;
}

double circle_area(double radius, int count) {
  return 0.5 * count * radius * radius * std::sin(2 * std::numbers::pi / count);
}

TEST(Triangulate, ACombWithPointsOnItsLinesHasNoTriangleWithoutArea) {
  Points points;
  VertexLoop loop;
  const auto add = [&](double x, double y) {
    loop.push_back(static_cast<std::uint32_t>(points.size()));
    points.push_back({x, y});
  };
  for (int n = 0; n <= 20; ++n) add(n, 0);
  for (int n = 20; n >= 0; --n) add(n, n % 2 == 0 ? 5 : 1);
  const std::vector<Triangle> triangles = triangulate(points, {loop});
  EXPECT_EQ(triangles.size(), points.size() - 2);
  double least = 0;
  EXPECT_NEAR(area_of(points, triangles, least), 60, 1e-9);
  EXPECT_GT(least, 0);
}

TEST(Triangulate, HolesStayOpenAndIslandsInThemAreFilled) {
  Points points;
  const std::vector<VertexLoop> loops{
      circle(points, 10, {0, 0}, 60), circle(points, 2, {5, 1}, -20),
      circle(points, 6, {-3, 0}, -40), circle(points, 3, {-3, 1}, 24),
      circle(points, 1, {5, -3}, -12)};
  const std::vector<Triangle> triangles = triangulate(points, loops);
  double least = 0;
  EXPECT_NEAR(area_of(points, triangles, least),
              circle_area(10, 60) - circle_area(2, 20) - circle_area(6, 40) + circle_area(3, 24) -
                  circle_area(1, 12),
              1e-9);
  EXPECT_GT(least, 0);
  std::set<std::uint32_t> used;
  for (const Triangle& t : triangles) used.insert(t.begin(), t.end());
  EXPECT_EQ(used.size(), points.size());
}

}  // namespace
}  // namespace scarp

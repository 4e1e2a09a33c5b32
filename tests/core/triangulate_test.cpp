#include "core/triangulate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "core/random.h"

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

// What joins a hole to the loop around it has to go around others that hide the way.
TEST(Triangulate, ManyHolesOfAnyShapeStayOpen) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    RandomStream random({.seed = seed});
    const double scale = seed % 2 == 0 ? 1 : 0.003;  // areas below 1, too
    Points points;
    std::vector<VertexLoop> loops(1);
    double expected = 3600 * scale * scale;
    const auto add = [&](VertexLoop& loop, double x, double y) {
      loop.push_back(static_cast<std::uint32_t>(points.size()));
      points.push_back({scale * x, scale * y});
    };
    add(loops[0], 0, 0);
    add(loops[0], 60, 0);
    add(loops[0], 60, 60);
    add(loops[0], 0, 60);
    for (int n = 0; n < 36; ++n) {
      VertexLoop hole;
      const int count = 3 + static_cast<int>(random.uniform() * 9);
      const double x = 10 * (n % 6) + 5;
      const double y = 10 * (n / 6) + 5;
      const double first = 6 * random.uniform();
      const std::size_t before = points.size();
      for (int k = 0; k < count; ++k) {
        const double angle = first - 2 * std::numbers::pi * k / count;
        const double radius = 0.5 + 4.3 * random.uniform();
        add(hole, x + radius * std::cos(angle), y + radius * std::sin(angle));
      }
      for (std::size_t k = before; k < points.size(); ++k) {
        const auto& a = points[k];
        const auto& b = points[k + 1 < points.size() ? k + 1 : before];
        expected += 0.5 * (a[0] * b[1] - b[0] * a[1]);  // clockwise: less
      }
      loops.push_back(hole);
    }
    const std::vector<Triangle> triangles = triangulate(points, loops);
    // A loop that is cut open at each of 36 holes.
    EXPECT_EQ(triangles.size(), points.size() + 2 * 36 - 2) << seed;
    double least = 0;
    EXPECT_NEAR(area_of(points, triangles, least), expected, 1e-9 * expected) << seed;
    EXPECT_GT(least, 0) << seed;
  }
}

}  // namespace
}  // namespace scarp

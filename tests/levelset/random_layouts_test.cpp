// Layouts put together at random, against a slow reader of their own: areas by asking at many
// points whether any shape holds them.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <vector>

#include "core/random.h"
#include "core/system/read_file.h"
#include "core/system/temporary_folder.h"
#include "gds_writer.h"
#include "levelset/start/gds.h"

namespace scarp {
namespace {

using Point = std::array<double, 2>;

double cross_of(const Point& u, const Point& v) { return u[0] * v[1] - u[1] * v[0]; }
double dot_of(const Point& u, const Point& v) { return u[0] * v[0] + u[1] * v[1]; }
Point between(const Point& a, const Point& b) { return {b[0] - a[0], b[1] - a[1]}; }
Point unit(const Point& u) {
  const double length = std::sqrt(dot_of(u, u));
  return {u[0] / length, u[1] / length};
}

/// One shape of a cell.
struct Drawn {
  bool is_path = false;
  int type = 0;
  double half = 0;
  std::vector<Point> points{};

  bool holds(const Point& r) const { return is_path ? path_holds(r) : winding(r) != 0; }

 private:
  int winding(const Point& r) const {
    int turns = 0;
    for (std::size_t n = 0; n < points.size(); ++n) {
      const Point& a = points[n];
      const Point& b = points[(n + 1) % points.size()];
      if ((a[1] <= r[1]) == (b[1] <= r[1])) continue;
      const bool left = cross_of(between(a, b), between(a, r)) > 0;
      if (a[1] <= r[1] ? left : !left) turns += a[1] <= r[1] ? 1 : -1;
    }
    return turns;
  }

  double before() const { return type == 2 ? half : type == 4 ? 10 : 0; }
  double after() const { return type == 2 ? half : type == 4 ? 20 : 0; }

  bool path_holds(const Point& r) const {
    const auto is_near = [&](const Point& end) {
      const Point away = between(end, r);
      return type == 1 && dot_of(away, away) <= half * half;
    };
    if (is_near(points.front()) || is_near(points.back())) return true;
    if (points.size() == 1) {
      const Point away = between(points[0], r);
      return type != 1 && std::abs(away[1]) <= half && away[0] >= -before() && away[0] <= after();
    }
    for (std::size_t n = 0; n + 1 < points.size(); ++n) {
      const Point along = between(points[n], points[n + 1]);
      const double length = std::sqrt(dot_of(along, along));
      const Point away = between(points[n], r);
      const double x = dot_of(away, along) / length;
      const bool is_last = n + 2 == points.size();
      if (std::abs(cross_of(along, away)) <= half * length && x >= (n == 0 ? -before() : 0) &&
          x <= length + (is_last ? after() : 0))
        return true;
      if (!is_last && corner_holds(n + 1, r)) return true;
    }
    return false;
  }

  /// The outer side of a bend: a kite up to somewhat more than right angles, else a triangle.
  bool corner_holds(std::size_t n, const Point& r) const {
    const Point u = unit(between(points[n - 1], points[n]));
    const Point v = unit(between(points[n], points[n + 1]));
    const double side = cross_of(u, v) > 0 ? -1 : 1;
    const Point a{-side * u[1], side * u[0]};
    const Point b{-side * v[1], side * v[0]};
    const Point away = between(points[n], r);
    const double turn = cross_of(a, b);
    if (std::abs(turn) < 1e-12) return false;
    // In the wedge between both normals.
    const double by_a = cross_of(away, b) / turn;
    const double by_b = cross_of(a, away) / turn;
    if (by_a < 0 || by_b < 0) return false;
    if (dot_of(u, v) > -0.1) return dot_of(away, a) <= half && dot_of(away, b) <= half;
    return by_a + by_b <= half;
  }
};

/// How a cell is placed: mirrored about x, magnified, turned.
struct Place {
  bool mirrored = false;
  double magnification = 1;
  double angle = 0;  // degrees
  double cosine = 1;
  double sine = 0;

  Point inverse(const Point& away) const {
    const double x = (away[0] * cosine + away[1] * sine) / magnification;
    const double y = (away[1] * cosine - away[0] * sine) / magnification;
    return {x, mirrored ? -y : y};
  }
};

constexpr int half_width = 1000;  // of the window, nm

/// Shapes of one cell, and the places at which the top cell has it, one by one or in an array.
class RandomLayout {
 public:
  explicit RandomLayout(int seed) : random_({.seed = static_cast<std::uint64_t>(seed)}) {
    const int count = pick(1, 6);
    for (int n = 0; n < count; ++n) pick(0, 1) == 0 ? add_polygon() : add_path();
    const int placed = pick(1, 3);
    for (int n = 0; n < placed; ++n) add_reference();
  }

  std::string bytes() const {
    GdsWriter gds;
    gds.cell("CELL", [&] {
      for (const Drawn& shape : shapes_) {
        std::vector<int> xy;
        for (const Point& point : shape.points)
          for (const double x : point) xy.push_back(static_cast<int>(x));
        if (shape.is_path) {
          gds.path(1, shape.type, static_cast<int>(2 * shape.half), xy);
        } else {
          xy.push_back(xy[0]);
          xy.push_back(xy[1]);
          gds.boundary(1, 0, xy);
        }
      }
    });
    gds.cell("TOP", [&] {
      for (const Reference& each : references_)
        gds.reference("CELL", each.xy,
                      {each.place.mirrored, each.place.magnification, each.place.angle},
                      each.columns_rows);
    });
    return gds.finish();
  }

  /// Samples stand anywhere in the squares of a lattice: on it, shapes along it would be off.
  static constexpr int samples = 500;  // along an axis
  static constexpr double step = 2.0 * half_width / samples;

  double sampled_area() {
    reach_ = 0;
    for (const Drawn& shape : shapes_)
      for (const Point& point : shape.points)
        reach_ = std::max(reach_, std::sqrt(dot_of(point, point)) + 2 * shape.half + 20);
    std::size_t inside = 0;
    for (int i = 0; i < samples; ++i)
      for (int j = 0; j < samples; ++j) {
        const double x = (i + random_.uniform()) * step - half_width;
        const double y = (j + random_.uniform()) * step - half_width;
        inside += holds({x, y}) ? 1 : 0;
      }
    return static_cast<double>(inside) * step * step;
  }

 private:
  struct Reference {
    Place place;
    std::vector<int> xy{};
    std::vector<int> columns_rows{};
    std::vector<Point> shifts{};
  };

  int pick(int least, int most) {
    return least + static_cast<int>((most - least + 1) * random_.uniform());
  }

  void add_polygon() {
    Drawn shape;
    const int count = pick(3, 7);
    for (int n = 0; n < count; ++n)
      shape.points.push_back({double(pick(-300, 300)), double(pick(-300, 300))});
    shapes_.push_back(shape);
  }

  void add_path() {
    constexpr std::array<int, 4> types{0, 1, 2, 4};
    Drawn shape{.is_path = true,
                .type = types[static_cast<std::size_t>(pick(0, 3))],
                .half = double(pick(10, 40))};
    Point at{double(pick(-200, 200)), double(pick(-200, 200))};
    shape.points.push_back(at);
    // A single point has an area by its ends alone.
    const int count = pick(shape.type == 0 ? 1 : 0, 3);
    double direction = pick(0, 7);
    for (int n = 0; n < count; ++n) {
      const double length = pick(90, 200);
      at = {std::round(at[0] + length * std::cos(direction * std::numbers::pi / 4)),
            std::round(at[1] + length * std::sin(direction * std::numbers::pi / 4))};
      shape.points.push_back(at);
      direction += pick(-3, 3);
    }
    shapes_.push_back(shape);
  }

  void add_reference() {
    Reference each{.place = {.mirrored = pick(0, 1) == 1,
                             .magnification = 0.5 * pick(1, 4),
                             .angle = 15.0 * pick(0, 23)}};
    each.place.cosine = std::cos(each.place.angle * std::numbers::pi / 180);
    each.place.sine = std::sin(each.place.angle * std::numbers::pi / 180);
    const int x = pick(-900, 900);
    const int y = pick(-900, 900);
    each.xy = {x, y};
    each.shifts.push_back({double(x), double(y)});
    if (pick(0, 1) == 1) {
      const int columns = pick(1, 40);
      const int rows = pick(1, 3);
      const Point u{double(pick(-700, 700)), double(pick(-700, 700))};
      const Point v{double(pick(-700, 700)), double(pick(-700, 700))};
      each.xy = {x,
                 y,
                 x + columns * static_cast<int>(u[0]),
                 y + columns * static_cast<int>(u[1]),
                 x + rows * static_cast<int>(v[0]),
                 y + rows * static_cast<int>(v[1])};
      each.columns_rows = {columns, rows};
      each.shifts.clear();
      for (int i = 0; i < columns; ++i)
        for (int j = 0; j < rows; ++j)
          each.shifts.push_back({x + i * u[0] + j * v[0], y + i * u[1] + j * v[1]});
    }
    references_.push_back(each);
  }

  bool holds(const Point& r) const {
    for (const Reference& each : references_) {
      for (const Point& shift : each.shifts) {
        const Point away = between(shift, r);
        const double reach = reach_ * each.place.magnification;
        if (dot_of(away, away) > reach * reach) continue;
        const Point local = each.place.inverse(away);
        for (const Drawn& shape : shapes_)
          if (shape.holds(local)) return true;
      }
    }
    return false;
  }

  RandomStream random_;
  std::vector<Drawn> shapes_;
  std::vector<Reference> references_;
  double reach_ = 0;  // of the cell, from its origin
};

/// Of what a loop surrounds within the window, by cutting it off at each side.
double area_in_window(Loop loop) {
  for (const std::size_t axis : {0U, 1U}) {
    for (const double side : {-1.0, 1.0}) {
      const auto beyond = [&](const Point2& r) { return side * r[axis] - half_width; };
      Loop kept;
      for (std::size_t n = 0; n < loop.size(); ++n) {
        const Point2& a = loop[n];
        const Point2& b = loop[(n + 1) % loop.size()];
        if (beyond(a) <= 0) kept.push_back(a);
        if ((beyond(a) <= 0) == (beyond(b) <= 0)) continue;
        const double s = beyond(a) / (beyond(a) - beyond(b));
        kept.push_back({a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])});
      }
      loop = std::move(kept);
    }
  }
  return area(std::span(&loop, 1));
}

TEST(SlowRandomLayouts, HaveTheAreaOfASlowReader) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "layout.gds";
  const Frame frame{.spacing = 10, .cells = {2 * half_width / 10, 2 * half_width / 10}};
  for (int seed = 0; seed < 500; ++seed) {
    RandomLayout layout(seed);
    std::ofstream(file, std::ios::binary) << layout.bytes();
    const double w = half_width;
    const Layout read = read_gds(file, read_file(file),
                                 {.layer = 1, .window = std::array<Point2, 2>{{{-w, -w}, {w, w}}}});
    const std::vector<Loop> loops = domain_loops(frame, {read.loops, PolygonOutline::Rule::any});
    // With images beyond the sides.
    double found = 0;
    double length = 0;
    for (const Loop& loop : loops) {
      found += area_in_window(loop);
      for (std::size_t n = 0; n < loop.size(); ++n) {
        const Point along = between(loop[n], loop[(n + 1) % loop.size()]);
        length += std::sqrt(dot_of(along, along));
      }
    }
    // A square that an edge passes has a standard deviation of half its area at most, and an edge
    // passes 4 / pi of them on its way of a square's width.
    constexpr double step = RandomLayout::step;
    const double noise = 0.5 * step * step * std::sqrt(4 / std::numbers::pi * length / step);
    const double sampled = layout.sampled_area();
    EXPECT_NEAR(found, sampled, 0.001 * sampled + 5 * noise) << "seed " << seed;
  }
}

}  // namespace
}  // namespace scarp

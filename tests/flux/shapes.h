#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include "core/frame.h"
#include "core/random.h"
#include "core/tri_mesh.h"
#include "flux/rays/ray_scene.h"

namespace scarp::exact {

/// A mesh put together from flat pieces; corners at the same place become one vertex.
class Builder {
 public:
  std::uint32_t vertex(Vec3d r) {
    const Vec3f place(r);
    const auto [found, is_new] = index_.try_emplace(
        {place.x, place.y, place.z}, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (is_new) mesh.vertices.push_back(place);
    return found->second;
  }

  void triangle(Vec3d a, Vec3d b, Vec3d c) {
    mesh.triangles.push_back({vertex(a), vertex(b), vertex(c)});
  }

  void quad(Vec3d a, Vec3d b, Vec3d c, Vec3d d) {
    triangle(a, b, c);
    triangle(a, c, d);
  }

  /// A parallelogram in count_u x count_v cells; the normal points along cross(u, v).
  void grid(Vec3d corner, Vec3d u, int count_u, Vec3d v, int count_v) {
    const auto at = [&](int i, int j) {
      return corner + (1.0 * i / count_u) * u + (1.0 * j / count_v) * v;
    };
    for (int j = 0; j < count_v; ++j)
      for (int i = 0; i < count_u; ++i)
        quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
  }

  TriMesh mesh;

 private:
  std::map<std::tuple<float, float, float>, std::uint32_t> index_;
};

struct Shape {
  TriMesh mesh;
  Sides sides;
};

inline RayScene scene_of(const Shape& shape, Boundary boundary = Boundary::reflective) {
  Sides sides = shape.sides;
  sides.boundary = {boundary, boundary};
  return {shape.mesh, sides, 1};
}

inline Shape flat_wafer(double side, int cells) {
  Builder builder;
  builder.grid({0, 0, 0}, {side, 0, 0}, cells, {0, side, 0}, cells);
  return {builder.mesh, {.lower = {0, 0}, .upper = {side, side}}};
}

/// A trench along y of width 20 from x = -10 to 10 between flat fields; its opening is at z = 0.
/// Walls have 20 cells along z, the bottom 20 along x.
inline Shape trench(double aspect_ratio, double field = 4, double length = 8, int cells = 20) {
  constexpr double half = 10;
  const double depth = 2 * half * aspect_ratio;
  const int along = static_cast<int>(length / 4);
  const Vec3d y{0, length, 0};
  Builder builder;
  builder.grid({-half - field, 0, 0}, {field, 0, 0}, 2, y, along);
  builder.grid({-half, 0, 0}, {0, 0, -depth}, cells, y, along);
  builder.grid({-half, 0, -depth}, {2 * half, 0, 0}, cells, y, along);
  builder.grid({half, 0, -depth}, {0, 0, depth}, cells, y, along);
  builder.grid({half, 0, 0}, {field, 0, 0}, 2, y, along);
  return {builder.mesh, {.lower = {-half - field, 0}, .upper = {half + field, length}}};
}

/// The same in cells of one spacing, as marching cubes give them.
inline Shape fine_trench(int depth = 20, int length = 8) {
  Builder builder;
  const Vec3d y{0, static_cast<double>(length), 0};
  const Vec3d down{0, 0, -1.0 * depth};
  builder.grid({-14, 0, 0}, {4, 0, 0}, 4, y, length);
  builder.grid({-10, 0, 0}, down, depth, y, length);
  builder.grid(Vec3d{-10, 0, 0} + down, {20, 0, 0}, 20, y, length);
  builder.grid(Vec3d{10, 0, 0} + down, -down, depth, y, length);
  builder.grid({10, 0, 0}, {4, 0, 0}, 4, y, length);
  return {builder.mesh, {.lower = {-14, 0}, .upper = {14, y.y}}};
}

/// A round hole of diameter 20 about the z axis in a square field: a prism with the area of the
/// circle.
inline Shape hole(double aspect_ratio, double half_width = 11, int rings = 10, int sides = 128) {
  const double step = 2 * std::numbers::pi / sides;
  const double radius = 10 * std::sqrt(step / std::sin(step));
  const double depth = 20 * aspect_ratio;
  const auto on_ring = [&](double r, int k, double z) {
    return Vec3d{r * std::cos(step * k), r * std::sin(step * k), z};
  };
  const auto on_square = [&](int k) {
    const Vec3d u = on_ring(1, k, 0);
    const double largest = std::max(std::abs(u.x), std::abs(u.y));
    const auto side = [&](double x) {
      return std::abs(x) > largest - 1e-9 ? std::copysign(half_width, x) : half_width * x / largest;
    };
    return Vec3d{side(u.x), side(u.y), 0};
  };
  Builder builder;
  for (int k = 0; k < sides; ++k) {
    const int next = (k + 1) % sides;
    builder.quad(on_ring(radius, k, 0), on_square(k), on_square(next), on_ring(radius, next, 0));
    for (int i = 0; i < 2 * rings; ++i) {
      const double upper = -depth * i / (2 * rings);
      const double lower = -depth * (i + 1) / (2 * rings);
      builder.quad(on_ring(radius, k, lower), on_ring(radius, k, upper),
                   on_ring(radius, next, upper), on_ring(radius, next, lower));
    }
    for (int i = 1; i < rings; ++i) {
      const double inner = radius * i / rings;
      const double outer = radius * (i + 1) / rings;
      builder.quad(on_ring(inner, k, -depth), on_ring(outer, k, -depth),
                   on_ring(outer, next, -depth), on_ring(inner, next, -depth));
    }
    builder.triangle({0, 0, -depth}, on_ring(radius / rings, k, -depth),
                     on_ring(radius / rings, next, -depth));
  }
  return {builder.mesh, {.lower = {-half_width, -half_width}, .upper = {half_width, half_width}}};
}

/// A sphere of radius 10 cut by the plane z = 0 at the height cut * 10 above its centre, below a
/// flat square field.
inline Shape spherical_pit(double cut) {
  constexpr int sides = 64;
  constexpr int rings = 32;
  constexpr double step = 2 * std::numbers::pi / sides;
  const double first = std::acos(cut);
  constexpr double half_width = 11;
  const auto on_sphere = [&](int ring, int k) {
    const double theta = first + (std::numbers::pi - first) * ring / rings;
    const double z = ring == 0 ? 0 : 10 * (std::cos(theta) - cut);
    const double r = ring == rings ? 0 : 10 * std::sin(theta);
    return Vec3d{r * std::cos(step * (k % sides)), r * std::sin(step * (k % sides)), z};
  };
  const auto on_square = [&](int k) {
    const Vec3d u{std::cos(step * (k % sides)), std::sin(step * (k % sides)), 0};
    const double largest = std::max(std::abs(u.x), std::abs(u.y));
    const auto side = [&](double x) {
      return std::abs(x) > largest - 1e-9 ? std::copysign(half_width, x) : half_width * x / largest;
    };
    return Vec3d{side(u.x), side(u.y), 0};
  };
  Builder builder;
  for (int k = 0; k < sides; ++k) {
    builder.quad(on_sphere(0, k), on_square(k), on_square(k + 1), on_sphere(0, k + 1));
    for (int ring = 0; ring + 1 < rings; ++ring) {
      builder.quad(on_sphere(ring + 1, k), on_sphere(ring, k), on_sphere(ring, k + 1),
                   on_sphere(ring + 1, k + 1));
    }
    builder.triangle(on_sphere(rings, k), on_sphere(rings - 1, k), on_sphere(rings - 1, k + 1));
  }
  return {builder.mesh, {.lower = {-half_width, -half_width}, .upper = {half_width, half_width}}};
}

/// Half of a surface over a square of side 20 that is its own mirror image across x = y, with
/// vertices at random heights.
inline Shape rough_triangle(std::uint64_t seed, double height, int cells = 12) {
  RandomStream random({.seed = seed});
  const auto row = static_cast<std::size_t>(cells) + 1;
  std::vector<double> heights(row * row);
  for (double& each : heights) each = height * random.uniform();
  const auto at = [&](int i, int j) {
    return Vec3d{20.0 * i / cells, 20.0 * j / cells,
                 heights[static_cast<std::size_t>(i) * row + static_cast<std::size_t>(j)]};
  };
  Builder builder;
  for (int i = 0; i < cells; ++i) {
    for (int j = 0; j < i; ++j)
      builder.quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    builder.triangle(at(i, i), at(i + 1, i), at(i + 1, i + 1));
  }
  return {builder.mesh, {.lower = {0, 0}, .upper = {20, 20}, .diagonal = true}};
}

/// Both halves, that with y <= x first.
inline Shape with_image(const Shape& half) {
  Builder builder;
  for (const bool is_image : {false, true}) {
    for (std::size_t f = 0; f < half.mesh.triangles.size(); ++f) {
      auto [a, b, c] = corners(half.mesh, f);
      if (is_image) {
        for (Vec3d* const r : {&a, &b, &c}) std::swap(r->x, r->y);
        std::swap(b, c);
      }
      builder.triangle(a, b, c);
    }
  }
  return {builder.mesh, {.lower = half.sides.lower, .upper = half.sides.upper}};
}

}  // namespace scarp::exact

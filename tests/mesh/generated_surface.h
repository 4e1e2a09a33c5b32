#pragma once

// Surfaces for tests and benchmarks: level sets of shapes with noise on the grid nodes, polygonised
// in unit cells. Independent of levelset/, so that mesh/ can be tested without it.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <unordered_map>
#include <vector>

#include "core/frame.h"
#include "core/random.h"
#include "core/tri_mesh.h"

namespace scarp {

/// Negative in the solid, about the distance to its surface.
using Shape = std::function<double(Vec3d)>;

/// Nodes 0..cells per axis, spacing 1.
struct Grid {
  std::array<int, 3> cells{};
  double noise = 0;  ///< standard deviation of what is added to the shape at each node
  std::uint64_t seed = 1;
  bool periodic = false;  ///< along x and y: the upper sides are copies of the lower ones

  Sides sides() const {
    const Boundary boundary = periodic ? Boundary::periodic : Boundary::reflective;
    return {.lower = {0, 0},
            .upper = {static_cast<double>(cells[0]), static_cast<double>(cells[1])},
            .boundary = {boundary, boundary}};
  }
};

namespace generated_surface {

/// Marching cubes without tables: the crossings of each cell face are paired around its solid
/// corners, and the pairs chain up to polygons.
class Polygoniser {
 public:
  Polygoniser(const Grid& grid, const Shape& shape) : grid_(grid) {
    for (int axis = 0; axis < 3; ++axis) nodes_[axis] = grid.cells[axis] + 1;
    phi_.resize(static_cast<std::size_t>(nodes_[0]) * nodes_[1] * nodes_[2]);
    for (int k = 0; k < nodes_[2]; ++k) {
      for (int j = 0; j < nodes_[1]; ++j) {
        for (int i = 0; i < nodes_[0]; ++i) phi_[node(i, j, k)] = value(shape, i, j, k);
      }
    }
  }

  TriMesh mesh() {
    for (int k = 0; k < grid_.cells[2]; ++k) {
      for (int j = 0; j < grid_.cells[1]; ++j) {
        for (int i = 0; i < grid_.cells[0]; ++i) cell(i, j, k);
      }
    }
    return std::move(mesh_);
  }

 private:
  std::size_t node(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * nodes_[1] + j) * nodes_[0] + i;
  }

  double value(const Shape& shape, int i, int j, int k) const {
    if (grid_.periodic) {
      i %= grid_.cells[0];
      j %= grid_.cells[1];
    }
    double phi = shape({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
    if (grid_.noise > 0 && std::abs(phi) < 3) {
      // The sum of twelve uniform numbers is close to normal.
      RandomStream random({.seed = grid_.seed, .ray = node(i, j, k)});
      double sum = -6;
      for (int n = 0; n < 12; ++n) sum += random.uniform();
      phi += grid_.noise * sum;
    }
    return phi == 0 ? 1e-9 : phi;
  }

  /// The vertex on the grid edge between two nodes, made when first asked for.
  std::uint32_t vertex(const std::array<int, 3>& a, const std::array<int, 3>& b) {
    const std::size_t na = node(a[0], a[1], a[2]);
    const std::size_t nb = node(b[0], b[1], b[2]);
    const std::uint64_t key = std::min(na, nb) * 4 + (std::max(na, nb) - std::min(na, nb) == 1 ? 0
                                                      : a[1] != b[1]                           ? 1
                                                                                               : 2);
    const auto [place, is_new] =
        vertices_.try_emplace(key, static_cast<std::uint32_t>(mesh_.vertices.size()));
    if (is_new) {
      const double t = std::clamp(phi_[na] / (phi_[na] - phi_[nb]), 0.001, 0.999);
      Vec3d r;
      for (int axis = 0; axis < 3; ++axis) r[axis] = a[axis] + t * (b[axis] - a[axis]);
      mesh_.vertices.push_back(Vec3f(r));
    }
    return place->second;
  }

  void cell(int i, int j, int k) {
    // Corners of each face counter-clockwise seen from outside; bit a of a corner: upper along a.
    static constexpr int faces[6][4]{{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    const auto corner = [&](int c) {
      return std::array<int, 3>{i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1)};
    };
    std::array<bool, 8> solid;
    int count = 0;
    for (int c = 0; c < 8; ++c) {
      const auto [x, y, z] = corner(c);
      solid[c] = phi_[node(x, y, z)] < 0;
      count += solid[c] ? 1 : 0;
    }
    if (count == 0 || count == 8) return;
    // From the crossing before each run of solid corners of a face to the one after it.
    std::vector<std::array<std::uint32_t, 2>> links;
    for (const auto& face : faces) {
      for (int c = 0; c < 4; ++c) {
        const int before = (c + 3) % 4;
        if (!solid[face[c]] || solid[face[before]]) continue;
        int last = c;
        while (solid[face[(last + 1) % 4]]) last = (last + 1) % 4;
        links.push_back({vertex(corner(face[before]), corner(face[c])),
                         vertex(corner(face[last]), corner(face[(last + 1) % 4]))});
      }
    }
    while (!links.empty()) {
      std::vector<std::uint32_t> polygon{links.back()[0]};
      std::uint32_t next = links.back()[1];
      links.pop_back();
      while (next != polygon.front()) {
        polygon.push_back(next);
        const auto link = std::find_if(links.begin(), links.end(),
                                       [next](const auto& l) { return l[0] == next; });
        next = (*link)[1];
        links.erase(link);
      }
      // Round until no diagonal lies in a face of the cell: the neighbour might have it, too.
      for (std::size_t turn = 1; turn < polygon.size() && has_diagonal_in_face(polygon); ++turn) {
        std::rotate(polygon.begin(), polygon.begin() + 1, polygon.end());
      }
      for (std::size_t n = 2; n < polygon.size(); ++n) {
        mesh_.triangles.push_back({polygon[0], polygon[n - 1], polygon[n]});
      }
    }
  }

  bool has_diagonal_in_face(const std::vector<std::uint32_t>& polygon) const {
    const Vec3f a = mesh_.vertices[polygon[0]];
    for (std::size_t n = 2; n + 1 < polygon.size(); ++n) {
      const Vec3f b = mesh_.vertices[polygon[n]];
      for (int axis = 0; axis < 3; ++axis) {
        if (a[axis] == b[axis] && a[axis] == std::floor(a[axis])) return true;
      }
    }
    return false;
  }

  const Grid& grid_;
  std::array<int, 3> nodes_{};
  std::vector<double> phi_;
  std::unordered_map<std::uint64_t, std::uint32_t> vertices_;
  TriMesh mesh_;
};

}  // namespace generated_surface

inline TriMesh polygonised(const Grid& grid, const Shape& shape) {
  return generated_surface::Polygoniser(grid, shape).mesh();
}

/// A hole around (x, y) with the given radius at height top, narrower by taper per unit of depth.
inline Shape tapered_hole(double x, double y, double radius, double top, double bottom,
                          double taper) {
  return [=](Vec3d r) {
    const double wall = std::hypot(r.x - x, r.y - y) - radius + taper * (top - r.z);
    return std::max(wall / std::sqrt(1 + taper * taper), bottom - r.z);
  };
}

/// A trench along y.
inline Shape tapered_trench(double x, double half_width, double top, double bottom, double taper) {
  return [=](Vec3d r) {
    const double wall = std::abs(r.x - x) - half_width + taper * (top - r.z);
    return std::max(wall / std::sqrt(1 + taper * taper), bottom - r.z);
  };
}

/// Tapered via holes, a dome and a step that runs askew; about nx ny (1 + 60 %) vertices.
inline Shape via_array(int nx, int ny, double depth) {
  std::vector<Shape> holes;
  const double top = depth + 6.27;
  for (double x = 25; x < 0.7 * nx; x += 45) {
    for (double y = 22; y < ny - 15; y += 44) {
      holes.push_back(tapered_hole(x, y, 14, top, 6.31, 0.08));
    }
  }
  const Vec3d dome{0.86 * nx, 0.3 * ny, top - 12};
  return [=](Vec3d r) {
    const double askew = (r.x - 0.78 * nx - 0.25 * (r.y - 0.5 * ny)) / std::hypot(1, 0.25);
    double phi = std::min(r.z - top, std::max(r.z - top - 5.4, -askew));
    phi = std::min(phi, length(r - dome) - 22.3);
    for (const Shape& hole : holes) phi = std::max(phi, -hole(r));
    return phi;
  };
}

/// Three deep tapered trenches along y.
inline Shape deep_trenches(int nx, double depth) {
  std::vector<Shape> trenches;
  const double top = depth + 8.23;
  for (const double x : {0.18, 0.5, 0.82}) {
    trenches.push_back(tapered_trench(x * nx + 0.3, 0.1 * nx, top, 8.41, 0.02));
  }
  return [=](Vec3d r) {
    double phi = r.z - top;
    for (const Shape& trench : trenches) phi = std::max(phi, -trench(r));
    return phi;
  };
}

/// A tapered hole around the corners of a periodic domain, and a ball across the sides of y.
inline Shape periodic_landscape(int nx, int ny, double depth) {
  const auto wrapped = [](double x, int period) {
    return x - period * std::floor(x / period + 0.5);
  };
  const double top = depth + 6.27;
  const double radius = 0.2 * std::min(nx, ny);
  const Shape hole = tapered_hole(0, 0, radius, top, 6.31, 0.05);
  return [=](Vec3d r) {
    const Vec3d near_ball{wrapped(r.x - 0.5 * nx, nx), wrapped(r.y, ny), r.z - top};
    const double ball = length(near_ball) - 0.8 * radius;
    const double solid = std::min(r.z - top, ball);
    return std::max(solid, -hole({wrapped(r.x, nx), wrapped(r.y, ny), r.z}));
  };
}

/// Bumps and pits of random place and size on a plane, some of them overhanging.
inline Shape random_landscape(const std::array<int, 3>& cells, std::uint64_t seed) {
  struct Ball {
    Vec3d centre;
    double radius = 0;
    bool pit = false;
  };
  std::vector<Ball> balls;
  RandomStream random({.seed = seed, .ray = 77});
  const double level = 0.5 * cells[2] + 0.3 * random.uniform();
  for (int n = 0; n < 6; ++n) {
    Ball ball;
    ball.centre = {cells[0] * random.uniform(), cells[1] * random.uniform(),
                   level + 4 * random.uniform() - 2};
    ball.radius = 2 + 0.12 * cells[2] * random.uniform() + 2 * random.uniform();
    ball.pit = random.uniform() < 0.5F;
    balls.push_back(ball);
  }
  return [=](Vec3d r) {
    double phi = r.z - level;
    for (const Ball& ball : balls) {
      const double distance = length(r - ball.centre) - ball.radius;
      phi = ball.pit ? std::max(phi, -distance) : std::min(phi, distance);
    }
    return phi;
  };
}

/// A sphere of triangles from a subdivided octahedron.
inline TriMesh octahedral_sphere(double radius, int n, Vec3d centre = {}) {
  TriMesh mesh;
  std::unordered_map<std::uint64_t, std::uint32_t> index;
  const auto vertex = [&](int x, int y, int z) {
    const std::uint64_t key =
        ((static_cast<std::uint64_t>(x + n) * (2 * n + 1)) + y + n) * (2 * n + 1) + z + n;
    const auto [place, is_new] =
        index.try_emplace(key, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (is_new) {
      const Vec3d r{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
      mesh.vertices.push_back(Vec3f(centre + radius * normalized(r)));
    }
    return place->second;
  };
  for (int octant = 0; octant < 8; ++octant) {
    const int sx = octant & 1 ? -1 : 1;
    const int sy = octant & 2 ? -1 : 1;
    const int sz = octant & 4 ? -1 : 1;
    const auto corner = [&](int i, int j) { return vertex(sx * i, sy * j, sz * (n - i - j)); };
    const auto add = [&](const Triangle& t) {  // braces number vertices in one order
      mesh.triangles.push_back(sx * sy * sz > 0 ? t : Triangle{t[0], t[2], t[1]});
    };
    for (int i = 0; i < n; ++i) {
      for (int j = 0; i + j < n; ++j) {
        add({corner(i, j), corner(i + 1, j), corner(i, j + 1)});
        if (i + j + 1 < n) add({corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)});
      }
    }
  }
  return mesh;
}

/// The square [0, n]^2 at z = 0, two triangles per cell, with normal noise in z.
inline TriMesh noisy_plane(int n, double noise, std::uint64_t seed = 1) {
  return polygonised({.cells = {n, n, 4}, .noise = noise, .seed = seed},
                     [](Vec3d r) { return r.z - 1.77; });
}

/// A wavy film, thin against the waves, with facets of size 1.
inline TriMesh wavy_film(int cells, float thickness) {
  TriMesh mesh;
  const auto row = static_cast<std::uint32_t>(cells + 1);
  for (const bool is_top : {false, true}) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (std::uint32_t j = 0; j < row; ++j) {
      for (std::uint32_t i = 0; i < row; ++i) {
        const auto x = static_cast<float>(i);
        const auto y = static_cast<float>(j);
        const float wave = 0.3F * std::sin(0.7F * x) * std::cos(0.5F * y);
        mesh.vertices.push_back({x, y, wave + (is_top ? thickness : 0)});
      }
    }
    for (std::uint32_t j = 0; j + 1 < row; ++j) {
      for (std::uint32_t i = 0; i + 1 < row; ++i) {
        const std::uint32_t a = first + j * row + i;
        for (Triangle t : {Triangle{a, a + 1, a + row + 1}, Triangle{a, a + row + 1, a + row}}) {
          if (!is_top) std::swap(t[1], t[2]);
          mesh.triangles.push_back(t);
        }
      }
    }
  }
  return mesh;
}

}  // namespace scarp

#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/tri_mesh.h"

namespace scarp {

/// Finds facets near a place: those that reach into the cells of a lattice.
class FacetGrid {
 public:
  explicit FacetGrid(double cell) : cell_(cell) {}

  void add(std::uint32_t facet, const std::array<Vec3d, 3>& corners);
  void remove(std::uint32_t facet, const std::array<Vec3d, 3>& corners);

  /// Facets whose cells the box reaches into, each once, the lowest first.
  void near(const Box& box, std::vector<std::uint32_t>& facets) const;

 private:
  using Key = std::uint64_t;

  template <class F>
  void for_each_cell(const Box& box, const F& do_it) const;

  double cell_;
  std::unordered_map<Key, std::vector<std::uint32_t>> cells_;
};

/// Whether the segment from p to q passes through the inside of a triangle; touching does not
/// count.
bool pierces(const Vec3d& p, const Vec3d& q, const std::array<Vec3d, 3>& t);

/// A triangle by its vertices, to be compared with others that share some of them.
struct PlacedTriangle {
  std::array<std::uint32_t, 3> v{};
  std::array<Vec3d, 3> r{};
};

/// Whether two triangles pass through each other or come nearer to each other than the clearance,
/// away from a corner that they share, or, at a common edge, lie on each other within a small
/// angle.
bool collide(const PlacedTriangle& a, const PlacedTriangle& b, double clearance);

}  // namespace scarp

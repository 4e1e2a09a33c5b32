#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/tri_mesh.h"
#include "core/vec3.h"

namespace scarp {

/// What of a wafer has one name: a material, the gas above it, or the gas in closed voids.
struct MeshRegion {
  enum class Kind { material, gas, closed_void };
  Kind kind = Kind::material;
  MaterialId material = 0;  ///< of materials alone
  std::string name{};
  /// Gas is empty space unless it was asked for; its interfaces are there in any case.
  bool is_meshed = true;
};

/// Regions in one mesh: where two of them meet there is one facet for both.
///
/// In space the facets are the interfaces and the sides of the domain. A flat mesh lies in an
/// upright plane, y is the same everywhere: its facets fill the regions, and interfaces are the
/// edges between facets of different bodies.
///
/// Units: nm.
struct RegionMesh {
  static constexpr int nothing = -1;

  /// The sides of the domain: x, y and z, each the lower one first.
  static constexpr int side_count = 6;

  /// A connected piece of a region.
  struct Body {
    int region = 0;
  };

  struct Facet {
    /// Counter-clockwise seen from the second body; of a flat mesh, with x to the right and z
    /// upwards.
    Triangle corners{};
    /// Behind it and in front of it; nothing beyond the sides. Of a flat mesh the first is its own.
    std::array<int, 2> bodies{nothing, nothing};
    int side = nothing;  ///< of the domain, if it lies on one
    /// Of an interface the layer whose surface it is part of; of a flat mesh the layer that it is
    /// in; nothing on sides. Gas counts as the layer after the last one.
    int layer = nothing;
  };

  bool is_flat = false;
  std::vector<Vec3d> vertices;
  std::vector<Facet> facets;
  std::vector<Body> bodies;
  std::vector<MeshRegion> regions;
  std::array<double, 3> lower{};  ///< of the domain; y is none of a flat mesh
  std::array<double, 3> upper{};
  std::array<bool, 2> is_periodic{};  ///< along x and y
};

/// The height of a triangle above its longest edge: the smallest of the three.
double least_altitude(const std::array<Vec3d, 3>& corners);

/// The same in parts of the longest edge: 0.87 at most.
double shape_of(const std::array<Vec3d, 3>& corners);

std::array<Vec3d, 3> corners(const RegionMesh& mesh, const RegionMesh::Facet& facet);

/// Of each region that is meshed; zero for others. Units: nm^3; of a flat mesh nm^2.
std::vector<double> region_volumes(const RegionMesh& mesh);

/// Bit n is set where r lies on side n of the domain, exactly.
std::uint8_t sides_at(const RegionMesh& mesh, const Vec3d& r);

/// An edge of a flat mesh where two bodies meet, or one ends.
struct RegionLine {
  std::array<std::uint32_t, 2> ends{};  ///< in the direction of the facet of the first body
  std::array<int, 2> bodies{};          ///< the second is nothing on a side
  int side = RegionMesh::nothing;
  int layer = RegionMesh::nothing;  ///< whose surface it is part of
};

/// In the order of the facets.
std::vector<RegionLine> lines_of(const RegionMesh& flat);

/// Whether the lower and the upper side across x or y have the same facets, edges in a flat mesh,
/// to the last bit, and the same materials behind them. Gas and voids count as the same.
bool sides_match(const RegionMesh& mesh, int axis);

/// A place well inside of each body that is closed, for programs that fill closed surfaces.
///
/// Cost: for each body as much as to look at every facet a few times.
std::vector<std::optional<Vec3d>> inner_points(const RegionMesh& mesh);

}  // namespace scarp

#pragma once

#include <cstdint>
#include <vector>

#include "core/tri_mesh.h"
#include "mesh/half_edges.h"
#include "mesh/quadric.h"
#include "mesh/sides.h"
#include "mesh/spatial_order.h"

namespace scarp {

/// What a vertex may do.
enum class VertexKind : std::uint8_t {
  free,    ///< anything its sides allow
  border,  ///< inside a border between two materials: may slide along it
  fixed    ///< stays: corners of the domain, periodic sides, ends and forks of borders
};

/// A direction to within a degree, in three bytes.
class CoarseDirection {
 public:
  CoarseDirection() = default;
  explicit CoarseDirection(Vec3d n);
  explicit operator Vec3d() const { return {1.0 * x_, 1.0 * y_, 1.0 * z_}; }

 private:
  std::int8_t x_ = 0, y_ = 0, z_ = 0;
};

/// A mesh while its edges are collapsed.
///
/// Places are kept in double precision but always rounded to float, so that what is checked is what
/// comes out. All are relative to `centre`.
struct CollapseMesh {
  HalfEdges topology;
  Vec3d centre;
  std::vector<Vec3d> r;                        ///< per vertex
  std::vector<SideMask> sides;                 ///< per vertex
  std::vector<VertexKind> kind;                ///< per vertex
  std::vector<Vec3d> normals;                  ///< per facet: twice the area vector
  std::vector<CoarseDirection> input_normals;  ///< per facet: where it and its neighbours faced
  std::vector<MaterialId> materials;           ///< per facet, or empty
  std::uint32_t live_vertices = 0;

  CollapseMesh(const TriMesh& mesh, const Sides& side_positions);

  Vec3d normal_of(std::uint32_t f) const;
  bool is_border(std::uint32_t h) const;
  /// Rounds to the nearest place that a float mesh can hold.
  Vec3d rounded(Vec3d place) const { return Vec3d(Vec3f(place + centre)) - centre; }
  double squared_length(std::uint32_t h) const {
    const Vec3d e = r[topology.target(h)] - r[topology.origin(h)];
    return dot(e, e);
  }

  /// The mesh that is left: vertices and facets in their old order, or in that of a mesh that this
  /// one was made from by reordering.
  TriMesh extract(const SpatialOrder& order = {}) const;
};

/// How the two ends of an edge may be merged.
enum class Merge : std::uint8_t {
  forbidden,
  free,         ///< anywhere that the sides of both allow
  onto_origin,  ///< only at the place of the half edge's origin
  onto_target,
  onto_either  ///< at one of the two places
};

Merge merge_rule(const CollapseMesh& mesh, std::uint32_t h);

/// Where the merged vertex of an edge may lie, as far as the sides of the domain say; relative to
/// the origin of h, and with the middle of the edge as its origin.
Subspace allowed_places(const CollapseMesh& mesh, std::uint32_t h);

}  // namespace scarp

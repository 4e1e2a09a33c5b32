#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "core/system/huge_pages.h"
#include "core/tri_mesh.h"
#include "mesh/half_edges.h"
#include "mesh/quadric.h"
#include "mesh/sides.h"
#include "mesh/simplify/thin_facets.h"
#include "mesh/spatial_order.h"

namespace scarp {

/// What a vertex may do.
enum class VertexKind : std::uint8_t {
  free,    ///< anything its sides allow
  paired,  ///< on a periodic side: may go along it, together with its copy on the opposite one
  border,  ///< inside a border between two materials: may slide along it
  fixed    ///< stays: corners of the domain, ends and forks of borders
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
/// comes out. All are relative to `centre`, which lies on the diagonal if that is a side.
struct CollapseMesh {
  HalfEdges topology;
  SidePlanes planes;  ///< of the domain; in the frame of the input
  Vec3d centre;
  LargeVector<Vec3d> r;             ///< per vertex
  std::vector<SideMask> sides;      ///< per vertex
  std::vector<VertexKind> kind;     ///< per vertex
  std::vector<std::uint32_t> twin;  ///< per vertex: the other one of a pair; empty if there is none
  LargeVector<Vec3d> normals;       ///< per facet: twice the area vector
  std::vector<CoarseDirection> input_normals;  ///< per facet: where it and, if thin facets are
                                               ///< noisy, its neighbours faced
  std::vector<MaterialId> materials;           ///< per facet, or empty
  std::array<bool, 2> periodic{};              ///< per axis
  std::uint32_t live_vertices = 0;
  Box box;          ///< around the places of the input
  double area = 0;  ///< of the input
  ThinFacets thin_facets;

  CollapseMesh(const TriMesh& mesh, const Sides& side_positions,
               ThinFacets thin = ThinFacets::noisy);

  Vec3d normal_of(std::uint32_t f) const;
  bool is_border(std::uint32_t h) const;

  /// The same edge on the opposite periodic side, which is collapsed with it; it runs the other way
  /// round. none if there is none.
  std::uint32_t twin_edge(std::uint32_t h) const {
    return has_twins() ? found_twin_edge(h) : HalfEdges::none;
  }
  /// Where a place on the side of h lies on that of its twin edge.
  Vec3d twin_place(std::uint32_t h, Vec3d place) const;
  /// The half edge that stands for an edge and for its twin.
  std::uint32_t edge(std::uint32_t h) const {
    const std::uint32_t t = twin_edge(h);
    return t != HalfEdges::none ? std::min(h, t) : topology.edge(h);
  }
  /// Merges target(h) into origin(h), which goes to the place, and likewise the ends of its twin
  /// edge. A target with a twin needs an origin with one: see from_twin(). The normals are left to
  /// the caller.
  void collapse(std::uint32_t h, Vec3d place);
  /// h or its opposite, whose origin has a twin if only one of the two ends has one.
  std::uint32_t from_twin(std::uint32_t h) const;

  /// Rounds to the nearest place that a float mesh can hold, and that lies on the diagonal if it is
  /// one of the sides.
  Vec3d rounded(Vec3d place, SideMask sides_of_place = 0) const {
    Vec3d result = Vec3d(Vec3f(place + centre)) - centre;
    if (fixes_diagonal(sides_of_place)) result.y = result.x;
    return result;
  }
  bool is_within_sides(Vec3d place) const { return planes.hold(place + centre); }
  double squared_length(std::uint32_t h) const {
    const Vec3d e = r[topology.target(h)] - r[topology.origin(h)];
    return dot(e, e);
  }

  bool has_twins() const { return !twin.empty(); }

  /// Every so many facets stand for all where a mean is asked for: a divisor of grains.
  std::uint32_t stride_of_sample() const { return normals.size() > 20000 ? 8 : 1; }

  /// The mesh that is left: vertices and facets in their old order, or in that of a mesh that this
  /// one was made from by reordering.
  TriMesh extract(const SpatialOrder& order = {}) const;

 private:
  std::uint32_t found_twin_edge(std::uint32_t h) const;
  bool are_copies(std::uint32_t v, std::uint32_t w, int axis) const;
  void merge(std::uint32_t h, Vec3d place);
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

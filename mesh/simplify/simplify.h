#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"
#include "mesh/simplify/thin_facets.h"

namespace scarp {

/// The order of collapses, and how fine the mesh stays where.
enum class SimplifyMethod {
  curvature,       ///< closest to the input, finest where the surface bends
  paper,           ///< finest where the surface bends: Lenz et al.
  lindstrom_turk,  ///< least change of volume first
  length           ///< shortest edge first: the same fineness everywhere
};

/// Placement of the vertex that two become; `curvature` has its own.
enum class PlacementMethod { lindstrom_turk, garland_heckbert };

/// Units: lengths as in the mesh. A span is over the vertices of the input; the caller keeps it
/// alive.
struct SimplifyOptions {
  SimplifyMethod method = SimplifyMethod::curvature;
  PlacementMethod placement = PlacementMethod::lindstrom_turk;
  Sides sides{};  ///< vertices on these planes stay on them, in pairs on periodic ones

  /// Of the grid that the mesh came from; 0: .97 of it are the mean edge length of the features.
  double spacing = 0;

  // What stops it: the first that applies.
  /// Hard bound on the distance to the input, both ways. Without it .1 spacings, if nothing else
  /// (for `length` also l0) stops it.
  std::optional<double> max_error{};
  std::optional<double> remove{};         ///< fraction of the vertices to remove, in [0, 1)
  std::optional<std::size_t> vertices{};  ///< number of vertices to keep

  // Sizes. An edge as long as the size wanted at both its ends is not collapsed, so edges end up
  // between one and two times as long.
  // For `curvature` l0 and step_length are wishes: longer edges cost more.
  std::optional<double> l0{};           ///< size in features (.6 spacings); length: size everywhere
  std::optional<double> step_length{};  ///< growth from ring to ring (2 spacings)
  double l_max = 0;                     ///< greatest size; 0: no limit. l0 above it raises it
  std::span<const float> size_limit{};  ///< greatest size at each vertex; empty: no limit

  /// What a facet of no area weighs against the squared distances of the vertices of the input that
  /// it stands for, in squared spacings (5e-6 to a number of vertices, else 4e-6); curvature only.
  /// At 3e-5 the distances are like those of `lindstrom_turk`, and the smallest angles of the
  /// facets 3 to 10 degrees greater.
  std::optional<double> shape_weight{};

  // What is a feature (paper, curvature).
  std::span<const float> curvature{};  ///< mean curvature at each vertex; empty: from the mesh
  double curvature_threshold = 0;      ///< on its modulus; 0: from the noise

  /// Of thin facets: by default those that cells of a grid leave. If they are exact and the bound
  /// stops it, the true distance is measured and what it leaves of the bound is used as well.
  ThinFacets thin_facets = ThinFacets::noisy;

  /// Whether the distances of the result are measured; otherwise they are what was proven, for
  /// `curvature` max_distance what was tracked on the way.
  bool measure = true;
};

struct SimplifyResult {
  TriMesh mesh;
  double max_distance = 0;          ///< greatest distance of a vertex of the input to the result
  double reverse_max_distance = 0;  ///< the same from places on the result as dense as the input
  double proven_distance = 0;       ///< bound on both over all of the surfaces
  std::string stopped_by;           ///< "vertices", "max_error", "sizes", "self_intersections" (of
                                    ///< fewer vertices) or "nothing_left"
};

/// Reduces a surface mesh by edge collapse.
///
/// Never makes an edge with more than two facets, a flipped or a zero-area facet. Vertices on a
/// side of the domain stay on its plane, corners of the domain stay. Opposite periodic sides stay
/// congruent bit for bit: an edge of one is collapsed together with its copy on the other, to the
/// same place; vertices there that have no copy stay where they are. Borders between materials keep
/// their course within max_error (.1 spacings without it). Zero-area triangles of the input are
/// removed first.
///
/// Without max_error a number of vertices is reached within .5 spacings if it can be: so much keeps
/// walls that are a cell apart from passing through each other. If not, the bound is doubled until
/// the number is reached; see proven_distance.
///
/// Where facets have passed through each other in the end, which they can within the bound, all is
/// done again: with the input kept there, and after seven times in vain, everywhere; where that
/// were more than a twentieth of it, and the bound is not the caller's, with half the bound. The
/// number of vertices may not be reached then.
///
/// A number of vertices that the sizes of `paper` do not allow raises l0 until it is reached; at
/// most half of them may be features, else the curvature threshold is raised.
///
/// `curvature` follows every vertex of the input to the facet that is nearest to it. Asked for a
/// number of vertices it collapses what changes the surface least, at last what adds least to the
/// sum of the squared distances of those vertices, and moves the vertices that are left to where
/// that sum is least, in three sweeps. Within a bound alone it collapses all that the bound allows
/// and moves vertices in one sweep.
///
/// Shape:  vertices and triangles of the result keep the order of the input; materials are carried
///         over.
/// Units:  as the mesh.
/// Throws: InputError if the mesh is empty or no 2-manifold (the message names the first bad edge
///         by its end points), or an option is out of range.
/// Cost:   about 3 to 4 us of one core per vertex removed, `curvature` 6 to 9 us, within a bound
/// alone
///         4 us; 400 bytes per vertex.
/// Source: Lindstrom and Turk 1998 (placement, cost); Lenz et al., A Novel Surface Mesh
///         Simplification Method for Flux-Dependent Topography Simulations (regions); deviations in
///         regions.h and placement.h.
SimplifyResult simplify(const TriMesh& mesh, const SimplifyOptions& options);

}  // namespace scarp

#pragma once

#include <array>
#include <cstdint>

#include "mesh/simplify/collapse_mesh.h"

namespace scarp {

/// The facets around an edge, in the order in which they will surround the merged vertex.
///
/// Facet i has the corner u or v of the edge and the ring vertices i and i + 1, counter-clockwise.
/// Around an inner vertex the ring is closed: its last vertex is its first.
struct Star {
  static constexpr int capacity = 48;

  std::uint32_t u = 0;
  std::uint32_t v = 0;
  int count = 0;
  bool closed = false;
  std::array<std::uint32_t, capacity> facet;
  std::array<std::uint32_t, capacity> rim;  ///< half edge of the facet from ring i to i + 1
  std::array<bool, capacity> at_target;     ///< the corner is v
  std::array<std::uint32_t, capacity + 1> ring;
  std::array<std::uint32_t, 2> dying;  ///< the facets of the edge; the second may be none

  int dying_count() const {
    return (dying[0] == HalfEdges::none ? 0 : 1) + (dying[1] == HalfEdges::none ? 0 : 1);
  }

  /// Whether no vertex of the one is a vertex of the other.
  bool is_apart_from(const Star& other) const;

  /// The star of half edge h. False if it has more facets than the capacity.
  bool gather(const HalfEdges& topology, std::uint32_t h);

  /// The star of an inner edge between inner vertices: quicker. Returns how many facets are at the
  /// origin, 0 if there are more facets than fit.
  int gather_closed(const HalfEdges& topology, std::uint32_t h, int most = capacity);

  /// The star of a single vertex: u and v are the same, no facet dies.
  bool gather_vertex(const HalfEdges& topology, std::uint32_t vertex);

  /// The two facets of an inner edge as they are after its flip, around the apex of h; u and v are
  /// that apex, no facet dies.
  void gather_flip(const HalfEdges& topology, std::uint32_t h);
};

/// Whether no inner edge of what a star becomes joins two places on one side of the domain: there
/// it would meet its own mirror image.
bool keeps_off_sides(const CollapseMesh& mesh, const Star& star);

}  // namespace scarp

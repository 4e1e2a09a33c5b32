#pragma once

#include <cstdint>
#include <vector>

#include "mesh/quadric.h"
#include "mesh/simplify/collapse_mesh.h"

namespace scarp {

/// What a collapse should change least.
enum class Measure : std::uint8_t { volume, distance };

/// The placement of the vertex that two become, and its cost.
struct Placed {
  Vec3d r;
  double cost = 0;  ///< length^6: a square of a volume (or as the placement says)
};

// A placement policy has
//   place(mesh, h, rule): the best place for merging the ends of h, and its cost;
//   collapsed(mesh, u, v): called after v went into u, to bring cached quadrics up to date.
// It looks only at the current mesh and its own memory, so the engine may ask in any order.

/// Keeps the volume under the surface and, with that given, changes it least.
///
/// Deviations: on a side of the domain, where the surface is mirrored, the terms for boundaries
/// weigh a quarter, by area nothing; on a periodic side the facets of the opposite one stand for
/// what goes on behind it. Where the surface is flat the volume leaves the place open;
/// instead of a shape term behind angle tests, a faint pull to the middle of the edge decides.
///
/// By area, the squared volume under each facet is divided by twice the facet's area: what is least
/// then is the squared distance between the surfaces, and the cost is length^4.
///
/// Source: Lindstrom and Turk 1998, memoryless simplification, sec. 4.
class LindstromTurkPlacement {
 public:
  using Measure = scarp::Measure;

  explicit LindstromTurkPlacement(const CollapseMesh& mesh, Measure measure = Measure::volume);
  /// For few edges: it finds what it needs to know of a vertex when it is asked.
  static LindstromTurkPlacement without_memory(Measure measure) {
    return LindstromTurkPlacement(measure);
  }
  Placed place(const CollapseMesh& mesh, std::uint32_t h, Merge rule) const;
  void collapsed(const CollapseMesh& mesh, std::uint32_t u, std::uint32_t v);

 private:
  /// Over the facets of a vertex, in its own frame: all their planes go through the origin.
  struct VertexTerms {
    SymmetricMatrix H;  ///< r H r is the weighted sum of the squared volumes under r
    Vec3d n;            ///< n r is the sum of the volumes
  };
  explicit LindstromTurkPlacement(Measure measure) : measure_(measure) {}
  VertexTerms found_terms(const CollapseMesh& mesh, std::uint32_t v) const;
  /// Those that are remembered, or else `found`, filled in.
  const VertexTerms& terms(const CollapseMesh& mesh, std::uint32_t v, VertexTerms& found) const {
    return terms_.empty() ? found = found_terms(mesh, v) : terms_[v];
  }

  /// The volume under the facets of the edge h from u to v, or from v to u: n r = d keeps it. All
  /// in the frame of u.
  struct Volume {
    Quadric q;
    Vec3d n;
    double d = 0;
  };
  Volume volume_around(const CollapseMesh& mesh, std::uint32_t h, std::uint32_t u,
                       std::uint32_t v) const;

  /// What a facet with the normal n (twice the area vector) weighs.
  double weight(Vec3d n) const;

  LargeVector<VertexTerms> terms_;  ///< per vertex, or empty
  Measure measure_;
};

/// Remembers the planes of the input and goes where the sum of the squared distances to them, by
/// area, is least.
///
/// Source: Garland and Heckbert 1997, sec. 4, weighted by area.
class GarlandHeckbertPlacement {
 public:
  explicit GarlandHeckbertPlacement(const CollapseMesh& mesh);
  Placed place(const CollapseMesh& mesh, std::uint32_t h, Merge rule) const;
  void collapsed(const CollapseMesh& mesh, std::uint32_t u, std::uint32_t v);

 private:
  std::vector<Quadric> planes_;
};

}  // namespace scarp

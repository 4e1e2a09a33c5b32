#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/tri_mesh.h"
#include "core/triangle_tree.h"
#include "flux/solve.h"

namespace scarp {

/// The facets that the flux was solved on: for as long as the surface stays close to them, for what
/// covers them and for what arrived on them.
///
/// Units: nm.
struct KeptMesh {
  TriMesh facets{};
  std::uint32_t made_at = 0;  ///< time step; also part of the key of the random numbers on it
  double bound = 0;           ///< that the simplification had on the distance to the surface
  double max_distance = 0;    ///< that it found
  /// What rays met on it; not part of a state, since they find it again.
  std::shared_ptr<const KeptHits> hits{};
  /// Of the facets; not part of a state either.
  std::shared_ptr<const TriangleTree> tree{};
};

/// Its tree, if need be one made now.
std::shared_ptr<const TriangleTree> tree_of(const KeptMesh& mesh);

/// The materials of a mesh as those of the surface, if the two are one within a distance: no vertex
/// of the surface or of the mesh is further from facets of its own material in the other one.
///
/// Shape:  one per facet of the mesh. Units: nm.
/// Cost:   about a microsecond per vertex of both.
std::optional<std::vector<MaterialId>> materials_if_close(const TriMesh& mesh,
                                                          const TriMesh& surface, double distance);

}  // namespace scarp

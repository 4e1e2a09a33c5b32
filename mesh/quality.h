#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"

namespace scarp {

/// The shape of the facets of a mesh. Units: degrees.
struct AngleStatistics {
  double mean_minimum = 0;  ///< mean over the facets of their smallest angle
  double lowest = 0;        ///< smallest angle of all
  double below_5 = 0;       ///< fraction of facets with an angle below 5 degrees
  double below_20 = 0;
};

/// What a simplified mesh must not have, counted.
struct Defects {
  std::size_t non_manifold_edges = 0;  ///< more than two triangles, or two that disagree
  std::size_t zero_area = 0;
  std::size_t flipped = 0;       ///< flipped_facets()
  std::size_t off_plane = 0;     ///< vertices that have left their side, or lie beyond one
  std::size_t lost_corners = 0;  ///< vertices at a corner of the domain that are not there any more
};

AngleStatistics angle_statistics(const TriMesh& mesh);

/// The facets of a simplified mesh whose normal is turned by more than 90 degrees against every
/// facet of the original within a hundredth of their longest edge (and against the closest) of
/// their middle.
std::vector<std::uint32_t> flipped_facets(const TriMesh& simplified, const TriMesh& original);

/// Compares a simplified mesh with what it came from.
///
/// Boundary vertices count as off their plane only if every boundary vertex of the original lies on
/// one; other vertices where they lie beyond a side, only if none of the original does.
Defects find_defects(const TriMesh& simplified, const TriMesh& original, const Sides& sides);

/// The sides of a mesh that has no domain: those of its bounding box in x and y.
Sides sides_of(const TriMesh& mesh);

}  // namespace scarp

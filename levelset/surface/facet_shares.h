#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/tri_mesh.h"
#include "core/triangle_tree.h"

namespace scarp {

/// A facet that tells a node its speed, and how much of it.
struct FacetShare {
  ClosestPoint point;
  double share = 1;  ///< the sum over a node's facets is 1
};

/// What each of the facets counts that are nearly as near to a node as the first, which alone
/// answers for it but at edges.
///
/// At an edge of the surface each of its sides counts by its nearest facet: the less the further
/// that is away, and the less it faces along the direction. So it makes no difference which of two
/// sides that are as near and face it as much is found first, by rounding or because the mesh is
/// cut into facets otherwise: a narrow bevel between two sides is none. A facet of another material
/// than the first one's does not count: a border is sharp.
///
/// Shape: the first facet first, the others in any order; those are left that count.
/// Units: room in that of the mesh: what is further away by so much does not count.
void share_out(const TriMesh& facets, Vec3d direction, double room,
               std::vector<FacetShare>& shares);

/// Of two sides that do not go on alike, the one that the surface follows where they meet: the
/// slower one where the edge stands out and one of them recedes, the faster one where it lies in a
/// corner and one of them grows. There the two go on to meet in an edge, and a mean would leave a
/// fence or a slot behind. Nothing where they are as fast, so that mirror images have the same, and
/// where the edge becomes round, as it does in all other cases.
///
/// speeds: of the sides, one each.
std::optional<std::size_t> leading_side(const TriMesh& facets, std::span<const FacetShare> sides,
                                        std::span<const float> speeds);

}  // namespace scarp

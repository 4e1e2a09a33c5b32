#pragma once

#include <array>
#include <vector>

#include "core/tri_mesh.h"
#include "levelset/layers.h"

namespace scarp {

/// A line in a cutting plane: its points as (lateral position, height). Closed if the first point
/// is repeated at the end. With the lateral position to
/// the right and the height upwards the gas lies to its left.
///
/// Units: nm.
struct Polyline {
  std::vector<std::array<double, 2>> points;

  friend bool operator==(const Polyline&, const Polyline&) = default;
};

/// Where the plane r[axis] = position (axis 0 or 1) cuts a mesh.
///
/// Lines follow the facets, so sharp corners stay. A plane on a domain side is taken just inside.
std::vector<Polyline> cross_section(const TriMesh& mesh, int axis, double position);

/// The surfaces of all layers, from the lowest up, in the plane r[axis] = position; none for a
/// layer that adds no material.
std::vector<std::vector<Polyline>> cross_section(const Layers& layers, int axis, double position);

/// Volume of each layer's material, from the extracted surfaces; the lowest layer counts from
/// z = 0, so an etched wafer has a negative volume there.
///
/// Units: nm^3.
std::vector<double> material_volumes(const Layers& layers);

}  // namespace scarp

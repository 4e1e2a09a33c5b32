#pragma once

#include <vector>

#include "levelset/metrology/cross_section.h"

namespace scarp {

/// The surfaces of all layers, from the lowest up, in the plane r[axis] = position; none for a
/// layer that adds no material.
inline std::vector<std::vector<Polyline>> cross_section(const Layers& layers, int axis,
                                                        double position) {
  std::vector<std::vector<Polyline>> lines;
  for (const TriMesh& surface : layer_surfaces(layers)) {
    lines.emplace_back();
    if (!surface.triangles.empty()) lines.back() = cross_section(surface, axis, position);
  }
  return lines;
}

}  // namespace scarp

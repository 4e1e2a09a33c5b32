#pragma once

#include <cstdint>
#include <vector>

#include "levelset/layers.h"

namespace scarp {

/// Gas that no path joins to the source.
struct Void {
  double volume = 0;  ///< of its nodes, nm^3
  double lower = 0;   ///< height of its lowest and highest node, nm
  double upper = 0;
};

/// Which gas is joined to the source above the wafer.
///
/// Two gas nodes are joined if they are neighbours along an axis: two fronts that touch over an
/// edge of a cell separate the gas, as they do in the extracted surface. Valid until the layers
/// change.
///
/// Shape: open has 8 words per leaf of the top layer's band, one bit per node.
struct OpenGas {
  std::vector<std::uint64_t> open;
  std::vector<Void> voids;  ///< ordered by their first node

  bool is_open(std::size_t leaf, int node) const {
    return ((open[leaf * 8 + static_cast<std::size_t>(node >> 6)] >> (node & 63)) & 1) != 0;
  }
};

/// Labels the gas of the top layer.
///
/// Cost: linear in the number of leaves of the band.
OpenGas open_gas(const Layers& layers);

}  // namespace scarp

#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/tri_mesh.h"
#include "levelset/grid/layers.h"

namespace scarp {

/// Where the layers of a stack are, in few bytes, for pages that show what lies within;
/// apps/viewer/src/unpack.js reads it.
///
/// Shape: bytes are a zlib stream of a volume for each layer but the highest, bottom up: a byte per
///        node, x first, 128 at the border of the layer together with those below, less inside of
///        it, one more or less per 1/63 of the longest step between nodes. materials are those of
///        the layers, bottom up; layers that are nowhere are left out.
/// Units: nm.
struct PackedVolume {
  std::array<int, 3> nodes{};
  Box box;
  std::vector<MaterialId> materials{};
  std::string bytes{};
};

/// At most 64^3 nodes, no closer than those of the grid. No materials at all where there are more
/// than five layers, which is what the viewer can tell apart.
///
/// Cost: some 100 ns per node and layer, on all threads.
PackedVolume pack_volume(const Layers& layers, const Box& box);

}  // namespace scarp

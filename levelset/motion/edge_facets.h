#pragma once

#include <cstddef>
#include <vector>

#include "levelset/grid/layers.h"
#include "levelset/motion/speed_field.h"

namespace scarp {

/// A node whose phi is between two values after a time step.
struct HeldNode {
  std::size_t at = 0;  ///< in the top's band: 512 values per leaf
  float least = 0;
  float most = 0;
};

/// Holds a crystal that has grown out of an opening behind the planes that begin at the edge of the
/// mask.
///
/// From the moment on at which the crystal's top passes the mask's, the slowest plane through that
/// edge bounds it. A grid sees this facet only when it is longer than a spacing; until then the
/// whole top goes up, beyond the edge as well, and the facet starts up to two spacings too far out.
/// How long ago that moment was is known from the height of the top, so nodes next to the edge do
/// not pass the plane before the top is five spacings higher, and those that are nearest to the
/// facet itself do not stay behind it. Nothing is taken away from a crystal that is already
/// further.
///
/// Only for speeds that grow a crystal beside what does not move; edges are those of upright or
/// leaning walls at least a spacing high.
///
/// Shape: mobility as by mobilities(). Units: dt in spacings per (nm/s).
std::vector<HeldNode> edge_facets(const Layers& layers, const SpeedField& field,
                                  const std::vector<float>& mobility, float dt);

}  // namespace scarp

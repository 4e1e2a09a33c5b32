#pragma once

#include "levelset/operations/level_plane.h"

namespace scarp {

/// Which nodes of a level plane level discs cover that lie in the gas.
///
/// Units: spacings.
struct Clearance {
  /// Above 0 at nodes that a disc of the radius covers, below 0 at others; where the two lie beside
  /// each other, how far it is to the rim of such discs. Undefined in the solid.
  LevelPlane<float> covered;
  /// By how much the widest disc that covers a node has a larger radius, as far as two spacings;
  /// -infinite where it is smaller by a spacing or more.
  LevelPlane<float> spare;
};

/// Of the plane of the nodes with some index along z. A disc fits where it is too large by a
/// hundredth of a spacing.
///
/// How wide an opening is does not depend on where it lies on the grid: the widest disc may have
/// its centre anywhere between nodes.
///
/// Within a spacing above a floor and below a rim the walls are those above and below it: there
/// phi tells the distance to the floor or the rim.
/// Units: of the radius, spacings.
/// Cost:  per node as many steps as the disc's diameter has spacings; per spacing along walls as
///        many as the disc has nodes.
Clearance clearance(const Band& band, int k, double radius);

}  // namespace scarp

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "levelset/grid/band.h"
#include "levelset/grid/layers.h"

namespace scarp {

/// A node that has to be gas, so that what lies on a film is parted from what lies below once the
/// film is gone, where no node lies in the film itself.
struct GapNode {
  Node node{};            ///< of what lies on the film
  std::size_t layer = 0;  ///< that it lies in
  float lower = 0;        ///< how far it is from what lies below the film. Units: spacings
  float half_gap = 0;     ///< half of all that is gone between the two. Units: spacings
  /// Where what lies on the film stays, the gap is as wide as the film was, around this node: both
  /// sides of it keep their volume, less than a spacing from their place. Elsewhere all up to the
  /// lower side is gas.
  bool stays = false;
};

/// The gaps that the material of one layer leaves; where it lies outside a solid, if there is one.
/// Films thinner than a hundredth of a spacing leave none.
///
/// staying: the top once all is done, or nothing if all that lies on the film is free.
std::vector<GapNode> thin_gaps(const Layers& layers, std::size_t layer, const LevelSet* kept,
                               const LevelSet* staying);

/// Makes these gaps in one of the layers above the film, the rest of which is gone already.
void open_gaps(Band& band, std::size_t layer, const LevelSet& below, std::span<const GapNode> gaps);

}  // namespace scarp

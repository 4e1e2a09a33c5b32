#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/triangle_tree.h"
#include "levelset/grid/band.h"

namespace scarp {

/// The facets that answered for nodes next to a surface and had no rival (see ClosestPoint).
///
/// A node stays where it is while the surface moves past it, so such a facet answers at the next
/// move as well if it still faces the right way.
class KeptFacets {
 public:
  /// Room for the nodes of a band's leaves; what answered in leaves that are gone is forgotten. Not
  /// from several threads.
  void prepare(const Band& band);

  /// Of the 512 nodes of a leaf of that band, ClosestPoint::none where none is kept. From several
  /// threads, each with leaves of its own.
  std::span<std::uint32_t> of_leaf(std::size_t leaf);

 private:
  struct LeafAnswers {
    Node origin{};
    std::vector<std::uint32_t> facets{};  ///< empty until a node asks
  };
  std::vector<LeafAnswers> leaves_;
};

}  // namespace scarp

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "levelset/grid/band.h"
#include "levelset/grid/layers.h"

namespace scarp {

/// A node whose phi has to be another one, so that what lies on a film is parted from what lies
/// below once the film is gone, and neither grows.
struct GapNode {
  enum class Place {
    above,   ///< of what lies on the film, where no node lies in the film: becomes gas
    within,  ///< in the film beside both sides: tells how far the lower one is
    beside   ///< of what lies on the film, beside a node within: keeps the upper side in its place
  };
  Node node{};
  Place place = Place::above;
  std::size_t layer = 0;  ///< that it lies in, or of the film
  float phi = 0;          ///< of what lies below at this node; beside: what is to be
  float half_gap = 0;     ///< above: half of all that is gone between the two; beside: how far the
                          ///< film is. Units: spacings
  /// above: what lies on the film stays. Then the gap is as wide as the film was, around this node:
  /// both sides of it keep their volume, less than a spacing from their place. Elsewhere all up to
  /// the lower side is gas. beside: no other gas lies beside it.
  bool stays = false;
};

/// The gaps that the material of one layer leaves; where it lies outside a solid, if there is one.
/// Films thinner than a hundredth of a spacing leave none.
///
/// staying: the top once all is done, or nothing if all that lies on the film is free.
std::vector<GapNode> thin_gaps(const Layers& layers, std::size_t layer, const LevelSet* kept,
                               const LevelSet* staying);

/// An edge of the grid between two solid nodes that a film cuts in which neither lies.
struct FilmEdge {
  Node above{};  ///< in what lies on the film
  Node below{};  ///< beside it, in what lies below
};

/// Those of the film of one layer; the nodes above lie in the domain.
std::vector<FilmEdge> film_edges(const Layers& layers, std::size_t layer);

/// Whether two nodes beside each other are the ends of such an edge.
bool is_film_edge(const Layers& layers, std::size_t layer, const FilmEdge& edge);

/// Makes these gaps in one of the layers above the film, the rest of which is gone already.
void open_gaps(Band& band, std::size_t layer, const LevelSet& below, std::span<const GapNode> gaps);

}  // namespace scarp

#pragma once

#include <functional>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "levelset/operations/thin_gaps.h"

namespace scarp {

/// Follows a film along the edges of the grid that it cuts, and through nodes that lie in it.
///
/// It goes on from one edge to another that belongs to the same face of a cell, and between an edge
/// and a node of such a face: both sides of what a film wraps are parted.
class FilmFlood {
 public:
  /// is_unreached: whether a node lies in the film, and is not reached already.
  FilmFlood(const Band& band, std::function<bool(const Node&)> is_unreached)
      : band_(&band), is_unreached_(std::move(is_unreached)) {}

  void add(const FilmEdge& edge) { reached_.try_emplace(key_of(edge), false); }

  void reach(const FilmEdge& edge);
  /// The edges beside one that is none of the film's, but one of the surface on it.
  void reach_beside(const FilmEdge& edge);
  /// What lies beside a node in the film that is reached.
  void go_on_from(const Node& node);

  /// All ends of edges, and nodes in the film, that are joined to what was reached.
  std::vector<Node> run();

 private:
  /// Above, and which of the six nodes around it lies below. In the domain.
  struct Key {
    Node above{};
    int face = 0;
    bool operator<(const Key& other) const {
      return std::tie(above, face) < std::tie(other.above, other.face);
    }
  };

  void reach(const Node& node);
  Key key_of(const FilmEdge& edge) const;
  FilmEdge edge_of(const Key& key) const;
  Node folded(const Node& node) const;
  /// The edges that share a face with one.
  template <class Visit>
  static void for_edges_beside(const FilmEdge& edge, const Visit& visit);
  /// The nodes of these faces.
  template <class Visit>
  static void for_nodes_beside(const FilmEdge& edge, const Visit& visit);

  const Band* band_;
  std::map<Key, bool> reached_;  ///< whether an edge is
  std::vector<Key> front_;
  std::function<bool(const Node&)> is_unreached_;
  std::set<Node> nodes_;  ///< in the film, that are reached
  std::vector<Node> nodes_front_;
};

}  // namespace scarp

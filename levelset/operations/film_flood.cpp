#include "levelset/operations/film_flood.h"

namespace scarp {

namespace {

/// The six nodes around one: -x, +x, -y, +y, -z, +z.
Node around(Node node, int face) {
  node[static_cast<std::size_t>(face / 2)] += face % 2 == 0 ? -1 : 1;
  return node;
}

int opposite(int face) { return face ^ 1; }

int face_to(const Node& from, const Node& to) {
  for (int face = 0; face < 6; ++face)
    if (around(from, face) == to) return face;
  return 0;
}

}  // namespace

Node FilmFlood::folded(const Node& node) const {
  return {band_->fold(0, node[0]), band_->fold(1, node[1]), node[2]};
}

FilmFlood::Key FilmFlood::key_of(const FilmEdge& edge) const {
  int face = face_to(edge.above, edge.below);
  const auto axis = static_cast<std::size_t>(face / 2);
  // Beyond a side that mirrors, or towards the node beyond it, an edge is the image of another one.
  if (axis < 2 && band_->frame().boundary[axis] == Boundary::reflective) {
    const int cells = band_->frame().cells[axis];
    const bool is_beyond = edge.above[axis] < 0 || edge.below[axis] < 0 ||
                           edge.above[axis] > cells || edge.below[axis] > cells;
    if (is_beyond) face = opposite(face);
  }
  return {folded(edge.above), face};
}

FilmEdge FilmFlood::edge_of(const Key& key) const {
  return {.above = key.above, .below = around(key.above, key.face)};
}

template <class Visit>
void FilmFlood::for_edges_beside(const FilmEdge& edge, const Visit& visit) {
  const int along = face_to(edge.above, edge.below) / 2;
  for (int face = 0; face < 6; ++face) {
    if (face / 2 == along) continue;
    const Node above = around(edge.above, face);
    const Node below = around(edge.below, face);
    visit(FilmEdge{above, below});
    visit(FilmEdge{edge.above, above});
    visit(FilmEdge{below, edge.below});
    // The film may turn within the face.
    visit(FilmEdge{above, edge.above});
    visit(FilmEdge{edge.below, below});
    visit(FilmEdge{below, above});
  }
}

template <class Visit>
void FilmFlood::for_nodes_beside(const FilmEdge& edge, const Visit& visit) {
  const int along = face_to(edge.above, edge.below) / 2;
  for (int face = 0; face < 6; ++face) {
    if (face / 2 == along) continue;
    visit(around(edge.above, face));
    visit(around(edge.below, face));
  }
}

void FilmFlood::reach(const FilmEdge& edge) {
  const auto found = reached_.find(key_of(edge));
  if (found == reached_.end() || found->second) return;
  found->second = true;
  front_.push_back(found->first);
}

void FilmFlood::reach_beside(const FilmEdge& edge) {
  for_edges_beside(edge, [&](const FilmEdge& beside) { reach(beside); });
}

std::vector<Node> FilmFlood::run() {
  while (!front_.empty() || !nodes_front_.empty()) {
    if (!front_.empty()) {
      const FilmEdge edge = edge_of(front_.back());
      front_.pop_back();
      reach_beside(edge);
      for_nodes_beside(edge, [&](const Node& node) { reach(node); });
    } else {
      const Node node = nodes_front_.back();
      nodes_front_.pop_back();
      go_on_from(node);
    }
  }
  for (const auto& [key, is_edge_reached] : reached_) {
    if (!is_edge_reached) continue;
    nodes_.insert(key.above);
    nodes_.insert(folded(edge_of(key).below));
  }
  return {nodes_.begin(), nodes_.end()};
}

void FilmFlood::reach(const Node& node) {
  if (is_unreached_(node) && nodes_.insert(folded(node)).second)
    nodes_front_.push_back(folded(node));
}

// To all of the faces that a node belongs to.
void FilmFlood::go_on_from(const Node& node) {
  for (int face = 0; face < 6; ++face) {
    const Node beside = around(node, face);
    reach(beside);
    for (int other = 0; other < 6; ++other) {
      if (other / 2 == face / 2) continue;
      const Node corner = around(beside, other);
      reach(corner);  // of a film about as thick as a spacing, at a slant
      reach({.above = beside, .below = corner});
      reach({.above = corner, .below = beside});
    }
  }
}

}  // namespace scarp

#include "mesh/simplify/star.h"

#include <algorithm>

namespace scarp {

namespace {

/// Turns counter-clockwise around the two ends of an edge as if they were one vertex.
class Turn {
 public:
  Turn(const HalfEdges& topology, std::uint32_t h)
      : topology_(topology), h_(h), o_(topology.opposite(h)) {}

  /// The first outgoing half edge that is not in a facet of the edge; none if there is none.
  std::uint32_t first() const {
    const std::uint32_t u = topology_.origin(h_);
    const std::uint32_t v = topology_.target(h_);
    if (o_ == HalfEdges::none) return across(topology_.outgoing(v));
    if (topology_.on_boundary(u)) return across(topology_.outgoing(u));
    if (topology_.on_boundary(v)) return across(topology_.outgoing(v));
    return across(h_);
  }

  std::uint32_t next(std::uint32_t g) const {
    return across(topology_.opposite(HalfEdges::previous(g)));
  }

 private:
  /// Steps over the facets of the edge, from one end to the other.
  std::uint32_t across(std::uint32_t g) const {
    if (g == HalfEdges::none) return g;
    if (g == h_ || g == HalfEdges::next(h_)) return topology_.opposite(HalfEdges::previous(h_));
    if (o_ != HalfEdges::none && (g == o_ || g == HalfEdges::next(o_))) {
      return topology_.opposite(HalfEdges::previous(o_));
    }
    return g;
  }

  const HalfEdges& topology_;
  std::uint32_t h_;
  std::uint32_t o_;
};

}  // namespace

bool Star::is_apart_from(const Star& other) const {
  const auto has = [&other](std::uint32_t w) {
    const auto end = other.ring.begin() + other.count + 1;
    return w == other.u || w == other.v || std::find(other.ring.begin(), end, w) != end;
  };
  return !has(u) && !has(v) && std::none_of(ring.begin(), ring.begin() + count + 1, has);
}

bool Star::gather(const HalfEdges& topology, std::uint32_t h) {
  u = topology.origin(h);
  v = topology.target(h);
  const std::uint32_t o = topology.opposite(h);
  dying = {HalfEdges::facet(h), o == HalfEdges::none ? HalfEdges::none : HalfEdges::facet(o)};
  const Turn turn(topology, h);
  const std::uint32_t first = turn.first();
  count = 0;
  for (std::uint32_t g = first; g != HalfEdges::none;) {
    if (count == capacity) return false;
    facet[count] = HalfEdges::facet(g);
    rim[count] = HalfEdges::next(g);
    at_target[count] = topology.origin(g) == v;
    ring[count] = topology.target(g);
    ring[count + 1] = topology.apex(g);
    ++count;
    g = turn.next(g);
    if (g == first) break;
  }
  closed = count > 0 && ring[count] == ring[0];
  return true;
}

int Star::gather_closed(const HalfEdges& topology, std::uint32_t h, int most) {
  const std::uint32_t o = topology.opposite(h);
  u = topology.origin(h);
  v = topology.target(h);
  dying = {HalfEdges::facet(h), HalfEdges::facet(o)};
  closed = true;
  count = 0;
  // From one facet of the edge to the other, and back.
  const auto add = [&](std::uint32_t from, std::uint32_t last, bool is_at_target) {
    for (std::uint32_t g = topology.opposite(HalfEdges::previous(from)); g != last;
         g = topology.opposite(HalfEdges::previous(g))) {
      if (count == most) return false;
      facet[count] = HalfEdges::facet(g);
      rim[count] = HalfEdges::next(g);
      at_target[count] = is_at_target;
      ring[count] = topology.target(g);
      ++count;
    }
    return true;
  };
  if (!add(h, HalfEdges::next(o), false)) return 0;
  const int at_origin = count;
  if (!add(o, HalfEdges::next(h), true)) return 0;
  ring[count] = ring[0];
  return at_origin;
}

bool Star::gather_vertex(const HalfEdges& topology, std::uint32_t vertex) {
  u = v = vertex;
  dying = {HalfEdges::none, HalfEdges::none};
  count = 0;
  bool fits = true;
  topology.for_each_outgoing(vertex, [&](std::uint32_t g) {
    if (count == capacity) {
      fits = false;
      return;
    }
    facet[count] = HalfEdges::facet(g);
    rim[count] = HalfEdges::next(g);
    at_target[count] = false;
    ring[count] = topology.target(g);
    ring[++count] = topology.apex(g);
  });
  closed = count > 0 && ring[count] == ring[0];
  return fits;
}

void Star::gather_flip(const HalfEdges& topology, std::uint32_t h) {
  const std::uint32_t o = topology.opposite(h);
  u = v = topology.apex(h);
  dying = {HalfEdges::none, HalfEdges::none};
  count = 2;
  closed = false;
  facet[0] = HalfEdges::facet(h);
  facet[1] = HalfEdges::facet(o);
  rim[0] = HalfEdges::next(o);
  rim[1] = HalfEdges::previous(o);
  at_target[0] = at_target[1] = false;
  ring[0] = topology.origin(h);
  ring[1] = topology.apex(o);
  ring[2] = topology.target(h);
}

bool keeps_off_sides(const CollapseMesh& mesh, const Star& star) {
  const int sides = mesh.sides[star.u] | mesh.sides[star.v];
  if (sides == 0) return true;
  // The first and the last edge of an open ring are boundaries.
  for (int i = star.closed ? 0 : 1; i < star.count; ++i)
    if ((mesh.sides[star.ring[i]] & sides) != 0) return false;
  return true;
}

}  // namespace scarp

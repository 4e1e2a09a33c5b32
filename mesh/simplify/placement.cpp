#include "mesh/simplify/placement.h"

#include <array>
#include <cmath>

#include "core/parallel.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 1024;

/// Pull to the middle of the edge, as part of the quadric's trace. Noise of .01 cells is felt at
/// 1e-4, the rounding of coordinates at 1e-10. It widens the smallest angles by a degree.
constexpr double faint = 3e-6;

/// The same for volumes: smallest angles and distances as by the angle tests of the source.
constexpr double faintest = 3e-8;

/// How high an area under the edge of a side of the domain is as a volume, in lengths of the
/// collapsed edge. Half as high as on another boundary: behind it the surface goes on.
constexpr double side_height = 0.5;

/// Part of the length, to the power of the cost, added to every cost: between equal costs, as on a
/// plane, short edges collapse first.
constexpr double tie_break = 1e-10;

/// A minimum further from the middle of the edge than this many lengths is not trusted.
constexpr double reach = 1.5;

/// The better of the ends that the rule allows; q in the frame of the origin of h.
Placed best_end(const CollapseMesh& mesh, std::uint32_t h, Merge rule, const Quadric& q) {
  const Vec3d u = mesh.r[mesh.topology.origin(h)];
  const Vec3d v = mesh.r[mesh.topology.target(h)];
  const double cost_u = q.value({});
  const double cost_v = q.value(v - u);
  const bool to_u = rule == Merge::onto_origin || (rule == Merge::onto_either && cost_u <= cost_v);
  return to_u ? Placed{u, cost_u} : Placed{v, cost_v};
}

/// The place where q is least, with n r = d where the sides allow that; all in the frame of the
/// origin of h.
Placed best_place(const CollapseMesh& mesh, std::uint32_t h, const Quadric& q, Vec3d n, double d,
                  double pull) {
  const Vec3d u = mesh.r[mesh.topology.origin(h)];
  const Vec3d edge = mesh.r[mesh.topology.target(h)] - u;
  const Vec3d middle = 0.5 * edge;
  const auto sides = static_cast<SideMask>(mesh.sides[mesh.topology.origin(h)] |
                                           mesh.sides[mesh.topology.target(h)]);
  const double weight = pull * q.H.trace();
  Vec3d r;
  if (weight > 0 && sides == 0) {
    r = minimum_on_plane(q, weight, middle, n, d);
  } else {
    Subspace places = allowed_places(mesh, h);
    places.intersect(n, d);
    r = weight > 0 ? minimum(q, weight, middle, places) : places.origin;
  }
  const Vec3d shift = r - middle;
  if (dot(shift, shift) > reach * reach * dot(edge, edge)) r = allowed_places(mesh, h).origin;
  const Vec3d place = mesh.rounded(u + r, sides);
  return {place, q.value(place - u)};
}

/// scale: what the unit of the cost is to the length of the edge.
double with_tie_break(double cost, double scale) {
  // Rounding may leave a flat cost a little below zero.
  return (cost > 0 ? cost : 0) + tie_break * scale;
}

/// How high areas under the edges of the boundary are as volumes.
struct BoundaryHeights {
  double open;
  double on_side;  ///< 0: sides of the domain are no boundary
};

/// Adds, for the edges of the boundary at v, the areas under the new place as volumes.
void add_boundary(const CollapseMesh& mesh, std::uint32_t v, Vec3d frame,
                  const BoundaryHeights& heights, Quadric& q) {
  const double height = mesh.sides[v] != 0 ? heights.on_side : heights.open;
  if (height == 0 || !mesh.topology.on_boundary(v)) return;
  const std::uint32_t out = mesh.topology.outgoing(v);
  std::uint32_t last = out;
  mesh.topology.for_each_outgoing(v, [&](std::uint32_t h) { last = h; });
  for (const std::uint32_t w : {mesh.topology.target(out), mesh.topology.apex(last)}) {
    q.add_line(9 * height * height, mesh.r[v] - frame, mesh.r[w] - frame);
  }
}

}  // namespace

LindstromTurkPlacement::LindstromTurkPlacement(const CollapseMesh& mesh, Measure measure)
    : terms_(mesh.r.size()), measure_(measure) {
  parallel_for(terms_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      terms_[v] = found_terms(mesh, static_cast<std::uint32_t>(v));
    }
  });
}

double LindstromTurkPlacement::weight(Vec3d n) const {
  if (measure_ == Measure::volume) return 1;
  const double twice_area = length(n);
  return twice_area > 0 ? 1 / twice_area : 0;
}

LindstromTurkPlacement::VertexTerms LindstromTurkPlacement::found_terms(const CollapseMesh& mesh,
                                                                        std::uint32_t v) const {
  VertexTerms terms;
  mesh.topology.for_each_outgoing(v, [&](std::uint32_t h) {
    const Vec3d n = mesh.normals[HalfEdges::facet(h)];
    terms.H.add_outer(weight(n), n);
    terms.n += n;
  });
  return terms;
}

LindstromTurkPlacement::Volume LindstromTurkPlacement::volume_around(const CollapseMesh& mesh,
                                                                     std::uint32_t h,
                                                                     std::uint32_t u,
                                                                     std::uint32_t v) const {
  const Vec3d edge = mesh.r[v] - mesh.r[u];
  std::array<VertexTerms, 2> found;
  const VertexTerms& of_u = terms(mesh, u, found[0]);
  const VertexTerms& of_v = terms(mesh, v, found[1]);
  Volume volume{
      .q = {.H = of_v.H, .g = of_v.H * edge, .k = 0}, .n = of_u.n + of_v.n, .d = dot(of_v.n, edge)};
  volume.q.k = dot(edge, volume.q.g);
  volume.q.H.add(1, of_u.H);
  // Those of the edge were counted twice; both ends lie in them, so g, k and d have no part of
  // them.
  for (const std::uint32_t side : {h, mesh.topology.opposite(h)}) {
    if (side == HalfEdges::none) continue;
    const Vec3d shared = mesh.normals[HalfEdges::facet(side)];
    volume.q.H.add_outer(-weight(shared), shared);
    volume.n = volume.n - shared;
  }
  return volume;
}

Placed LindstromTurkPlacement::place(const CollapseMesh& mesh, std::uint32_t h, Merge rule) const {
  const std::uint32_t u = mesh.topology.origin(h);
  const std::uint32_t v = mesh.topology.target(h);
  const double squared_length = mesh.squared_length(h);
  auto [q, n, d] = volume_around(mesh, h, u, v);
  if (const std::uint32_t t = mesh.twin_edge(h); t != HalfEdges::none) {
    const Volume there = volume_around(mesh, t, mesh.topology.target(t), mesh.topology.origin(t));
    q.add(1, there.q);
    n += there.n;
    d += there.d;
  } else if (mesh.topology.on_boundary(u) || mesh.topology.on_boundary(v)) {
    const double length = std::sqrt(squared_length);
    const BoundaryHeights heights = measure_ == Measure::volume
                                        ? BoundaryHeights{length, side_height * length}
                                        : BoundaryHeights{1, 0};
    add_boundary(mesh, u, mesh.r[u], heights, q);
    add_boundary(mesh, v, mesh.r[u], heights, q);
  }
  Placed placed;
  if (rule == Merge::free) {
    placed = best_place(mesh, h, q, n, d, measure_ == Measure::volume ? faintest : faint);
  } else {
    placed = best_end(mesh, h, rule, q);
  }
  const double square = squared_length * squared_length;
  const double scale = measure_ == Measure::volume ? square * squared_length : square;
  placed.cost = with_tie_break(placed.cost, scale);
  return placed;
}

void LindstromTurkPlacement::collapsed(const CollapseMesh& mesh, std::uint32_t u, std::uint32_t) {
  terms_[u] = found_terms(mesh, u);
  mesh.topology.for_each_neighbour(u, [&](std::uint32_t w) { terms_[w] = found_terms(mesh, w); });
}

GarlandHeckbertPlacement::GarlandHeckbertPlacement(const CollapseMesh& mesh)
    : planes_(mesh.r.size()) {
  for (std::uint32_t v = 0; v < planes_.size(); ++v) {
    mesh.topology.for_each_outgoing(v, [&](std::uint32_t h) {
      const Vec3d n = mesh.normals[HalfEdges::facet(h)];
      const double twice_area = length(n);
      if (!(twice_area > 0)) return;
      planes_[v].add_plane(1 / twice_area, n, dot(n, mesh.r[v]));
    });
    if (mesh.topology.outgoing(v) != HalfEdges::none) {
      add_boundary(mesh, v, {}, {.open = 1, .on_side = 0}, planes_[v]);
    }
  }
}

Placed GarlandHeckbertPlacement::place(const CollapseMesh& mesh, std::uint32_t h,
                                       Merge rule) const {
  const auto planes_around = [&](std::uint32_t u, std::uint32_t v) {
    Quadric q = planes_[u];
    q.add(1, planes_[v]);
    return q.moved(mesh.r[u]);
  };
  Quadric q = planes_around(mesh.topology.origin(h), mesh.topology.target(h));
  if (const std::uint32_t t = mesh.twin_edge(h); t != HalfEdges::none) {
    q.add(1, planes_around(mesh.topology.target(t), mesh.topology.origin(t)));
  }
  const double squared_length = mesh.squared_length(h);
  Placed placed =
      rule == Merge::free ? best_place(mesh, h, q, {}, 0, faint) : best_end(mesh, h, rule, q);
  // Area times squared distance, made a squared volume by the only other length there is.
  placed.cost = with_tie_break(placed.cost * squared_length,
                               squared_length * squared_length * squared_length);
  return placed;
}

void GarlandHeckbertPlacement::collapsed(const CollapseMesh&, std::uint32_t u, std::uint32_t v) {
  planes_[u].add(1, planes_[v]);
}

}  // namespace scarp

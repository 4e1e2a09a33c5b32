#include "mesh/simplify/zero_area.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <unordered_map>
#include <vector>

#include "core/parallel.h"
#include "mesh/simplify/star.h"

namespace scarp {

namespace {

/// Height over the longest edge that float coordinates cannot tell from none.
constexpr double without_area = 1e-5;

/// A short edge is one of at most this part of the longest one of its facet.
constexpr double short_edge = 1e-3;

struct Shape {
  std::uint32_t shortest = 0;  ///< half edges
  std::uint32_t longest = 0;
  double shortest_square = 0;
  double longest_square = 0;
  double square = 0;  ///< of twice the area

  bool has_area() const {
    return square > without_area * without_area * longest_square * longest_square;
  }
};

Shape shape_of(const CollapseMesh& mesh, std::uint32_t f) {
  Shape shape{.shortest = 3 * f, .longest = 3 * f};
  shape.shortest_square = shape.longest_square = mesh.squared_length(3 * f);
  for (std::uint32_t h = 3 * f + 1; h < 3 * f + 3; ++h) {
    const double square = mesh.squared_length(h);
    if (square < shape.shortest_square) {
      shape.shortest_square = square;
      shape.shortest = h;
    }
    if (square > shape.longest_square) {
      shape.longest_square = square;
      shape.longest = h;
    }
  }
  shape.square = dot(mesh.normals[f], mesh.normals[f]);
  return shape;
}

/// Whether the facets of a star keep their direction when its edge is collapsed to r.
bool keeps_directions(const CollapseMesh& mesh, const Star& star, Vec3d r) {
  for (int i = 0; i < star.count; ++i) {
    if (!shape_of(mesh, star.facet[i]).has_area()) continue;
    const Vec3d n = cross(mesh.r[star.ring[i]] - r, mesh.r[star.ring[i + 1]] - r);
    if (!(dot(n, mesh.normals[star.facet[i]]) > 0)) return false;
  }
  return true;
}

void renew_normals(CollapseMesh& mesh, const Star& star) {
  for (int i = 0; i < star.count; ++i) mesh.normals[star.facet[i]] = mesh.normal_of(star.facet[i]);
}

/// How far the surface has moved around the vertices where it has.
class Moves {
 public:
  explicit Moves(double most) : most_(most) {}

  /// Notes a move of all around some vertices, unless it is too far.
  bool go_on(std::initializer_list<std::uint32_t> vertices, double distance) {
    double moved = 0;
    for (const std::uint32_t v : vertices) {
      if (const auto at = around_.find(v); at != around_.end()) moved = std::max(moved, at->second);
    }
    moved += distance;
    if (moved > most_) return false;
    for (const std::uint32_t v : vertices) around_[v] = moved;
    largest_ = std::max(largest_, moved);
    return true;
  }
  double largest() const { return largest_; }

 private:
  double most_;
  double largest_ = 0;
  std::unordered_map<std::uint32_t, double> around_;
};

bool collapse_needle(CollapseMesh& mesh, std::uint32_t edge, Moves& moves) {
  const std::uint32_t h = mesh.from_twin(edge);
  const std::uint32_t t = mesh.twin_edge(h);
  const Merge rule = merge_rule(mesh, h);
  Star star;
  if (rule == Merge::forbidden || !mesh.topology.can_collapse(h) ||
      !star.gather(mesh.topology, h) || !keeps_off_sides(mesh, star)) {
    return false;
  }
  // Onto the end that lies on more sides, or is bound more.
  const bool to_target = rule == Merge::onto_target || mesh.sides[star.v] > mesh.sides[star.u];
  const Vec3d r = mesh.r[to_target ? star.v : star.u];
  if (!keeps_directions(mesh, star, r)) return false;
  Star twin;
  if (t != HalfEdges::none && (!mesh.topology.can_collapse(t) || !twin.gather(mesh.topology, t) ||
                               !star.is_apart_from(twin) || !keeps_off_sides(mesh, twin) ||
                               !keeps_directions(mesh, twin, mesh.twin_place(h, r)))) {
    return false;
  }
  const Star& there = t != HalfEdges::none ? twin : star;
  if (!moves.go_on({star.u, star.v, there.u, there.v}, std::sqrt(mesh.squared_length(h)))) {
    return false;
  }
  mesh.collapse(h, r);
  mesh.live_vertices -= t != HalfEdges::none ? 2 : 1;
  renew_normals(mesh, star);
  if (t != HalfEdges::none) renew_normals(mesh, twin);
  return true;
}

bool flip_cap(CollapseMesh& mesh, std::uint32_t h, const Shape& shape, Moves& moves) {
  if (!mesh.topology.can_flip(h) || mesh.is_border(h)) return false;
  Star star;
  star.gather_flip(mesh.topology, h);
  if (!keeps_off_sides(mesh, star)) return false;
  const std::uint32_t f = HalfEdges::facet(h);
  const std::uint32_t g = HalfEdges::facet(mesh.topology.opposite(h));
  const Vec3d u = mesh.r[mesh.topology.origin(h)];
  const Vec3d v = mesh.r[mesh.topology.target(h)];
  const Vec3d a = mesh.r[mesh.topology.apex(h)];
  const Vec3d b = mesh.r[mesh.topology.apex(mesh.topology.opposite(h))];
  const Vec3d before = mesh.normals[f] + mesh.normals[g];
  if (!(dot(cross(a - b, u - b), before) > 0) || !(dot(cross(b - a, v - a), before) > 0)) {
    return false;
  }
  const HalfEdges& topology = mesh.topology;
  const double height = std::sqrt(shape.square / shape.longest_square);
  if (!moves.go_on({topology.origin(h), topology.target(h), topology.apex(h),
                    topology.apex(topology.opposite(h))},
                   height)) {
    return false;
  }
  mesh.topology.flip(h);
  mesh.normals[f] = mesh.normal_of(f);
  mesh.normals[g] = mesh.normal_of(g);
  return true;
}

/// As Shape::has_area(), for nearly all that have: by the length of only two edges, which the third
/// is no longer than.
bool surely_has_area(const CollapseMesh& mesh, std::uint32_t f) {
  const double sum = mesh.squared_length(3 * f) + mesh.squared_length(3 * f + 1);
  const double most = 2 * sum;
  const Vec3d n = mesh.normals[f];
  return dot(n, n) > 2 * without_area * without_area * most * most;
}

std::vector<std::uint32_t> facets_without_area(const CollapseMesh& mesh) {
  using Facets = std::vector<std::uint32_t>;
  constexpr std::size_t grain = 4096;
  const auto of_range = [&mesh](std::size_t begin, std::size_t end) {
    Facets facets;
    for (auto f = static_cast<std::uint32_t>(begin); f < end; ++f) {
      if (!mesh.topology.alive(f) || surely_has_area(mesh, f)) continue;
      if (!shape_of(mesh, f).has_area()) facets.push_back(f);
    }
    return facets;
  };
  return parallel_reduce(mesh.normals.size(), grain, Facets{}, of_range,
                         [](Facets all, const Facets& part) {
                           all.insert(all.end(), part.begin(), part.end());
                           return all;
                         });
}

}  // namespace

double remove_zero_area(CollapseMesh& mesh, double most) {
  Moves moves(most);
  // A facet may wait for its neighbour, so a few passes; each changed facet is better than before.
  for (int pass = 0; pass < 4; ++pass) {
    bool changed = false;
    for (const std::uint32_t f : facets_without_area(mesh)) {
      if (!mesh.topology.alive(f)) continue;
      const Shape shape = shape_of(mesh, f);
      if (shape.has_area()) continue;
      const bool needle = shape.shortest_square <= short_edge * short_edge * shape.longest_square;
      const bool done = needle ? collapse_needle(mesh, shape.shortest, moves)
                               : flip_cap(mesh, shape.longest, shape, moves);
      changed = changed || done;
    }
    if (!changed) break;
  }
  return moves.largest();
}

}  // namespace scarp

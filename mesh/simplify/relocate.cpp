#include "mesh/simplify/relocate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "mesh/simplify/blocks.h"
#include "mesh/simplify/facet_shape.h"

namespace scarp {

namespace {

/// Pull to where the vertex is, as part of the quadric's trace: where nothing says otherwise, a
/// vertex stays.
constexpr double faint = 1e-2;

/// Pull to the planes of the facets around, in points: where no point is near, the pull of shape
/// would draw a vertex off the surface.
constexpr double pull_of_planes = 0.3;

/// Pull to the middle of the neighbours, in shape weights.
constexpr double pull_of_shape = 120;

/// What is left of the sum of the squared distances after a move that is worth its cost.
constexpr double worth_a_move = 0.985;

bool may_move(const CollapseMesh& mesh, std::uint32_t v) {
  if (mesh.topology.outgoing(v) == HalfEdges::none) return false;
  // A pair is moved by the lower of the two.
  if (mesh.kind[v] == VertexKind::paired) return v < mesh.twin[v];
  return mesh.kind[v] == VertexKind::free && (!mesh.topology.on_boundary(v) || mesh.sides[v] != 0);
}

/// What the facets around a vertex say of where it should go, in its frame.
struct Around {
  Quadric distances;  ///< sum of the squared distances of the points when it moves by r
  Vec3d middle;       ///< the sum of three times the centres of the facets, by twice their area
  double twice_area = 0;

  /// A point moves with its facet, by the weight that the centre has where it lies.
  void add(const CollapseMesh& mesh, const Star& star, const TrackedPoints& points) {
    const Vec3d centre = mesh.r[star.u];
    for (int i = 0; i < star.count; ++i) {
      const Vec3d x = mesh.r[star.ring[i]] - centre;
      const Vec3d y = mesh.r[star.ring[i + 1]] - centre;
      const Vec3d n = mesh.normals[star.facet[i]];
      const double square = dot(n, n);
      const double twice_area_here = std::sqrt(square);
      twice_area += twice_area_here;
      middle += twice_area_here * (x + y);
      const double per_square = 1 / square;
      // The weight falls from 1 at the centre to 0 at the rim.
      const Vec3d fall = per_square * cross(x - y, n);
      // Sums over the points: of the squared weights, which the pull is one of,
      double weights = pull_of_planes / star.count;
      double moments = 0;  // of weight times height, in lengths of n,
      double heights = 0;  // and of the squared heights.
      points.for_each(star.facet[i], [&](Vec3d place) {
        const Vec3d p = place - centre;
        const double weight = std::clamp(1 + dot(fall, p), 0.0, 1.0);
        const double height = dot(n, p);
        weights += weight * weight;
        moments += weight * height;
        heights += height * height;
      });
      distances.H.add_outer(weights * per_square, n);
      distances.g += (moments * per_square) * n;
      distances.k += heights * per_square;
    }
  }
};

/// The lowest point of q + weight |r - centre|^2 that a vertex of these sides may go to from 0.
Vec3d minimum_within_sides(const Quadric& q, double weight, Vec3d centre, SideMask sides) {
  if (sides == 0) return minimum_on_plane(q, weight, centre, {}, 0);
  Subspace places;
  for (int axis = 0; axis < 2; ++axis) {
    if (fixes(sides, axis)) places.fix(axis, 0);
  }
  if (fixes_diagonal(sides)) places.intersect({1, -1, 0}, 0);
  return minimum(q, weight, centre, places);
}

/// How a vertex should be moved; `around` has its star, and that of its twin if it has one.
Vec3d best_shift(const CollapseMesh& mesh, std::span<const CollapseChecks> around,
                 const TrackedPoints& points, double shape_weight) {
  Around facets;
  double pull = 0;
  for (const CollapseChecks& checks : around) {
    const Star& star = checks.star();
    const double before = facets.twice_area;
    facets.add(mesh, star, points);
    const double twice_area = facets.twice_area - before;
    if (!(twice_area > 0)) return {};
    // Shapes grow with the square of the shift over that of an edge, about twice an area.
    pull += pull_of_shape * shape_weight * points.per_facet(star) * star.count / twice_area;
  }
  const Quadric& q = facets.distances;
  const Vec3d middle = facets.middle / (3 * facets.twice_area);
  pull /= static_cast<double>(around.size());
  const double weight = faint * q.H.trace() + pull;
  if (!(weight > 0)) return {};
  const Vec3d shift = minimum_within_sides(q, weight, (pull / weight) * middle,
                                           mesh.sides[around.front().star().u]);
  const auto sum = [&](Vec3d r) { return q.value(r) + pull * dot(r - middle, r - middle); };
  return sum(shift) < worth_a_move * sum({}) ? shift : Vec3d{};
}

/// What a sweep needs besides the mesh.
struct Sweep {
  TrackedPoints& points;
  double shape_weight;
  std::span<const Vec3d> reference;

  /// Moves the vertices of a block whose stars lie in it.
  void run(CollapseMesh& mesh, CollapseChecks& shared, const Blocks& blocks, std::uint32_t block,
           std::span<const std::uint32_t> vertices) const {
    std::array<CollapseChecks, 2> checks{shared.sharing(), shared.sharing()};
    for (const std::uint32_t v : vertices) {
      if (!may_move(mesh, v) || !checks[0].gather_vertex(mesh, v)) continue;
      if (!blocks.holds(block, checks[0].star())) continue;
      if (mesh.kind[v] != VertexKind::paired) {
        move(mesh, std::span(checks).first(1));
      } else if (checks[1].gather_vertex(mesh, mesh.twin[v]) &&
                 blocks.holds(block, checks[1].star()) &&
                 checks[0].star().is_apart_from(checks[1].star())) {
        move(mesh, checks);
      }
    }
  }

  void move(CollapseMesh& mesh, std::span<CollapseChecks> around) const {
    const Vec3d shift = best_shift(mesh, around, points, shape_weight);
    double growth = 0;
    for (CollapseChecks& checks : around) {
      const Star& star = checks.star();
      const Vec3d r = mesh.rounded(mesh.r[star.u] + shift, mesh.sides[star.u]);
      if (r == mesh.r[star.u] || !checks.may_move(mesh, r, reference)) return;
      growth +=
          points.growth(star, checks.fan(mesh)) +
          shape_weight * points.per_facet(star) * shape_growth(mesh, star, r, checks.normals());
    }
    if (!(growth < 0)) return;
    for (CollapseChecks& checks : around) {
      if (!checks.keeps_bound(mesh)) return;
    }
    for (CollapseChecks& checks : around) {
      const Star& star = checks.star();
      points.move(star, checks.fan(mesh));
      checks.accept_move();
      mesh.r[star.u] = checks.place();
      for (int i = 0; i < star.count; ++i) mesh.normals[star.facet[i]] = checks.normals()[i];
    }
  }
};

}  // namespace

void relocate(CollapseMesh& mesh, CollapseChecks& checks, TrackedPoints& points,
              double shape_weight, std::span<const Vec3d> reference, int pass) {
  const Sweep sweep{points, shape_weight, reference};
  const Blocks blocks(mesh, pass);
  VerticesByBlock(mesh, blocks)
      .for_each_block([&](std::uint32_t block, std::span<const std::uint32_t> vertices) {
        sweep.run(mesh, checks, blocks, block, vertices);
      });
}

}  // namespace scarp

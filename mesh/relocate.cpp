#include "mesh/relocate.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "mesh/blocks.h"
#include "mesh/facet_shape.h"

namespace scarp {

namespace {

/// Pull to where the vertex is, as part of the quadric's trace: where no point says otherwise, a
/// vertex stays.
constexpr double faint = 1e-2;

/// Pull to the middle of the neighbours, in shape weights.
constexpr double pull_of_shape = 120;

/// What is left of the sum of the squared distances after a move that is worth its cost.
constexpr double worth_a_move = 0.97;

bool may_move(const CollapseMesh& mesh, std::uint32_t v) {
  return mesh.topology.outgoing(v) != HalfEdges::none && mesh.kind[v] == VertexKind::free &&
         (!mesh.topology.on_boundary(v) || mesh.sides[v] != 0);
}

/// Sum of the squared distances of the points when the centre of a star moves by r, in the frame of
/// the centre. A point moves with its facet, by the weight that the centre has where it lies.
Quadric distances_of_points(const CollapseMesh& mesh, const Star& star,
                            const TrackedPoints& points) {
  Quadric q;
  const Vec3d centre = mesh.r[star.u];
  for (int i = 0; i < star.count; ++i) {
    const Vec3d x = mesh.r[star.ring[i]] - centre;
    const Vec3d y = mesh.r[star.ring[i + 1]] - centre;
    const Vec3d n = mesh.normals[star.facet[i]];
    const double square = dot(n, n);
    const Vec3d unit = normalized(n);
    points.for_each(star.facet[i], [&](Vec3d place) {
      const Vec3d p = place - centre;
      const double weight = std::clamp(dot(cross(x - p, y - p), n) / square, 0.0, 1.0);
      q.add_plane(1, weight * unit, dot(unit, p));
    });
  }
  return q;
}

Vec3d best_place(const CollapseMesh& mesh, const Star& star, const TrackedPoints& points,
                 double shape_weight) {
  const Quadric q = distances_of_points(mesh, star, points);
  Subspace places;
  for (int axis = 0; axis < 2; ++axis) {
    if (fixes(mesh.sides[star.u], axis)) places.fix(axis, 0);
  }
  // The centre of area, in the frame of the centre of the star.
  Vec3d middle;
  double twice_area = 0;
  for (int i = 0; i < star.count; ++i) {
    const double weight = length(mesh.normals[star.facet[i]]);
    middle += weight * (mesh.r[star.ring[i]] + mesh.r[star.ring[i + 1]] - 2.0 * mesh.r[star.u]);
    twice_area += weight;
  }
  if (!(twice_area > 0)) return mesh.r[star.u];
  middle = middle / (3 * twice_area);
  // Shapes grow with the square of the shift over that of an edge, which is about twice an area.
  const double pull =
      pull_of_shape * shape_weight * points.per_facet(star) * star.count / twice_area;
  const double weight = faint * q.H.trace() + pull;
  if (!(weight > 0)) return mesh.r[star.u];
  const Vec3d shift = minimum(q, weight, (pull / weight) * middle, places);
  const auto sum = [&](Vec3d r) { return q.value(r) + pull * dot(r - middle, r - middle); };
  return sum(shift) < worth_a_move * sum({}) ? mesh.rounded(mesh.r[star.u] + shift)
                                             : mesh.r[star.u];
}

/// What a sweep needs besides the mesh.
struct Sweep {
  TrackedPoints& points;
  double shape_weight;
  const std::vector<Vec3d>& reference;  ///< normals before the first move

  /// Moves the vertices of a block whose stars lie in it.
  void run(CollapseMesh& mesh, CollapseChecks checks, const Blocks& blocks,
           std::uint32_t block) const {
    for (const std::uint32_t v : blocks.vertices(block)) {
      if (!may_move(mesh, v) || !checks.gather_vertex(mesh, v)) continue;
      if (blocks.holds(block, checks.star())) move(mesh, checks);
    }
  }

  void move(CollapseMesh& mesh, CollapseChecks& checks) const {
    const Star& star = checks.star();
    const Vec3d r = best_place(mesh, star, points, shape_weight);
    if (r == mesh.r[star.u] || !checks.may_move(mesh, r, reference)) return;
    const Fan& fan = checks.fan(mesh);
    const double growth =
        points.growth(star, fan) +
        shape_weight * points.per_facet(star) * shape_growth(mesh, star, r, checks.normals());
    if (!(growth < 0) || !checks.keeps_bound(mesh)) return;
    points.move(star, fan);
    checks.accept_move();
    mesh.r[star.u] = r;
    for (int i = 0; i < star.count; ++i) mesh.normals[star.facet[i]] = checks.normals()[i];
  }
};

}  // namespace

void relocate(CollapseMesh& mesh, CollapseChecks& checks, TrackedPoints& points,
              double shape_weight, int sweeps) {
  const std::vector<Vec3d> reference = mesh.normals;
  const Sweep sweep{points, shape_weight, reference};
  for (int pass = 0; pass < sweeps; ++pass) {
    const Blocks blocks(mesh, pass);
    parallel_for(blocks.count(), 1, [&](std::size_t begin, std::size_t end) {
      for (auto block = static_cast<std::uint32_t>(begin); block < end; ++block) {
        sweep.run(mesh, checks.sharing(), blocks, block);
      }
    });
  }
}

}  // namespace scarp

#include "mesh/simplify/flip_edges.h"

#include <cstdint>
#include <vector>

#include "mesh/simplify/blocks.h"
#include "mesh/simplify/facet_shape.h"

namespace scarp {

namespace {

/// How much the shapes of the two facets of an edge grow; `star` and `normals` are those of the
/// flipped edge.
double shape_growth_of_flip(const CollapseMesh& mesh, const Star& star,
                            std::span<const Vec3d> normals) {
  const Vec3d a = mesh.r[star.u];
  const Vec3d u = mesh.r[star.ring[0]];
  const Vec3d b = mesh.r[star.ring[1]];
  const Vec3d v = mesh.r[star.ring[2]];
  return facet_shape(a, u, b, normals[0]) + facet_shape(a, b, v, normals[1]) -
         facet_shape(u, v, a, mesh.normals[star.facet[0]]) -
         facet_shape(v, u, b, mesh.normals[star.facet[1]]);
}

/// What a pass needs besides the mesh.
struct Pass {
  TrackedPoints& points;
  const EdgeSizes& sizes;
  double shape_weight;
  std::span<const Vec3d> reference;
  const Blocks& blocks;

  /// Flips edges whose facets lie in the block.
  void run(CollapseMesh& mesh, CollapseChecks& shared, std::uint32_t block,
           std::span<const std::uint32_t> vertices) const {
    const HalfEdges& topology = mesh.topology;
    CollapseChecks checks = shared.sharing();
    std::vector<std::uint32_t> edges;
    for (const std::uint32_t v : vertices) {
      edges.clear();
      topology.for_each_outgoing(v, [&](std::uint32_t h) { edges.push_back(h); });
      for (const std::uint32_t h : edges) {
        // A flip before may have turned it; an edge is looked at from the lower end.
        const bool is_edge = topology.origin(h) == v && v < topology.target(h);
        if (is_edge && topology.opposite(h) != HalfEdges::none && is_inside(mesh, block, h)) {
          flip(mesh, checks, h);
        }
      }
    }
  }

  bool is_inside(const CollapseMesh& mesh, std::uint32_t block, std::uint32_t h) const {
    const HalfEdges& topology = mesh.topology;
    return blocks.holds(block, topology.target(h)) && blocks.holds(block, topology.apex(h)) &&
           blocks.holds(block, topology.apex(topology.opposite(h)));
  }

  void flip(CollapseMesh& mesh, CollapseChecks& checks, std::uint32_t h) const {
    checks.gather_flip(mesh, h);
    const Star& star = checks.star();
    const double shapes =
        shape_weight * points.per_facet(star) * shape_growth_of_flip(mesh, star, checks.normals());
    // The distances cannot fall by more than they are.
    if (shapes >= points.sum_of_squares(star)) return;
    if (mesh.is_border(h) || !sizes.allows_flip(mesh, star)) return;
    if (!(shapes + points.growth(star, checks.fan(mesh)) < 0)) return;
    if (!checks.may_flip(mesh, h, reference)) return;
    if (!mesh.topology.can_flip(h) || !keeps_off_sides(mesh, star)) return;
    if (!checks.keeps_bound_of_flip(mesh)) return;
    points.move(star, checks.fan(mesh));
    checks.accept_move();
    mesh.topology.flip(h);
    for (int i = 0; i < star.count; ++i) mesh.normals[star.facet[i]] = checks.normals()[i];
  }
};

}  // namespace

void flip_edges(CollapseMesh& mesh, CollapseChecks& checks, TrackedPoints& points,
                const EdgeSizes& sizes, double shape_weight, std::span<const Vec3d> reference,
                int pass) {
  const Blocks blocks(mesh, pass);
  const Pass flips{points, sizes, shape_weight, reference, blocks};
  VerticesByBlock(mesh, blocks)
      .for_each_block([&](std::uint32_t block, std::span<const std::uint32_t> vertices) {
        flips.run(mesh, checks, block, vertices);
      });
}

}  // namespace scarp

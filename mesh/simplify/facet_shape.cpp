#include "mesh/simplify/facet_shape.h"

namespace scarp {

double shape_growth(const CollapseMesh& mesh, const Star& star, Vec3d r,
                    std::span<const Vec3d> normals) {
  const HalfEdges& topology = mesh.topology;
  double sum = 0;
  for (int i = 0; i < star.count; ++i) {
    const Vec3d x = mesh.r[star.ring[i]];
    const Vec3d y = mesh.r[star.ring[i + 1]];
    const Vec3d old_r = mesh.r[star.at_target[i] ? star.v : star.u];
    sum += facet_shape(r, x, y, normals[i]);
    sum -= facet_shape(old_r, x, y, mesh.normals[star.facet[i]]);
  }
  for (const std::uint32_t f : star.dying) {
    if (f == HalfEdges::none) continue;
    sum -= facet_shape(mesh.r[topology.origin(3 * f)], mesh.r[topology.origin(3 * f + 1)],
                       mesh.r[topology.origin(3 * f + 2)], mesh.normals[f]);
  }
  return sum;
}

}  // namespace scarp

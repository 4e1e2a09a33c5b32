#include "levelset/resample.h"

#include <algorithm>

#include "core/triangle_tree.h"
#include "levelset/extract_surface.h"

namespace scarp {

namespace {

// A mirror image is never nearer than what it mirrors, a copy beyond a periodic side may be.
double distance_to(const TriangleTree& surface, const Sides& sides, Vec3d r) {
  double nearest = surface.closest(r).distance;
  for (int axis = 0; axis < 2; ++axis) {
    if (sides.boundary[axis] != Boundary::periodic) continue;
    Vec3d copy = r;
    copy[axis] += r[axis] < 0 ? sides.width(axis) : -sides.width(axis);
    nearest = std::min(nearest, surface.closest(copy, nearest).distance);
  }
  return nearest;
}

LevelSet resampled(const LevelSet& phi, const Frame& frame) {
  const TriMesh surface = extract_surface(phi);
  const TriangleTree tree(surface);
  const Sides sides = phi.frame().sides();
  const auto distance = [&](Vec3d r) {
    // Nothing varies along y there, and the width of a cell changes.
    if (frame.two_dimensional) r.y = 0;
    const double nearest = distance_to(tree, sides, r);
    return phi.distance(r) < 0 ? -nearest : nearest;
  };
  const Box box = bounding_box(surface);
  const double margin = (LevelSet::half_width + 1) * frame.spacing;
  return {frame, distance, box.lower.z - margin, box.upper.z + margin};
}

}  // namespace

Layers resampled(const Layers& layers, const Frame& frame) {
  Layers result{.frame = frame, .stack = {}};
  for (const Layer& layer : layers.stack)
    result.stack.push_back({layer.material, resampled(layer.phi, frame)});
  for (std::size_t k = result.stack.size(); k-- > 1;)
    cut(result.stack[k - 1].phi, result.stack[k].phi);
  return result;
}

}  // namespace scarp

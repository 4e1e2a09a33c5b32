#include "levelset/surface/resample.h"

#include <algorithm>
#include <cmath>

#include "core/triangle_tree.h"
#include "levelset/surface/extract_surface.h"

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

/// Where a point of the new grid lies on the old one: of a section, the width of a cell of y
/// changes, and what lies around an axis is that of its radius.
Vec3d place_on(const Frame& old, Vec3d r, const Frame& frame) {
  if (old.lateral_axes() >= frame.lateral_axes()) return old.in_section(r);
  return {std::min(std::hypot(r.x, r.y), old.sides().upper[0]), 0, r.z};
}

LevelSet resampled(const LevelSet& phi, const Frame& frame) {
  const TriMesh surface = extract_surface(phi);
  const TriangleTree tree(surface);
  const Sides sides = phi.frame().sides();
  const auto distance = [&](Vec3d r) {
    r = place_on(phi.frame(), r, frame);
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

Frame revolved(const Frame& section, int most_cells) {
  Frame frame = section;
  frame.cells[0] = std::min(section.cells[0], most_cells);
  frame.spacing *= static_cast<double>(section.cells[0]) / frame.cells[0];
  return frame.revolved();
}

Layers revolved(const Layers& section, int most_cells) {
  return resampled(section, revolved(section.frame, most_cells));
}

}  // namespace scarp

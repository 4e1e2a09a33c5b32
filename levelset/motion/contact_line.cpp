#include "levelset/motion/contact_line.h"

#include <algorithm>
#include <cmath>

#include "levelset/grid/exposure.h"

namespace scarp {

namespace {

/// A wall whose speed is less than this part of the film's stays where it is.
constexpr float slow = 0.1F;

/// Cosine between the normals from which on a film lies on the wall rather than against it.
constexpr double along_wall = 0.95;

}  // namespace

std::optional<float> speed_at_contact_line(
    const Layers& layers, const Node& node, std::size_t film, Vec3d normal,
    const std::function<float(std::size_t layer, Vec3d normal)>& speed) {
  if (film == 0) return std::nullopt;
  const float free = speed(film, normal);
  if (!(free > 0)) return std::nullopt;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int step : {-1, 1}) {
      Node beside = node;
      beside[axis] += step;
      if (!(layers.top().node(beside[0], beside[1], beside[2]) < 0)) continue;
      const std::size_t wall = layer_at(layers, beside);
      if (wall >= film || layers.stack[wall].material == layers.stack[film].material) continue;
      const Vec3d out_of_wall = layers.stack[wall].phi.normal(layers.frame.node_position(node));
      if (std::abs(speed(wall, out_of_wall)) > slow * free) continue;
      const double away = dot(normal, out_of_wall);
      if (away <= 0 || away > along_wall) continue;
      return std::clamp(speed(film, normalized(normal - away * out_of_wall)), 0.0F, free);
    }
  }
  return std::nullopt;
}

}  // namespace scarp

#include "levelset/contact_line.h"

#include <algorithm>
#include <cmath>

#include "levelset/exposure.h"
#include "levelset/stencil.h"

namespace scarp {

namespace {

/// A wall whose speed is less than this part of the film's stays where it is.
constexpr float slow = 0.1F;

/// Cosine between the normals from which on a film lies on the wall rather than against it.
constexpr double along_wall = 0.95;

/// Below this slope phi of a wall has no direction.
constexpr double least_gradient = 0.5;

Vec3d gradient_of(const Layer& layer, const Node& node) {
  Vec3d gradient;
  for (int axis = 0; axis < 3; ++axis) {
    Node before = node;
    Node behind = node;
    --before[axis];
    ++behind[axis];
    gradient[axis] = 0.5 * (static_cast<double>(layer.phi.node(behind[0], behind[1], behind[2])) -
                            layer.phi.node(before[0], before[1], before[2]));
  }
  return gradient;
}

}  // namespace

std::optional<float> speed_at_contact_line(
    const Layers& layers, const Node& node, const float* phi, std::size_t film, Vec3d normal,
    const std::function<float(std::size_t layer, Vec3d normal)>& speed) {
  const float free = speed(film, normal);
  if (!(free > 0)) return std::nullopt;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int step : {-1, 1}) {
      if (!(phi[step * axis_strides[axis]] < 0)) continue;
      Node beside = node;
      beside[axis] += step;
      const std::size_t wall = layer_at(layers, beside);
      if (wall >= film || layers.stack[wall].material == layers.stack[film].material) continue;
      const Vec3d gradient = gradient_of(layers.stack[wall], node);
      if (length(gradient) < least_gradient) continue;
      const Vec3d out_of_wall = normalized(gradient);
      if (std::abs(speed(wall, out_of_wall)) > slow * free) continue;
      const double away = dot(normal, out_of_wall);
      if (away <= 0 || away > along_wall) continue;
      return std::clamp(speed(film, normalized(normal - away * out_of_wall)), 0.0F, free);
    }
  }
  return std::nullopt;
}

}  // namespace scarp

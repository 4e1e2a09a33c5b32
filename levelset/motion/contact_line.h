#pragma once

#include <cstddef>
#include <functional>
#include <optional>

#include "core/vec3.h"
#include "levelset/grid/band.h"
#include "levelset/grid/layers.h"

namespace scarp {

/// The speed of a film next to the line where it meets a wall that stays where it is, if it grows
/// there and falls away from the wall; nothing elsewhere.
///
/// What such a film does comes from the line: there begins the fan of all slopes from that along
/// the wall's normal on. So the line climbs at the speed that the film has with a surface straight
/// away from the wall, and stays where it is if ions would take that off; with the speed of the
/// film's own slope it would climb all walls, each at a rate that depends on where the wall lies
/// between nodes.
///
/// Shape: film is the layer that is seen at the node, normal that of the film. A wall is a layer
///        below it, of another material, whose speed is less than a tenth of the film's.
/// Units: speeds of a layer by normal and the result in nm/s.
/// Error: of first order; the line stays within two spacings of where it belongs.
std::optional<float> speed_at_contact_line(
    const Layers& layers, const Node& node, std::size_t film, Vec3d normal,
    const std::function<float(std::size_t layer, Vec3d normal)>& speed);

}  // namespace scarp

#pragma once

#include <functional>
#include <vector>

#include "core/material.h"
#include "core/vec3.h"
#include "levelset/layers.h"

namespace scarp {

/// Speeds along the outward normal at the nodes of the top layer's band, > 0 grows.
///
/// Valid until the layers change. Shape: 512 values per leaf of the band. Units: nm/s.
struct SpeedField {
  std::vector<float> speed;
  float max_speed = 0;  ///< largest magnitude at nodes next to the surface
};

/// Speeds given as a function of position and exposed material, at every node of the band.
///
/// What stays unset otherwise (closed voids) moves too. The function is called from several
/// threads.
SpeedField prescribe_speeds(const Layers& layers,
                            const std::function<double(Vec3d r, MaterialId material)>& speed);

/// Sets max_speed from the speeds at nodes with |phi| < 1.
void update_max_speed(const Layers& layers, SpeedField& field);

}  // namespace scarp

#pragma once

#include "core/angular_factor.h"
#include "core/vec3.h"

namespace scarp {

/// Of the planes of a crystal through a line on a level surface the one that goes aside most
/// slowly, seen in that surface; from the one that is nearly the surface itself to the one that is
/// upright.
///
/// aside and up are orthogonal unit vectors across the line. The normals lie between them.
Vec3d slowest_plane(const CrystalRates& crystal, const Vec3d& aside, const Vec3d& up);

}  // namespace scarp

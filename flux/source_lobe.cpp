#include "flux/source_lobe.h"

#include <cmath>

namespace scarp {

Vec3d sample_lobe(const SourceLobe& lobe, UnitSquare xi, RandomStream& random) {
  Vec3d u = sample_source(xi, lobe.cosine_power);
  Vec3d axis = lobe.direction;
  if (lobe.rotating) {
    const double tilt = std::sqrt(axis.x * axis.x + axis.y * axis.y);
    const auto [sine, cosine] = sample_azimuth(random.uniform_double());
    axis = {tilt * cosine, tilt * sine, axis.z};
  }
  if (axis.x == 0 && axis.y == 0) return u;
  constexpr double horizon = -1e-6;
  while ((u = about_axis(u.x, u.y, -u.z, axis)).z > horizon) {
    const double xi1 = random.uniform_double();
    u = sample_source({xi1, random.uniform_double()}, lobe.cosine_power);
  }
  return normalized(u);
}

}  // namespace scarp

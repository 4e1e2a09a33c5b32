#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/random.h"
#include "flux/rays/nearest_facet.h"

namespace scarp {

/// Of the cube that random facets and rays are in.
constexpr double side = 40;

inline double random_between(RandomStream& random, double a, double b) {
  return a + (b - a) * random.uniform();
}

inline Vec3d random_place(RandomStream& random) {
  const auto number = [&] { return random_between(random, 0, side); };
  return {number(), number(), number()};
}

inline Vec3d random_direction(RandomStream& random) {
  const auto number = [&] { return random_between(random, -1, 1); };
  return normalized(Vec3d{number(), number(), number()});
}

inline SceneFacet facet_of(Vec3d a, Vec3d b, Vec3d c) {
  const std::array<Vec3f, 3> corners{Vec3f(a), Vec3f(b), Vec3f(c)};
  const Vec3d n =
      cross(Vec3d(corners[1]) - Vec3d(corners[0]), Vec3d(corners[2]) - Vec3d(corners[0]));
  return {corners, length(n) > 0 ? normalized(n) : Vec3d{0, 0, 1}};
}

/// In a cube. Small and large ones; slivers as thin as single precision has them; facets twice, and
/// closer together than rounding; neighbours with a common edge.
inline std::vector<SceneFacet> random_facets(int count, RandomStream& random) {
  std::vector<SceneFacet> facets;
  for (int f = 0; f < count; ++f) {
    const Vec3d a = random_place(random);
    const double size = f % 10 == 0 ? 1 : 0.1;
    const Vec3d b = a + size * (random_place(random) - a);
    const Vec3d c = f % 3 == 0 ? 0.5 * (a + b) + 1e-6 * random_direction(random)
                               : a + size * (random_place(random) - a);
    facets.push_back(facet_of(a, b, c));
    if (f % 4 == 0) facets.push_back(facet_of(b, a, a + size * (random_place(random) - a)));
    if (f % 5 == 0) facets.push_back(facets.back());
    if (f % 7 == 0) {
      const Vec3d away = 1e-6 * random_direction(random);
      facets.push_back(facet_of(a + away, b, c + away));
    }
  }
  return facets;
}

/// Also along axes, and straight at corners, edges and along the planes of facets.
inline Ray random_ray(const std::vector<SceneFacet>& facets, int kind, RandomStream& random) {
  const auto from = static_cast<std::uint32_t>(random.bits() % facets.size());
  const auto& [a, b, c] = facets[random.bits() % facets.size()].corners;
  Ray ray{.r = random_place(random), .u = random_direction(random), .from = from};
  const Vec3d edge = Vec3d(b) - Vec3d(a);
  if (kind == 1) ray.u = {0, 0, -1};
  if (kind == 2) ray.u = normalized(Vec3d(a) - ray.r);
  if (kind == 3) ray.u = normalized(Vec3d(a) + random.uniform() * edge - ray.r);
  if (kind == 4) {
    ray.r = Vec3d(c) + random_between(random, 0.5, 5) * normalized(Vec3d(c) - Vec3d(a));
    ray.u = normalized(Vec3d(a) + random.uniform() * edge - ray.r);
  }
  return ray;
}

}  // namespace scarp

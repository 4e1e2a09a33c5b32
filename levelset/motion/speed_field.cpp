#include "levelset/motion/speed_field.h"

#include <algorithm>
#include <cmath>

namespace scarp {

float speed_along(const SpeedField& field, std::size_t node, const Vec3f& normal) {
  float speed = field.speed[node];
  for (const AngularSpeed& part : field.angular)
    speed += part.amplitude[node] * part.factor.value(normal);
  return speed;
}

float fastest_etch(float speed) {
  if (!(speed < 0)) return 0;
  constexpr float steps = 1024;
  int exponent = 0;
  const float mantissa = std::frexp(-speed, &exponent);
  return std::ldexp(std::ceil(mantissa * steps) / steps, exponent);
}

bool etches_crystal(const SpeedField& field) {
  return std::ranges::any_of(field.angular, [](const AngularSpeed& part) {
    return part.factor.has_cusps() &&
           std::ranges::any_of(part.amplitude, [](float size) { return size < 0; });
  });
}

}  // namespace scarp

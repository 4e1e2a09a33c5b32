#include "levelset/godunov.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace scarp {

namespace {

/// Differences along an axis that differ by less than this count as equal.
constexpr float flat = 1e-4F;

/// The given part of the way between two slopes, the same bits from either end.
float between(float least, float most, float part) { return (1 - part) * least + part * most; }

/// Components of grad phi along an axis at which a value is looked for.
struct Places {
  std::array<float, 5 + 2 * CrystalRates::most_creases> at{};
  std::size_t count = 0;

  void add(float place) { at[count++] = place; }
};

/// p has the components along the axes before this one; those along the ones after it are looked
/// for later, so cusps are taken where they have either end.
Places places(const SpeedField& field, const std::array<Vec3f, 2>& p, int axis, float least,
              float most) {
  Places found;
  if (most - least < flat) {
    found.add(between(least, most, 0.5F));
    return found;
  }
  for (const float part : {0.0F, 0.25F, 0.5F, 0.75F, 1.0F}) found.add(between(least, most, part));
  for (const AngularSpeed& part : field.angular) {
    const CrystalRates* crystal = part.factor.crystal();
    if (crystal == nullptr) continue;
    for (const Vec3f& end : p) {
      const CrystalRates::Creases creases = crystal->creases(end, axis);
      for (std::size_t n = 0; n < creases.count; ++n) {
        const float place = creases.at[n];
        if (place > least && place < most && found.count < found.at.size()) found.add(place);
      }
    }
  }
  return found;
}

float value(const SpeedField& field, std::size_t node, Vec3f p) {
  float sum = field.speed[node] * length(p);
  for (const AngularSpeed& part : field.angular)
    if (part.amplitude[node] != 0) sum += part.amplitude[node] * part.factor.rate(p).value;
  return sum;
}

}  // namespace

float godunov_rate(const SpeedField& field, std::size_t node, Vec3f backward, Vec3f forward) {
  // The extremum over x of that over y of that over z.
  const auto extremum = [&](const auto& self, Vec3f p, int axis) -> float {
    if (axis == 3) return value(field, node, p);
    const float before = backward[axis];
    const float behind = forward[axis];
    std::array<Vec3f, 2> ends{p, p};
    for (int later = axis + 1; later < 3; ++later) {
      ends[0][later] = backward[later];
      ends[1][later] = forward[later];
    }
    const Places all =
        places(field, ends, axis, std::min(before, behind), std::max(before, behind));
    float best = 0;
    for (std::size_t n = 0; n < all.count; ++n) {
      p[axis] = all.at[n];
      const float there = self(self, p, axis + 1);
      const bool is_better = before < behind ? there < best : there > best;
      if (n == 0 || is_better) best = there;
    }
    return best;
  };
  return extremum(extremum, {}, 0);
}

}  // namespace scarp

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
  std::array<float, 5 + 4 * CrystalRates::most_creases> at{};
  std::size_t count = 0;

  void add(float place) { at[count++] = place; }
};

/// The ends between which grad phi lies along each axis.
struct Box {
  Vec3f backward;
  Vec3f forward;

  float least(int axis) const { return std::min(backward[axis], forward[axis]); }
  float most(int axis) const { return std::max(backward[axis], forward[axis]); }
  bool is_flat(int axis) const { return most(axis) - least(axis) < flat; }
};

/// Adds where cusps are along an axis. p has the components along the axes before that one; those
/// along the ones after it, from later on, are looked for afterwards: cusps are taken where they
/// have either end.
void add_cusps(const CrystalRates& crystal, const Box& box, Vec3f p, int axis, int later,
               Places& found) {
  if (later < 3) {
    const bool is_flat = box.is_flat(later);
    for (const float part : {is_flat ? 0.5F : 0.0F, 1.0F}) {
      p[later] = between(box.least(later), box.most(later), part);
      add_cusps(crystal, box, p, axis, later + 1, found);
      if (is_flat) return;
    }
    return;
  }
  const CrystalRates::Creases creases = crystal.creases(p, axis);
  for (std::size_t n = 0; n < creases.count; ++n) {
    const float place = creases.at[n];
    if (place > box.least(axis) && place < box.most(axis) && found.count < found.at.size())
      found.add(place);
  }
}

Places places(const SpeedField& field, const Box& box, Vec3f p, int axis) {
  Places found;
  const float least = box.least(axis);
  const float most = box.most(axis);
  if (box.is_flat(axis)) {
    found.add(between(least, most, 0.5F));
    return found;
  }
  for (const float part : {0.0F, 0.25F, 0.5F, 0.75F, 1.0F}) found.add(between(least, most, part));
  for (const AngularSpeed& part : field.angular) {
    const CrystalRates* crystal = part.factor.crystal();
    if (crystal != nullptr) add_cusps(*crystal, box, p, axis, axis + 1, found);
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
  const Box box{backward, forward};
  // The extremum over x of that over y of that over z.
  const auto extremum = [&](const auto& self, Vec3f p, int axis) -> float {
    if (axis == 3) return value(field, node, p);
    const bool is_least = backward[axis] < forward[axis];
    const Places all = places(field, box, p, axis);
    float best = 0;
    for (std::size_t n = 0; n < all.count; ++n) {
      p[axis] = all.at[n];
      const float there = self(self, p, axis + 1);
      if (n == 0 || (is_least ? there < best : there > best)) best = there;
    }
    return best;
  };
  return extremum(extremum, {}, 0);
}

}  // namespace scarp

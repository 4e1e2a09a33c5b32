#include "levelset/motion/godunov.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace scarp {

namespace {

/// Differences along an axis that differ by less than this count as equal.
constexpr float flat = 1e-4F;

/// Between ends closer than this only the ends and cusps are looked at: what bends in between is
/// less than a thousandth of the rate.
constexpr float narrow = 0.05F;

/// The given part of the way between two slopes, the same bits from either end.
float between(float least, float most, float part) { return (1 - part) * least + part * most; }

/// Components of grad phi along an axis at which a value is looked for.
struct Places {
  std::array<float, 5 + 4 * CrystalRates::most_creases> at{};
  std::size_t count = 0;

  void add(float place) { at[count++] = place; }
};

/// Axes, the outermost first.
using Order = std::array<int, 3>;

/// The ends between which grad phi lies along each axis.
struct Box {
  Vec3f backward;
  Vec3f forward;

  float least(int axis) const { return std::min(backward[axis], forward[axis]); }
  float most(int axis) const { return std::max(backward[axis], forward[axis]); }
  bool is_flat(int axis) const { return most(axis) - least(axis) < flat; }
  bool takes_least(int axis) const { return backward[axis] < forward[axis]; }
};

/// Adds where cusps are along an axis. p has the components along the axes before that one in the
/// order; those along the ones after it, from later on, are looked for afterwards: cusps are taken
/// where they have either end.
void add_cusps(const CrystalRates& crystal, const Box& box, const Order& order, Vec3f p,
               std::size_t place, std::size_t later, Places& found) {
  if (later < order.size()) {
    const int next = order[later];
    const bool is_flat = box.is_flat(next);
    for (const float part : {is_flat ? 0.5F : 0.0F, 1.0F}) {
      p[next] = between(box.least(next), box.most(next), part);
      add_cusps(crystal, box, order, p, place, later + 1, found);
      if (is_flat) return;
    }
    return;
  }
  const int axis = order[place];
  const CrystalRates::Creases creases = crystal.creases(p, axis);
  for (std::size_t n = 0; n < creases.count; ++n) {
    const float at = creases.at[n];
    if (at > box.least(axis) && at < box.most(axis) && found.count < found.at.size()) found.add(at);
  }
}

Places places(const SpeedField& field, const Box& box, const Order& order, const Vec3f& p,
              std::size_t place) {
  Places found;
  const int axis = order[place];
  const float least = box.least(axis);
  const float most = box.most(axis);
  if (box.is_flat(axis)) {
    found.add(between(least, most, 0.5F));
    return found;
  }
  for (const float end : {least, most}) found.add(end);
  if (most - least > narrow)
    for (const float part : {0.25F, 0.5F, 0.75F}) found.add(between(least, most, part));
  for (const AngularSpeed& part : field.angular) {
    const CrystalRates* crystal = part.factor.crystal();
    if (crystal != nullptr) add_cusps(*crystal, box, order, p, place, place + 1, found);
  }
  return found;
}

float value(const SpeedField& field, std::size_t node, Vec3f p) {
  float sum = field.speed[node] * length(p);
  for (const AngularSpeed& part : field.angular)
    if (part.amplitude[node] != 0) sum += part.amplitude[node] * part.factor.rate(p).value;
  return sum;
}

/// The extremum along the first axis of that along the second of that along the third.
float extremum(const SpeedField& field, std::size_t node, const Box& box, const Order& order,
               Vec3f p = {}, std::size_t place = 0) {
  if (place == order.size()) return value(field, node, p);
  const int axis = order[place];
  const Places all = places(field, box, order, p, place);
  float best = 0;
  for (std::size_t n = 0; n < all.count; ++n) {
    p[axis] = all.at[n];
    const float there = extremum(field, node, box, order, p, place + 1);
    if (n == 0 || (box.takes_least(axis) ? there < best : there > best)) best = there;
  }
  return best;
}

}  // namespace

float godunov_rate(const SpeedField& field, std::size_t node, Vec3f backward, Vec3f forward) {
  const Box box{backward, forward};
  const float rate = extremum(field, node, box, {0, 1, 2});
  if (box.is_flat(0) || box.is_flat(1)) return rate;
  const float other = extremum(field, node, box, {1, 0, 2});
  if (box.takes_least(0) != box.takes_least(1)) return 0.5F * (rate + other);
  return box.takes_least(0) ? std::min(rate, other) : std::max(rate, other);
}

}  // namespace scarp

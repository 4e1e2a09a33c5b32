#include "levelset/motion/lax_friedrichs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "core/parallel.h"
#include "core/vector_kernel.h"
#include "levelset/grid/band.h"
#include "levelset/grid/differences.h"
#include "levelset/grid/exposure.h"
#include "levelset/grid/stencil.h"
#include "levelset/motion/godunov.h"
#include "levelset/motion/hamiltonian.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 16;

/// Differences along an axis that differ by less than this, in the whole row, count as equal.
constexpr float flat = 1e-4F;

/// The given part of the way from one slope to another: 0, 1/2 or 1, which in this form are
/// symmetric to the last bit.
SCARP_KERNEL_PART float on_the_way(float from, float to, float part) {
  return (1 - part) * from + part * to;
}

SCARP_KERNEL_PART RowValues on_the_way(const RowValues& from, const RowValues& to, float part) {
  RowValues between;
  for (int k = 0; k < leaf_edge; ++k) between[k] = on_the_way(from[k], to[k], part);
  return between;
}

/// grad phi at the nodes of a row, as seen from the two sides along each axis.
struct Gradients {
  RowVectors backward;
  RowVectors forward;
};

/// The given part of the way from backward to forward, by axis.
SCARP_VECTOR_KERNEL RowVectors at(const Gradients& box, const std::array<float, 3>& part) {
  return {on_the_way(box.backward[0], box.forward[0], part[0]),
          on_the_way(box.backward[1], box.forward[1], part[1]),
          on_the_way(box.backward[2], box.forward[2], part[2])};
}

RowVectors middle_of(const Gradients& box) { return at(box, {0.5F, 0.5F, 0.5F}); }

SCARP_VECTOR_KERNEL bool is_flat(const RowValues& backward, const RowValues& forward) {
  int wide = 0;
  for (int k = 0; k < leaf_edge; ++k) wide |= std::abs(forward[k] - backward[k]) > flat ? 1 : 0;
  return wide == 0;
}

/// The parts of the way along an axis at which a row is asked: the two ends, or the middle alone if
/// they are the same.
std::span<const float> parts(const Gradients& box, int axis) {
  static constexpr std::array<float, 3> places{0, 1, 0.5F};
  const bool same = is_flat(box.backward[axis], box.forward[axis]);
  return std::span(places).subspan(same ? 2 : 0, same ? 1 : 2);
}

template <Scheme scheme>
SCARP_KERNEL_PART Gradients gradients_of(const float* row) {
  Gradients gradients;
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < leaf_edge; ++k) {
      const OneSided slopes = one_sided<scheme>(row + k, axis_strides[axis]);
      gradients.backward[axis][k] = slopes.backward;
      gradients.forward[axis][k] = slopes.forward;
    }
  }
  return gradients;
}

SCARP_VECTOR_KERNEL Gradients first_order_gradients(const float* row) {
  return gradients_of<Scheme::first_order>(row);
}

/// FreeLeaf at a row.
struct FreeRow {
  const float* phi = nullptr;
  const float* most = nullptr;
};

/// The same with phi of free where that is a number.
Gradients free_gradients(const float* row, const float* free) {
  const auto phi = [&](std::ptrdiff_t at) { return std::isnan(free[at]) ? row[at] : free[at]; };
  Gradients gradients;
  for (int axis = 0; axis < 3; ++axis) {
    const std::ptrdiff_t stride = axis_strides[axis];
    for (int k = 0; k < leaf_edge; ++k) {
      gradients.backward[axis][k] = phi(k) - phi(k - stride);
      gradients.forward[axis][k] = phi(k + stride) - phi(k);
    }
  }
  return gradients;
}

/// By WENO5, but the near ones where something within reach does not move.
SCARP_VECTOR_KERNEL Gradients weno5_gradients(const float* row, const float* mobility,
                                              const Gradients& near) {
  Gradients gradients = gradients_of<Scheme::weno5>(row);
  std::array<int, leaf_edge> near_still{};
  for (const std::ptrdiff_t stride : axis_strides) {
    for (int n = -Block::halo; n <= Block::halo; ++n) {
      for (int k = 0; k < leaf_edge; ++k) near_still[k] |= mobility[n * stride + k] == 0 ? 1 : 0;
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < leaf_edge; ++k) {
      float& backward = gradients.backward[axis][k];
      float& forward = gradients.forward[axis][k];
      backward = select(near_still[k] != 0, near.backward[axis][k], backward);
      forward = select(near_still[k] != 0, near.forward[axis][k], forward);
    }
  }
  return gradients;
}

/// Slopes below this are those of a film that goes along a wall, others of one that leans against
/// it.
constexpr float leaning = 0.5F;

/// Differences to what does not move are those on the other side, or nothing for a film that goes
/// along it: with its own slope every small lead or lag at the wall would grow.
void see_past_standing(const float* mobility, Gradients& gradients) {
  for (int k = 0; k < leaf_edge; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::ptrdiff_t stride = axis_strides[axis];
      const bool stands_before = mobility[k - stride] == 0;
      const bool stands_behind = mobility[k + stride] == 0;
      float& backward = gradients.backward[axis][k];
      float& forward = gradients.forward[axis][k];
      const auto past = [](float other) { return std::abs(other) < leaning ? 0.0F : other; };
      if (stands_before && stands_behind) {
        backward = forward = 0;
      } else if (stands_before) {
        backward = past(forward);
      } else if (stands_behind) {
        forward = past(backward);
      }
    }
  }
}

/// The derivatives of V |grad phi| that are met at the nodes of a row.
struct SlopeRange {
  RowVectors least;
  RowVectors most;
};

SCARP_VECTOR_KERNEL void include(const RowVectors& slope, SlopeRange& __restrict met) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < leaf_edge; ++k) {
      met.least[axis][k] = smaller(met.least[axis][k], slope[axis][k]);
      met.most[axis][k] = larger(met.most[axis][k], slope[axis][k]);
    }
  }
}

/// With those at the corners of the box that the differences to the neighbours span.
SlopeRange slopes_met(const SpeedField& field, std::size_t first, const RowVectors& middle,
                      const Gradients& box) {
  SlopeRange met{.least = middle, .most = middle};
  for (const float x : parts(box, 0))
    for (const float y : parts(box, 1))
      for (const float z : parts(box, 2))
        include(hamiltonian(field, first, at(box, {x, y, z})).slope, met);
  return met;
}

SCARP_VECTOR_KERNEL RowValues difference(const RowValues& a, const RowValues& b) {
  RowValues rest;
  for (int k = 0; k < leaf_edge; ++k) rest[k] = a[k] - b[k];
  return rest;
}

/// What the dissipation takes off rates, by the largest derivatives that are met along each axis.
SCARP_VECTOR_KERNEL RowValues dissipation(const RowValues& rates, const SlopeRange& met,
                                          const Gradients& near, const Gradients& gradients,
                                          bool has_cusps) {
  RowValues sum{};
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < leaf_edge; ++k) {
      const float jump = gradients.forward[axis][k] - gradients.backward[axis][k];
      const float near_jump = near.forward[axis][k] - near.backward[axis][k];
      const float held = select(rates[k] < 0, smaller(jump, near_jump), larger(jump, near_jump));
      const float used = select(has_cusps, 0.5F * (jump + held), jump);
      sum[k] += larger(met.most[axis][k], -met.least[axis][k]) * (0.5F * used);
    }
  }
  return sum;
}

/// V |grad phi| at the nodes of a row, along the axes.
RowValues rates_along_axes(const SpeedField& field, std::size_t first, const Gradients& near,
                           const Gradients& gradients) {
  const bool has_cusps = std::ranges::any_of(
      field.angular, [](const AngularSpeed& part) { return part.factor.has_cusps(); });
  const auto [rates, slope] = hamiltonian(field, first, middle_of(gradients));
  const SlopeRange met = slopes_met(field, first, slope, near);
  return difference(rates, dissipation(rates, met, near, gradients, has_cusps));
}

/// By the differences from which information travels the way phi grows (side 1) or falls (-1).
SCARP_KERNEL_PART RowValues across(const Gradients& gradients, float side) {
  RowValues slopes;
  for (int k = 0; k < leaf_edge; ++k) {
    float square = 0;
    for (int axis = 0; axis < 2; ++axis) {
      const float slope =
          upwind_slope({gradients.backward[axis][k], gradients.forward[axis][k]}, side);
      square += slope * slope;
    }
    slopes[k] = std::sqrt(square);
  }
  return slopes;
}

/// The slopes of phi across and along the vertical, in the place of those along x and z: backward
/// those that count where V |grad phi| rises with the slope, forward those where it falls.
SCARP_VECTOR_KERNEL Gradients across_and_along(const Gradients& gradients) {
  return {.backward = {across(gradients, 1), {}, gradients.backward[2]},
          .forward = {across(gradients, -1), {}, gradients.forward[2]}};
}

/// V |grad phi| turns where its derivatives of one sign are more than this part of those of the
/// other: what is less is rounding, of tables too.
constexpr float least_turn = 0.01F;

/// The slopes from which information comes, or where V |grad phi| turns those in the middle with
/// what the dissipation takes off.
struct Upwind {
  RowVectors p{};
  RowValues dissipation{};
};

SCARP_KERNEL_PART void choose(const SlopeRange& met, const Gradients& slopes, int axis,
                              Upwind& chosen) {
  for (int k = 0; k < leaf_edge; ++k) {
    const float rises = met.most[axis][k];
    const float falls = -met.least[axis][k];
    const bool turns = smaller(rises, falls) > least_turn * larger(rises, falls);
    const float part = select(turns, 0.5F, select(falls > rises, 1.0F, 0.0F));
    const float jump = slopes.forward[axis][k] - slopes.backward[axis][k];
    chosen.p[axis][k] = on_the_way(slopes.backward[axis][k], slopes.forward[axis][k], part);
    chosen.dissipation[k] += select(turns, larger(rises, falls) * (0.5F * jump), 0.0F);
  }
}

SCARP_VECTOR_KERNEL Upwind upwind(const SlopeRange& met, const Gradients& slopes) {
  Upwind chosen;
  choose(met, slopes, 0, chosen);
  choose(met, slopes, 2, chosen);
  return chosen;
}

bool is_vertical(const SpeedField& field) {
  return std::ranges::all_of(field.angular,
                             [](const AngularSpeed& part) { return part.factor.is_vertical(); });
}

/// The speed at which a beam from above etches what faces it. 0 where something grows, or where
/// there is a speed in all directions, too: that rounds the feet of walls.
RowValues beam_speeds(const SpeedField& field, std::size_t first) {
  RowValues speeds{};
  for (const AngularSpeed& part : field.angular)
    for (int k = 0; k < leaf_edge; ++k)
      speeds[k] -= part.amplitude[first + static_cast<std::size_t>(k)];
  for (int k = 0; k < leaf_edge; ++k) {
    const bool is_beam_alone = field.speed[first + static_cast<std::size_t>(k)] == 0;
    speeds[k] = is_beam_alone ? std::max(speeds[k], 0.0F) : 0.0F;
  }
  return speeds;
}

/// Creases less sharp than this, as a jump of the slope along the vertical, are none.
constexpr float least_crease = 0.005F;

/// How far phi of a node may come within dt by what its neighbours along an axis do: as far as the
/// one that gets further, or by the speed of the slower one.
SCARP_KERNEL_PART float reach_beside(const float* p, const float* mobility, float dt,
                                     std::ptrdiff_t stride) {
  const float before = mobility[-stride];
  const float behind = mobility[stride];
  const float beside = larger(p[-stride] + dt * before, p[stride] + dt * behind);
  return larger(beside, p[0] + dt * smaller(before, behind));
}

/// What an etch by a beam from above adds to rates where phi has a crease between a node and the
/// one above it. slopes are those along the vertical that the rates have. Returns how sure it is, 0
/// to 1, that there is a crease.
///
/// A beam shifts phi down as it is. Beside a wall phi above the floor is the distance to the wall,
/// less than that to the floor: a difference across the crease between the two is too small, and at
/// the foot of the wall a wedge would be left that nothing takes away later. So phi is prolonged
/// from both sides up to the crease, and shifted with it. What bends below the node too is no
/// crease but a round surface. No node gets ahead of the floor beside it: at a wall some have the
/// speed of its material.
SCARP_VECTOR_KERNEL RowValues shift_creases(const float* row, const float* mobility, float dt,
                                            const RowValues& speeds, const RowValues& slopes,
                                            RowValues& __restrict rates) {
  RowValues sure;
  for (int k = 0; k < leaf_edge; ++k) {
    const float* p = row + k;
    const float way = larger(speeds[k] * dt, 1e-6F);
    const float below = smaller(p[0] - p[-1], 1.0F);
    const float above = p[1] - p[0];
    const float beyond = larger(p[2] - p[1], 0.0F);
    const float crease = below - above;
    const float bend = std::abs(below - (p[-1] - p[-2])) / larger(crease, least_crease);
    const float trust = smaller(larger(2 - 4 * bend, 0.0F), 1.0F);
    sure[k] = select((speeds[k] > 0) & (crease > least_crease), trust, 0.0F);
    const float shifted = smaller(below, (above - (1 - way) * beyond) / way);
    // That of a distance is 1 at most.
    const float smooth = smaller(slopes[k], 1.0F);
    const float slope = smooth + sure[k] * (larger(shifted, smooth) - smooth);
    const float reach = smaller(reach_beside(p, mobility + k, dt, axis_strides[0]),
                                reach_beside(p, mobility + k, dt, axis_strides[1]));
    const float rate = larger(rates[k] - speeds[k] * (slope - slopes[k]), (p[0] - reach) / dt);
    rates[k] = select(speeds[k] > 0, rate, rates[k]);
  }
  return sure;
}

/// V |grad phi| at the nodes of a row, and where phi has creases that a beam shifts.
struct Rates {
  RowValues value{};
  RowValues creased{};
};

/// The same if V depends on the angle to the vertical alone.
Rates rates_about_vertical(const float* row, const float* mobility, float dt,
                           const SpeedField& field, std::size_t first, const Gradients& near,
                           const Gradients& gradients) {
  const Gradients slopes = across_and_along(gradients);
  const RowVectors middle = hamiltonian(field, first, middle_of(slopes)).slope;
  const auto [p, dissipation] =
      upwind(slopes_met(field, first, middle, across_and_along(near)), slopes);
  Rates rates{.value = difference(hamiltonian(field, first, p).value, dissipation)};
  if (is_etched_by_beam(field))
    rates.creased = shift_creases(row, mobility, dt, beam_speeds(field, first), p[2], rates.value);
  return rates;
}

/// Whether a crystal is etched at a node of a row.
bool etches_crystal_in_row(const SpeedField& field, std::size_t first) {
  return std::ranges::any_of(field.angular, [&](const AngularSpeed& part) {
    const float* amplitude = &part.amplitude[first];
    return part.factor.has_cusps() &&
           std::any_of(amplitude, amplitude + leaf_edge, [](float size) { return size < 0; });
  });
}

/// Nodes further from the surface, in spacings, are not next to it after a time step: all that
/// counts of them is their side, and phi is computed again.
constexpr float next_to_surface = 1.7F;

bool moves(const SpeedField& field, std::size_t node) {
  return field.speed[node] != 0 ||
         std::ranges::any_of(field.angular,
                             [&](const AngularSpeed& part) { return part.amplitude[node] != 0; });
}

/// V |grad phi| at the nodes of a row of a crystal that is etched. most is as in a FreeLeaf.
///
/// Godunov's scheme has sharp corners, but where three planes or more meet it lets rounded tips
/// run ahead and take walls along; the dissipation holds them back by more than it should. The mean
/// of both keeps walls where they are. At the foot of a mask the limit of FreeFoot holds them.
RowValues rates_of_etched_crystal(const float* row, const SpeedField& field, std::size_t first,
                                  const Gradients& near, const float* most) {
  const auto is_flat_along = [&](int axis) {
    return is_flat(near.backward[axis], near.forward[axis]);
  };
  if (is_flat_along(0) && is_flat_along(1) && is_flat_along(2))
    return hamiltonian(field, first, middle_of(near)).value;
  RowValues rates = rates_along_axes(field, first, near, near);
  for (int k = 0; k < leaf_edge; ++k) {
    const std::size_t node = first + static_cast<std::size_t>(k);
    if (std::abs(row[k]) > next_to_surface || !moves(field, node)) continue;
    const auto at_node = [&](const RowVectors& p) { return Vec3f{p[0][k], p[1][k], p[2][k]}; };
    const float sharp = godunov_rate(field, node, at_node(near.backward), at_node(near.forward));
    const bool is_at_foot = most != nullptr && most[k] < std::numeric_limits<float>::max();
    rates[k] = is_at_foot ? sharp : 0.5F * (sharp + rates[k]);
  }
  return rates;
}

/// What belongs to feet is null where there are none.
Rates row_rates(const float* row, float dt, const float* mobility, const FreeRow& free,
                Scheme scheme, const SpeedField& field, std::size_t first) {
  if (has_no_speed(field, first)) return {};
  Gradients near = free.phi != nullptr ? free_gradients(row, free.phi) : first_order_gradients(row);
  if (etches_crystal_in_row(field, first))
    return {.value = rates_of_etched_crystal(row, field, first, near, free.most)};
  if (field.grows_beside_inert) see_past_standing(mobility, near);
  const Gradients gradients = scheme == Scheme::weno5 ? weno5_gradients(row, mobility, near) : near;
  Rates rates = is_vertical(field)
                    ? rates_about_vertical(row, mobility, dt, field, first, near, gradients)
                    : Rates{.value = rates_along_axes(field, first, near, gradients)};
  for (int k = 0; field.grows_beside_inert && k < leaf_edge; ++k)
    if (mobility[k] == 0) rates.value[k] = field.speed[first + static_cast<std::size_t>(k)];
  return rates;
}

/// Whether V is above 0 at a node; around points at its phi in a Block.
bool grows(const SpeedField& field, std::size_t node, const float* around) {
  Vec3f gradient;
  for (int axis = 0; axis < 3; ++axis)
    gradient[axis] = around[axis_strides[axis]] - around[-axis_strides[axis]];
  const Vec3f n = gradient / std::max(length(gradient), 1e-6F);
  return speed_along(field, node, n) > 0;
}

/// Stages after the first one see creases where they have been shifted to, and their mean would
/// blunt them: across a crease nodes come as far as the first one takes them.
void keep_shifted(const LeafStage& leaf, int node, const float* row, const Rates& rates,
                  float* shifted) {
  for (int k = 0; k < leaf_edge; ++k) {
    if (leaf.stage.is_first) {
      const bool is_creased = rates.creased[k] > 0 && std::abs(row[k]) < LevelSet::half_width;
      shifted[k] = is_creased ? row[k] - leaf.stage.dt * rates.value[k] : -LevelSet::half_width;
    }
    if (leaf.stage.is_last && shifted[k] > -LevelSet::half_width)
      leaf.after[node + k] = off_surface(shifted[k], leaf.stage.smallest_phi);
  }
}

/// Lets the layers that were the top at a node be the top again.
void keep_seen(Layers& layers, const std::array<int, 3>& origin, int node, float before,
               float now) {
  const auto [i, j, k] = origin;
  for (std::size_t layer = 0; layer + 1 < layers.stack.size(); ++layer) {
    Band& band = layers.stack[layer].phi.band();
    const int found = band.find(i >> 3, j >> 3, k >> 3);
    if (found < 0) continue;
    float& phi = band.leaves()[static_cast<std::size_t>(found)].phi[node];
    if (phi <= before + same_phi) phi = std::min(phi, now);
  }
}

}  // namespace

bool is_etched_by_beam(const SpeedField& field) {
  return is_vertical(field) && std::ranges::all_of(field.angular, [](const AngularSpeed& part) {
           return part.factor.is_cosine();
         });
}

void move_lax_friedrichs(const LeafStage& leaf, const Block& mobility, Scheme scheme,
                         const SpeedField& field, std::size_t leaf_index, const FreeLeaf& free,
                         float* shifted) {
  for (int i = 0; i < leaf.node_count[0]; ++i) {
    for (int j = 0; j < leaf.node_count[1]; ++j) {
      if (!leaf.moves(i, j)) {
        leaf.keep_row(i, j);
        continue;
      }
      const float* row = leaf.before.row(i, j);
      const int node = leaf_offset(i, j, 0);
      const std::size_t first = leaf_index * leaf_size + static_cast<std::size_t>(node);
      FreeRow beside;
      if (free.phi != nullptr) beside = {free.phi->row(i, j), free.most + node};
      const Rates rates =
          row_rates(row, leaf.stage.dt, mobility.row(i, j), beside, scheme, field, first);
      for (int k = 0; k < leaf_edge; ++k) {
        const float moved = row[k] - leaf.stage.dt * rates.value[k];
        leaf.set(node + k, row[k],
                 free.most == nullptr ? moved : smaller(moved, free.most[node + k]));
      }
      if (shifted != nullptr) keep_shifted(leaf, node, row, rates, shifted + node);
    }
  }
}

void book_rise(Layers& layers, const SpeedField& field, std::span<const float> before) {
  const Band& top = layers.top().band();
  parallel_for(top.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    Block block;
    for (std::size_t n = begin; n < end; ++n) {
      const Leaf& leaf = top.leaves()[n];
      const float* old = &before[n * leaf_size];
      gather<1>(
          top, n, [&](std::size_t m) { return &before[m * leaf_size]; }, block);
      for (int node = 0; node < leaf_size; ++node) {
        const float* around = block.row(node >> 6, (node >> 3) & 7) + (node & 7);
        if (leaf.phi[node] >= old[node] || grows(field, n * leaf_size + node, around)) continue;
        keep_seen(layers, leaf.origin, node, old[node], leaf.phi[node]);
      }
    }
  });
}

std::vector<float> mobilities(const Band& band, const SpeedField& field) {
  std::vector<float> mobility(field.speed.size());
  for (std::size_t n = 0; n < mobility.size(); ++n) {
    mobility[n] = field.grows_beside_inert ? 0 : std::abs(field.speed[n]);
    for (const AngularSpeed& part : field.angular) {
      mobility[n] += std::abs(part.amplitude[n]);
    }
    const float phi = band.leaves()[n / leaf_size].phi[n % leaf_size];
    // What a missing leaf is read as.
    mobility[n] = std::abs(phi) < LevelSet::half_width ? mobility[n] : LevelSet::half_width;
  }
  return mobility;
}

}  // namespace scarp

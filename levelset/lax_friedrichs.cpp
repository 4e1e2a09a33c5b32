#include "levelset/lax_friedrichs.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/parallel.h"
#include "levelset/band.h"
#include "levelset/differences.h"
#include "levelset/exposure.h"
#include "levelset/hamiltonian.h"
#include "levelset/stencil.h"

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

/// The parts of the way between two slopes at which a row is asked: the two ends, or the middle
/// alone if they are the same.
SCARP_KERNEL_PART std::span<const float> parts_between(const RowValues& from, const RowValues& to) {
  static constexpr std::array<float, 3> places{0, 1, 0.5F};
  int wide = 0;
  for (int k = 0; k < leaf_edge; ++k) wide |= std::abs(to[k] - from[k]) > flat ? 1 : 0;
  return std::span(places).subspan(wide != 0 ? 0 : 2, wide != 0 ? 2 : 1);
}

/// grad phi at the nodes of a row, as seen from the two sides along each axis.
struct Gradients {
  RowVectors backward;
  RowVectors forward;

  /// The given part of the way from backward to forward, by axis.
  SCARP_KERNEL_PART RowVectors at(const std::array<float, 3>& part) const {
    return {on_the_way(backward[0], forward[0], part[0]),
            on_the_way(backward[1], forward[1], part[1]),
            on_the_way(backward[2], forward[2], part[2])};
  }

  SCARP_KERNEL_PART std::span<const float> parts(int axis) const {
    return parts_between(backward[axis], forward[axis]);
  }
};

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

/// By WENO5, but near ones where something within reach does not move.
SCARP_VECTOR_KERNEL Gradients weno5_gradients(const float* row, const float* mobility,
                                              const Gradients& near) {
  Gradients gradients = gradients_of<Scheme::weno5>(row);
  std::array<int, leaf_edge> near_still{};
  for (const std::ptrdiff_t stride : axis_strides) {
    for (int n = -Block::halo; n <= Block::halo; ++n) {
      for (int k = 0; k < leaf_edge; ++k) near_still[k] |= mobility[n * stride + k] == 0 ? 1 : 0;
    }
  }
  const auto replace = [&](const RowVectors& from, RowVectors& to) {
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < leaf_edge; ++k)
        to[axis][k] = select(near_still[k] != 0, from[axis][k], to[axis][k]);
    }
  };
  replace(near.backward, gradients.backward);
  replace(near.forward, gradients.forward);
  return gradients;
}

/// Slopes below this are those of a film that goes along a wall, others of one that leans against
/// it.
constexpr float leaning = 0.5F;

/// Differences to what stands still are those on the other side, or nothing for a film that goes
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

SCARP_KERNEL_PART void include(const RowVectors& slope, RowVectors& dissipation) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < leaf_edge; ++k) {
      dissipation[axis][k] = std::max(dissipation[axis][k], std::abs(slope[axis][k]));
    }
  }
}

/// The largest derivatives at the corners of the box that the differences to the neighbours span.
SCARP_KERNEL_PART RowVectors dissipation_in_box(const SpeedField& field, std::size_t first,
                                                const Gradients& near) {
  RowVectors dissipation{};
  for (const float x : near.parts(0)) {
    for (const float y : near.parts(1)) {
      for (const float z : near.parts(2)) {
        include(hamiltonian(field, first, near.at({x, y, z})).slope, dissipation);
      }
    }
  }
  return dissipation;
}

SCARP_KERNEL_PART RowValues difference(const RowValues& a, const RowValues& b) {
  RowValues rest;
  for (int k = 0; k < leaf_edge; ++k) rest[k] = a[k] - b[k];
  return rest;
}

/// V |grad phi| at the nodes of a row, along the axes.
SCARP_VECTOR_KERNEL RowValues rates_along_axes(const SpeedField& field, std::size_t first,
                                               const Gradients& near, const Gradients& gradients) {
  const bool has_cusps = std::ranges::any_of(
      field.angular, [](const AngularSpeed& part) { return part.factor.has_cusps(); });
  const Hamiltonian central = hamiltonian(field, first, gradients.at({0.5F, 0.5F, 0.5F}));
  RowVectors dissipation = dissipation_in_box(field, first, near);
  include(central.slope, dissipation);
  RowValues smoothing{};
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < leaf_edge; ++k) {
      const float jump = gradients.forward[axis][k] - gradients.backward[axis][k];
      const float near_jump = near.forward[axis][k] - near.backward[axis][k];
      const bool etches = central.value[k] < 0;
      const float held = select(etches, smaller(jump, near_jump), larger(jump, near_jump));
      const float used = select(has_cusps, 0.5F * (jump + held), jump);
      smoothing[k] += dissipation[axis][k] * (0.5F * used);
    }
  }
  return difference(central.value, smoothing);
}

/// The slopes of phi across (0) and along the vertical (1) at the nodes of a row: the one that
/// counts where V |grad phi| rises with the slope, and the one where it falls.
struct VerticalSlopes {
  std::array<RowValues, 2> rising;
  std::array<RowValues, 2> falling;

  SCARP_KERNEL_PART explicit VerticalSlopes(const Gradients& gradients)
      : rising{across(gradients, 1), gradients.backward[2]},
        falling{across(gradients, -1), gradients.forward[2]} {}

  /// The parts of the way from rising to falling.
  SCARP_KERNEL_PART RowVectors gradient(float across, float along) const {
    return {
        on_the_way(rising[0], falling[0], across), {}, on_the_way(rising[1], falling[1], along)};
  }
  SCARP_KERNEL_PART std::span<const float> parts(int component) const {
    return parts_between(rising[component], falling[component]);
  }

 private:
  /// By the differences from which information travels the way phi grows (side 1) or falls (-1).
  SCARP_KERNEL_PART static RowValues across(const Gradients& gradients, float side) {
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
};

/// The derivatives of V |grad phi| that are met at the nodes of a row.
struct SlopeRange {
  RowValues least;
  RowValues most;

  SCARP_KERNEL_PART void include(const RowValues& slope) {
    for (int k = 0; k < leaf_edge; ++k) {
      least[k] = std::min(least[k], slope[k]);
      most[k] = std::max(most[k], slope[k]);
    }
  }
};

/// V |grad phi| turns where its derivatives of one sign are more than this part of those of the
/// other: what is less is rounding, of tables too.
constexpr float least_turn = 0.01F;

/// V |grad phi| at the nodes of a row, if V depends on the angle to the vertical alone.
SCARP_VECTOR_KERNEL RowValues rates_about_vertical(const SpeedField& field, std::size_t first,
                                                   const Gradients& near,
                                                   const Gradients& gradients) {
  const VerticalSlopes slopes(gradients);
  const VerticalSlopes box(near);
  constexpr std::array<int, 2> axes{0, 2};  // of gradients
  const Hamiltonian middle = hamiltonian(field, first, slopes.gradient(0.5F, 0.5F));
  std::array<SlopeRange, 2> range;
  for (int part = 0; part < 2; ++part) {
    const RowValues& slope = middle.slope[axes[part]];
    range[part] = {.least = slope, .most = slope};
  }
  for (const float across : box.parts(0)) {
    for (const float along : box.parts(1)) {
      const Hamiltonian corner = hamiltonian(field, first, box.gradient(across, along));
      for (int part = 0; part < 2; ++part) range[part].include(corner.slope[axes[part]]);
    }
  }
  RowValues smoothing{};
  RowVectors chosen{};
  for (int part = 0; part < 2; ++part) {
    for (int k = 0; k < leaf_edge; ++k) {
      const float least = range[part].least[k];
      const float most = range[part].most[k];
      const bool turns = std::min(most, -least) > least_turn * std::max(most, -least);
      const float falls = -least > most ? 1.0F : 0.0F;
      const float rising = slopes.rising[part][k];
      const float falling = slopes.falling[part][k];
      chosen[axes[part]][k] = on_the_way(rising, falling, turns ? 0.5F : falls);
      smoothing[k] += turns ? std::max(most, -least) * (0.5F * (falling - rising)) : 0.0F;
    }
  }
  const Hamiltonian found = hamiltonian(field, first, chosen);
  return difference(found.value, smoothing);
}

/// V |grad phi| at the nodes of a row.
RowValues row_rates(const float* row, const float* mobility, Scheme scheme, const SpeedField& field,
                    std::size_t first) {
  if (has_no_speed(field, first)) return {};
  const bool is_vertical = std::ranges::all_of(
      field.angular, [](const AngularSpeed& part) { return part.factor.is_vertical(); });
  Gradients near = first_order_gradients(row);
  if (field.grows_beside_standing) see_past_standing(mobility, near);
  const Gradients gradients = scheme == Scheme::weno5 ? weno5_gradients(row, mobility, near) : near;
  RowValues rates = is_vertical ? rates_about_vertical(field, first, near, gradients)
                                : rates_along_axes(field, first, near, gradients);
  for (int k = 0; field.grows_beside_standing && k < leaf_edge; ++k)
    if (mobility[k] == 0) rates[k] = field.speed[first + static_cast<std::size_t>(k)];
  return rates;
}

/// Whether V is above 0 at a node; around points at its phi in a Block.
bool grows(const SpeedField& field, std::size_t node, const float* around) {
  Vec3f gradient;
  for (int axis = 0; axis < 3; ++axis)
    gradient[axis] = around[axis_strides[axis]] - around[-axis_strides[axis]];
  const Vec3f n = gradient / std::max(length(gradient), 1e-6F);
  float speed = field.speed[node];
  for (const AngularSpeed& part : field.angular)
    speed += part.amplitude[node] * part.factor.value(n);
  return speed > 0;
}

/// Lets the layers that were the top at a node be the top again.
void keep_seen(Layers& layers, const std::array<int, 3>& origin, int node, float before,
               float now) {
  const auto [i, j, k] = origin;
  for (std::size_t layer = 0; layer + 1 < layers.stack.size(); ++layer) {
    const Band& band = layers.stack[layer].phi.band();
    const int found = band.find(i >> 3, j >> 3, k >> 3);
    if (found < 0) continue;
    float& phi = band.leaves()[static_cast<std::size_t>(found)].phi[node];
    if (phi <= before + same_phi) phi = std::min(phi, now);
  }
}

}  // namespace

void move_lax_friedrichs(const LeafStage& leaf, const Block& mobility, Scheme scheme,
                         const SpeedField& field, std::size_t leaf_index) {
  for (int i = 0; i < leaf.node_count[0]; ++i) {
    for (int j = 0; j < leaf.node_count[1]; ++j) {
      if (!leaf.moves(i, j)) {
        leaf.keep_row(i, j);
        continue;
      }
      const float* row = leaf.before.row(i, j);
      const int node = leaf_offset(i, j, 0);
      const std::size_t first = leaf_index * leaf_size + static_cast<std::size_t>(node);
      const RowValues rates = row_rates(row, mobility.row(i, j), scheme, field, first);
      for (int k = 0; k < leaf_edge; ++k)
        leaf.set(node + k, row[k], row[k] - leaf.stage.dt * rates[k]);
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
    mobility[n] = field.grows_beside_standing ? 0 : std::abs(field.speed[n]);
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

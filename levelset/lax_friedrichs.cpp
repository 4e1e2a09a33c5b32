#include "levelset/lax_friedrichs.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/parallel.h"
#include "levelset/band.h"
#include "levelset/differences.h"
#include "levelset/exposure.h"
#include "levelset/stencil.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 16;

using Row = std::array<float, leaf_edge>;

/// A vector at each node of a row, by axis.
using RowVectors = std::array<Row, 3>;

/// Differences along an axis that differ by less than this, in the whole row, count as equal.
constexpr float flat = 1e-4F;

/// V |grad phi| and its derivatives by grad phi.
struct Hamiltonian {
  Row value;
  RowVectors slope;

  void add(const AngularRate& rate, float amplitude, int k) {
    value[k] += amplitude * rate.value;
    for (int axis = 0; axis < 3; ++axis) {
      slope[axis][k] += amplitude * rate.slope[axis];
    }
  }
};

/// grad phi at the nodes of a row, as seen from the two sides along each axis.
struct Gradients {
  RowVectors backward;
  RowVectors forward;

  /// The given part of the way from backward to forward, by axis: 0, 1/2 or 1, which in this form
  /// are symmetric to the last bit.
  Vec3f at(int k, const std::array<float, 3>& part) const {
    Vec3f p;
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] = (1 - part[axis]) * backward[axis][k] + part[axis] * forward[axis][k];
    }
    return p;
  }

  /// The two ends along an axis, or the middle alone if they are the same.
  std::span<const float> parts(int axis) const {
    static constexpr std::array<float, 3> places{0, 1, 0.5F};
    float widest = 0;
    for (int k = 0; k < leaf_edge; ++k) {
      widest = std::max(widest, std::abs(forward[axis][k] - backward[axis][k]));
    }
    return std::span(places).subspan(widest > flat ? 0 : 2, widest > flat ? 2 : 1);
  }
};

template <Scheme scheme>
inline void find_gradients(const float* row, Gradients& gradients) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < leaf_edge; ++k) {
      const OneSided slopes = one_sided<scheme>(row + k, axis_strides[axis]);
      gradients.backward[axis][k] = slopes.backward;
      gradients.forward[axis][k] = slopes.forward;
    }
  }
}

bool is_near_still(const float* mobility) {
  bool still = false;
  for (const std::ptrdiff_t stride : axis_strides) {
    for (int n = -Block::halo; n <= Block::halo; ++n) {
      still = still || mobility[n * stride] == 0;
    }
  }
  return still;
}

void replace_near_still(const float* mobility, const Gradients& near, Gradients& gradients) {
  for (int k = 0; k < leaf_edge; ++k) {
    if (is_near_still(mobility + k)) {
      for (int axis = 0; axis < 3; ++axis) {
        gradients.backward[axis][k] = near.backward[axis][k];
        gradients.forward[axis][k] = near.forward[axis][k];
      }
    }
  }
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

/// The sum over the isotropic part and all angular parts of a field, for the row that starts at
/// node first, at grad phi = p(k).
template <class Gradient>
inline Hamiltonian evaluate(const SpeedField& field, std::size_t first, const Gradient& p) {
  Hamiltonian sum{};
  for (int k = 0; k < leaf_edge; ++k) {
    const Vec3f gradient = p(k);
    const float size = length(gradient);
    sum.add({size, gradient / std::max(size, 1e-6F)}, field.speed[first + k], k);
  }
  for (const AngularSpeed& part : field.angular) {
    const float* amplitude = &part.amplitude[first];
    if (std::all_of(amplitude, amplitude + leaf_edge, [](float a) { return a == 0; })) continue;
    part.factor.visit([&](const auto& factor) {
      for (int k = 0; k < leaf_edge; ++k) {
        sum.add(factor.rate(p(k)), amplitude[k], k);
      }
    });
  }
  return sum;
}

void include(const RowVectors& slope, RowVectors& dissipation) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < leaf_edge; ++k) {
      dissipation[axis][k] = std::max(dissipation[axis][k], std::abs(slope[axis][k]));
    }
  }
}

/// The largest derivatives at the corners of the box that the differences to the neighbours span.
RowVectors dissipation_in_box(const SpeedField& field, std::size_t first, const Gradients& near) {
  RowVectors dissipation{};
  for (const float x : near.parts(0)) {
    for (const float y : near.parts(1)) {
      for (const float z : near.parts(2)) {
        const auto corner = [&](int k) { return near.at(k, {x, y, z}); };
        include(evaluate(field, first, corner).slope, dissipation);
      }
    }
  }
  return dissipation;
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
  const bool has_cusps = std::ranges::any_of(
      field.angular, [](const AngularSpeed& part) { return part.factor.has_cusps(); });
  for (int i = 0; i < leaf.node_count[0]; ++i) {
    for (int j = 0; j < leaf.node_count[1]; ++j) {
      const float* row = leaf.before.row(i, j);
      const int node = leaf_offset(i, j, 0);
      if (!leaf.moves(i, j)) {
        leaf.keep_row(i, j);
        continue;
      }
      Gradients near;
      find_gradients<Scheme::first_order>(row, near);
      if (field.grows_beside_standing) {
        see_past_standing(mobility.row(i, j), near);
      }
      Gradients gradients = near;
      if (scheme == Scheme::weno5) {
        find_gradients<Scheme::weno5>(row, gradients);
        replace_near_still(mobility.row(i, j), near, gradients);
      }
      const std::size_t first = leaf_index * leaf_size + static_cast<std::size_t>(node);
      const Hamiltonian central = evaluate(field, first, [&](int k) {
        return gradients.at(k, {0.5F, 0.5F, 0.5F});
      });
      RowVectors dissipation = dissipation_in_box(field, first, near);
      include(central.slope, dissipation);
      for (int k = 0; k < leaf_edge; ++k) {
        const bool etches = central.value[k] < 0;
        std::array<float, 3> smoothing;
        for (int axis = 0; axis < 3; ++axis) {
          float jump = gradients.forward[axis][k] - gradients.backward[axis][k];
          if (has_cusps) {
            const float near_jump = near.forward[axis][k] - near.backward[axis][k];
            jump = 0.5F * (jump + (etches ? std::min(jump, near_jump) : std::max(jump, near_jump)));
          }
          smoothing[axis] = dissipation[axis][k] * (0.5F * jump);
        }
        float rate = central.value[k] - ((smoothing[0] + smoothing[1]) + smoothing[2]);
        if (field.grows_beside_standing && mobility.row(i, j)[k] == 0) {
          rate = field.speed[first + static_cast<std::size_t>(k)];
        }
        leaf.set(node + k, row[k], row[k] - leaf.stage.dt * rate);
      }
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

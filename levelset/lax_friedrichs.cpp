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

/// The parts of the way between two slopes at which a row is asked: the two ends, or the middle
/// alone if they are the same.
std::span<const float> ways_between(const Row& from, const Row& to) {
  static constexpr std::array<float, 3> places{0, 1, 0.5F};
  float widest = 0;
  for (int k = 0; k < leaf_edge; ++k) widest = std::max(widest, std::abs(to[k] - from[k]));
  return std::span(places).subspan(widest > flat ? 0 : 2, widest > flat ? 2 : 1);
}

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

  std::span<const float> parts(int axis) const {
    return ways_between(backward[axis], forward[axis]);
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

/// grad phi at the nodes of a row.
struct Slopes {
  Row size;
  RowVectors normals;

  Vec3f normal(int k) const { return {normals[0][k], normals[1][k], normals[2][k]}; }
};

bool is_zero(const float* amplitude) {
  return std::all_of(amplitude, amplitude + leaf_edge, [](float a) { return a == 0; });
}

/// Adds the angular parts of a field from a given one on that have its axis, and returns the number
/// of the next one.
std::size_t add_about_axis(const SpeedField& field, std::size_t part, std::size_t first,
                           const Slopes& p, Hamiltonian& sum) {
  const Vec3f axis = *field.angular[part].factor.axis();
  Row cosine;
  for (int k = 0; k < leaf_edge; ++k) cosine[k] = axial_cosine(axis, p.normal(k));
  const auto [least, most] = std::minmax_element(cosine.begin(), cosine.end());
  Row value{};
  Row rise{};
  for (; part < field.angular.size() && field.angular[part].factor.axis() == axis; ++part) {
    const auto& [factor, amplitudes] = field.angular[part];
    const float* amplitude = &amplitudes[first];
    const SlopeResponse* slopes = factor.between_slopes();
    if (slopes != nullptr && slopes->is_zero_between(*least, *most)) continue;
    if (is_zero(amplitude)) continue;
    factor.visit([&](const auto& kind) {
      if constexpr (requires { kind.at(0.0F); }) {
        for (int k = 0; k < leaf_edge; ++k) {
          const AxialRate rate = kind.at(cosine[k]);
          value[k] += amplitude[k] * rate.value;
          rise[k] += amplitude[k] * rate.rise;
        }
      }
    });
  }
  for (int k = 0; k < leaf_edge; ++k)
    sum.add(rate_about(axis, p.size[k], p.normal(k), {value[k], rise[k]}), 1, k);
  return part;
}

/// The sum over the isotropic part and all angular parts of a field, for the row that starts at
/// node first, at grad phi = p(k).
template <class Gradient>
inline Hamiltonian evaluate(const SpeedField& field, std::size_t first, const Gradient& p) {
  Hamiltonian sum{};
  Slopes at;
  for (int k = 0; k < leaf_edge; ++k) {
    const Vec3f gradient = p(k);
    const float size = length(gradient);
    at.size[k] = std::max(size, 1e-6F);
    const Vec3f normal = gradient / at.size[k];
    for (int axis = 0; axis < 3; ++axis) at.normals[axis][k] = normal[axis];
    sum.add({size, normal}, field.speed[first + k], k);
  }
  for (std::size_t part = 0; part < field.angular.size();) {
    const auto& [factor, amplitudes] = field.angular[part];
    if (factor.axis()) {
      part = add_about_axis(field, part, first, at, sum);
      continue;
    }
    ++part;
    const float* amplitude = &amplitudes[first];
    if (is_zero(amplitude)) continue;
    factor.visit([&](const auto& kind) {
      if constexpr (requires { kind.rate(Vec3f{}); })
        for (int k = 0; k < leaf_edge; ++k) sum.add(kind.rate(p(k)), amplitude[k], k);
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

/// V |grad phi| at the nodes of a row, along the axes.
Row rates_along_axes(const SpeedField& field, std::size_t first, const Gradients& near,
                     const Gradients& gradients, bool has_cusps) {
  const Hamiltonian central = evaluate(field, first, [&](int k) {
    return gradients.at(k, {0.5F, 0.5F, 0.5F});
  });
  RowVectors dissipation = dissipation_in_box(field, first, near);
  include(central.slope, dissipation);
  Row rates;
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
    rates[k] = central.value[k] - ((smoothing[0] + smoothing[1]) + smoothing[2]);
  }
  return rates;
}

/// The slopes of phi across (0) and along the vertical (1) at the nodes of a row: the one that
/// counts where V |grad phi| rises with the slope, and the one where it falls.
struct VerticalSlopes {
  std::array<Row, 2> rising;
  std::array<Row, 2> falling;

  explicit VerticalSlopes(const Gradients& gradients)
      : rising{across(gradients, 1), gradients.backward[2]},
        falling{across(gradients, -1), gradients.forward[2]} {}

  /// The part of the way from rising to falling.
  float at(int part, int k, float way) const {
    return (1 - way) * rising[part][k] + way * falling[part][k];
  }
  std::span<const float> ways(int part) const { return ways_between(rising[part], falling[part]); }
  static Vec3f gradient(float across, float along) { return {across, 0, along}; }

 private:
  /// By the differences from which information travels the way phi grows (side 1) or falls (-1).
  static Row across(const Gradients& gradients, float side) {
    Row slopes;
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
  Row least;
  Row most;

  void include(const Row& slope) {
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
Row rates_about_vertical(const SpeedField& field, std::size_t first, const Gradients& near,
                         const Gradients& gradients) {
  const VerticalSlopes slopes(gradients);
  const VerticalSlopes box(near);
  constexpr std::array<int, 2> component{0, 2};  // of a gradient
  const Hamiltonian middle = evaluate(field, first, [&](int k) {
    return VerticalSlopes::gradient(slopes.at(0, k, 0.5F), slopes.at(1, k, 0.5F));
  });
  std::array<SlopeRange, 2> range;
  for (int part = 0; part < 2; ++part) {
    const Row& slope = middle.slope[component[part]];
    range[part] = {.least = slope, .most = slope};
  }
  for (const float across : box.ways(0)) {
    for (const float along : box.ways(1)) {
      const Hamiltonian corner = evaluate(field, first, [&](int k) {
        return VerticalSlopes::gradient(box.at(0, k, across), box.at(1, k, along));
      });
      for (int part = 0; part < 2; ++part) range[part].include(corner.slope[component[part]]);
    }
  }
  Row smoothing{};
  std::array<Row, 2> chosen;
  for (int part = 0; part < 2; ++part) {
    for (int k = 0; k < leaf_edge; ++k) {
      const float least = range[part].least[k];
      const float most = range[part].most[k];
      const bool turns = std::min(most, -least) > least_turn * std::max(most, -least);
      const float falls = -least > most ? 1.0F : 0.0F;
      chosen[part][k] = slopes.at(part, k, turns ? 0.5F : falls);
      const float jump = slopes.falling[part][k] - slopes.rising[part][k];
      smoothing[k] += turns ? std::max(most, -least) * (0.5F * jump) : 0.0F;
    }
  }
  const Hamiltonian found = evaluate(
      field, first, [&](int k) { return VerticalSlopes::gradient(chosen[0][k], chosen[1][k]); });
  Row rates;
  for (int k = 0; k < leaf_edge; ++k) rates[k] = found.value[k] - smoothing[k];
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
  const bool has_cusps = std::ranges::any_of(
      field.angular, [](const AngularSpeed& part) { return part.factor.has_cusps(); });
  const bool is_vertical = std::ranges::all_of(
      field.angular, [](const AngularSpeed& part) { return part.factor.is_vertical(); });
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
      const Row rates = is_vertical ? rates_about_vertical(field, first, near, gradients)
                                    : rates_along_axes(field, first, near, gradients, has_cusps);
      for (int k = 0; k < leaf_edge; ++k) {
        float rate = rates[k];
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

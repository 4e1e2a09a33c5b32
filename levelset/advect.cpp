#include "levelset/advect.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/band.h"
#include "levelset/redistance.h"
#include "levelset/standstill.h"
#include "levelset/stencil.h"

namespace scarp {

namespace {

constexpr float half_width = LevelSet::half_width;
constexpr std::size_t grain = 16;

/// No node lies exactly on the surface: it is moved off it to the side it is on.
constexpr float smallest_phi = 1e-6F;

/// phi - dt V |grad phi| for the nodes of a leaf that lie in the domain; what is not in the band
/// stays.
template <bool second_order>
inline void euler_rows(const Block& block, const float* speed, float dt,
                       std::array<int, 2> node_count, float* out) {
  for (int i = 0; i < node_count[0]; ++i) {
    for (int j = 0; j < node_count[1]; ++j) {
      const float* row = block.row(i, j);
      const int node = leaf_offset(i, j, 0);
      for (int k = 0; k < leaf_edge; ++k) {
        const float* p = row + k;
        const float v = speed[node + k];
        const float side = v < 0 ? -1.0F : 1.0F;
        const float slope = second_order ? distance_slope(p, side) : upwind_slope(p, side);
        const float moved = *p - dt * v * slope;
        out[node + k] = std::abs(*p) < half_width ? moved : *p;
      }
    }
  }
}

using LeafKernel = void (*)(const Block&, const float*, float, std::array<int, 2>, float*);

SCARP_VECTOR_KERNEL void first_order_leaf(const Block& block, const float* speed, float dt,
                                          std::array<int, 2> node_count, float* out) {
  euler_rows<false>(block, speed, dt, node_count, out);
}

SCARP_VECTOR_KERNEL void second_order_leaf(const Block& block, const float* speed, float dt,
                                           std::array<int, 2> node_count, float* out) {
  euler_rows<true>(block, speed, dt, node_count, out);
}

/// An Euler step of all leaves, from one set of values to another.
template <class Source>
void euler_step(const Band& band, const SpeedField& field, float dt, const Source& from,
                LeafKernel kernel, LeafValues& to) {
  parallel_for(band.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    Block block;
    for (std::size_t n = begin; n < end; ++n) {
      const Leaf& leaf = band.leaves()[n];
      gather(band, n, from, block);
      kernel(block, &field.speed[n * leaf_size], dt,
             {stored_nodes(band, leaf, 0), stored_nodes(band, leaf, 1)}, to[n]);
    }
  });
}

void write_back(const Band& band, const LeafValues& values) {
  parallel_for(band.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      float* phi = band.leaves()[n].phi;
      const float* moved = values[n];
      for (int node = 0; node < leaf_size; ++node) {
        const float nudged = std::copysign(smallest_phi, moved[node]);
        const float value = std::abs(moved[node]) < smallest_phi ? nudged : moved[node];
        phi[node] = std::abs(phi[node]) < half_width ? value : phi[node];
      }
    }
  });
}

/// One Euler step of the first order.
LeafValues first_order_step(const Band& band, const SpeedField& field, float dt) {
  LeafValues moved(band.leaves().size());
  const auto in_tree = [&](std::size_t n) { return band.leaves()[n].phi; };
  euler_step(band, field, dt, in_tree, first_order_leaf, moved);
  return moved;
}

/// Heun's method: the mean of phi and of phi after two Euler steps.
LeafValues second_order_step(const Band& band, const SpeedField& field, float dt) {
  LeafValues once(band.leaves().size());
  LeafValues mean(band.leaves().size());
  const auto in_tree = [&](std::size_t n) { return band.leaves()[n].phi; };
  const auto after_one = [&](std::size_t n) { return once[n]; };
  euler_step(band, field, dt, in_tree, second_order_leaf, once);
  euler_step(band, field, dt, after_one, second_order_leaf, mean);
  parallel_for(band.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const float* phi = band.leaves()[n].phi;
      for (int node = 0; node < leaf_size; ++node) {
        mean[n][node] = 0.5F * (phi[node] + mean[n][node]);
      }
    }
  });
  return mean;
}

void require_finite(const Layers& layers, const SpeedField& field) {
  const auto& leaves = layers.top().band().leaves();
  SCARP_ASSERT(field.speed.size(), ==, leaves.size() * leaf_size);
  for (std::size_t n = 0; n < field.speed.size(); ++n) {
    if (!std::isfinite(field.speed[n])) {
      const Frame& frame = layers.frame;
      const auto [i, j, k] = leaves[n / leaf_size].origin;
      const int node = static_cast<int>(n % leaf_size);
      throw NumericalError("speed is not finite at (" +
                           std::to_string(frame.node_position(0, i + (node >> 6))) + ", " +
                           std::to_string(frame.node_position(1, j + ((node >> 3) & 7))) + ", " +
                           std::to_string(frame.node_position(2, k + (node & 7))) + ") nm");
    }
  }
}

}  // namespace

double stable_time_step(const Layers& layers, const SpeedField& field, double cfl) {
  return field.max_speed > 0 ? cfl * layers.frame.spacing / field.max_speed
                             : std::numeric_limits<double>::infinity();
}

void advect(Layers& layers, const SpeedField& field, double dt, Scheme scheme) {
  require_finite(layers, field);
  const auto scaled_dt = static_cast<float>(dt / layers.frame.spacing);
  Band& band = layers.top().band();
  LeafValues moved = scheme == Scheme::first_order ? first_order_step(band, field, scaled_dt)
                                                   : second_order_step(band, field, scaled_dt);
  keep_standing_layers(layers, field, scaled_dt, moved);
  write_back(band, moved);
  redistance(band);
  cut_lower_layers(layers);
}

}  // namespace scarp

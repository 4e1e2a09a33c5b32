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

/// phi - dt V |grad phi| for one row of eight nodes; what is not in the band stays.
template <bool second_order>
void euler_row(const float* row, const float* speed, float dt, float* out) {
  for (int k = 0; k < leaf_edge; ++k) {
    const float* p = row + k;
    const float side = speed[k] < 0 ? -1.0F : 1.0F;
    const float slope = second_order ? distance_slope(p, side) : upwind_slope(p, side);
    const float moved = *p - dt * speed[k] * slope;
    out[k] = std::abs(*p) < half_width ? moved : *p;
  }
}

template <bool second_order, class Source>
void euler_leaf(const Band& band, std::size_t n, const Source& source, const float* speed, float dt,
                Block& block, float* out) {
  gather(band, n, source, block);
  const int i_count = stored_nodes(band, band.leaves()[n], 0);
  const int j_count = stored_nodes(band, band.leaves()[n], 1);
  for (int i = 0; i < i_count; ++i) {
    for (int j = 0; j < j_count; ++j) {
      const int node = leaf_offset(i, j, 0);
      euler_row<second_order>(block.row(i, j), speed + node, dt, out + node);
    }
  }
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
  parallel_for(band.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    Block block;
    for (std::size_t n = begin; n < end; ++n) {
      euler_leaf<false>(band, n, in_tree, &field.speed[n * leaf_size], dt, block, moved[n]);
    }
  });
  return moved;
}

/// Heun's method: the mean of phi and of phi after two Euler steps.
LeafValues second_order_step(const Band& band, const SpeedField& field, float dt) {
  LeafValues once(band.leaves().size());
  LeafValues mean(band.leaves().size());
  const auto in_tree = [&](std::size_t n) { return band.leaves()[n].phi; };
  const auto after_one = [&](std::size_t n) { return once[n]; };
  parallel_for(band.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    Block block;
    for (std::size_t n = begin; n < end; ++n) {
      euler_leaf<true>(band, n, in_tree, &field.speed[n * leaf_size], dt, block, once[n]);
    }
  });
  parallel_for(band.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    Block block;
    for (std::size_t n = begin; n < end; ++n) {
      float* twice = mean[n];
      euler_leaf<true>(band, n, after_one, &field.speed[n * leaf_size], dt, block, twice);
      const float* phi = band.leaves()[n].phi;
      for (int node = 0; node < leaf_size; ++node) {
        twice[node] = 0.5F * (phi[node] + twice[node]);
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

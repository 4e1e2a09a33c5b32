#pragma once

// Speeds that tests give in place of those that a flux leads to, and the time that they hold for.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "levelset/grid/band.h"
#include "levelset/grid/exposure.h"
#include "levelset/motion/extend.h"
#include "levelset/motion/speed_field.h"

namespace scarp {

/// The largest magnitude at nodes next to the surface.
inline float max_speed(const Layers& layers, const SpeedField& field) {
  const auto& leaves = layers.top().band().leaves();
  std::vector<AngularFactor> factors;
  for (const AngularSpeed& part : field.angular) factors.push_back(part.factor);
  const LimitingSpeed limiting_speed(factors);
  float fastest = 0;
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    for (int node = 0; node < leaf_size; ++node) {
      if (std::abs(leaves[n].phi[node]) < 1) {
        const std::size_t at = n * leaf_size + static_cast<std::size_t>(node);
        const auto amplitude = [&](std::size_t k) { return field.angular[k].amplitude[at]; };
        const float speed = limiting_speed(field.speed[at], amplitude);
        fastest = std::max(fastest, speed);
      }
    }
  }
  return fastest;
}

/// The time in which the fastest place of the surface moves by cfl spacings; infinite if nothing
/// moves. Units: s.
inline double stable_time_step(const Layers& layers, const SpeedField& field, double cfl) {
  const float fastest = max_speed(layers, field);
  return fastest > 0 ? cfl * layers.frame.spacing / fastest
                     : std::numeric_limits<double>::infinity();
}

/// Speeds given as a function of position and exposed material, at every node of the band.
///
/// Closed voids move too. With dt > 0 the surface may pass through thin layers within dt: the
/// speeds are then the mean over dt, and materials of speed 0 do not move.
/// The function is called from several threads.
inline SpeedField prescribe_speeds(const Layers& layers,
                                   const std::function<double(Vec3d r, MaterialId material)>& speed,
                                   double dt = 0) {
  const Frame& frame = layers.frame;
  const Band& band = layers.top().band();
  const std::size_t layer_count = layers.stack.size();
  const std::vector<std::uint16_t> exposed = exposed_layers(layers);
  SpeedField field;
  field.speed.resize(band.leaves().size() * leaf_size);
  const std::size_t range_count = band.leaves().size() / 4 + 1;
  std::vector<std::uint8_t> moves(layer_count * range_count, 0);
  std::vector<float> slowest(layer_count * range_count, 0);
  parallel_for(band.leaves().size(), 4, [&](std::size_t begin, std::size_t end) {
    std::vector<float> speeds(layer_count);
    std::vector<float> depth(layer_count);
    for (std::size_t n = begin; n < end; ++n) {
      const Leaf& leaf = band.leaves()[n];
      for (int node = 0; node < leaf_size; ++node) {
        if (std::abs(leaf.phi[node]) >= LevelSet::half_width) {
          continue;
        }
        const Vec3d r = frame.node_position(node_at(leaf, node));
        for (std::size_t layer = 0; layer < layer_count; ++layer) {
          speeds[layer] = static_cast<float>(speed(r, layers.stack[layer].material));
          const std::size_t at = begin / 4 * layer_count + layer;
          moves[at] |= speeds[layer] != 0 ? 1 : 0;
          slowest[at] = std::min(slowest[at], speeds[layer]);
        }
        const std::size_t at = n * leaf_size + static_cast<std::size_t>(node);
        const std::size_t seen = exposed[at];
        if (dt > 0 && seen > 0 && speeds[seen] < 0) {
          find_depths(layers, surface_point(layers, n, node), depth);
          field.speed[at] = speed_through_layers(speeds, depth, seen, static_cast<float>(dt));
        } else {
          field.speed[at] = speeds[seen];
        }
      }
    }
  });
  field.is_inert.assign(layer_count, true);
  field.fastest_etch.assign(layer_count, 0);
  for (std::size_t n = 0; n < moves.size(); ++n) {
    const std::size_t layer = n % layer_count;
    field.is_inert[layer] = field.is_inert[layer] && moves[n] == 0;
    field.fastest_etch[layer] = std::max(field.fastest_etch[layer], fastest_etch(slowest[n]));
  }
  return field;
}

/// Speeds that depend on the normal: amplitude(position, exposed material) times one factor.
inline SpeedField prescribe_speeds(
    const Layers& layers, const AngularFactor& factor,
    const std::function<double(Vec3d r, MaterialId material)>& amplitude) {
  SpeedField field = prescribe_speeds(layers, amplitude);
  field.angular.push_back({factor, field.speed});
  std::fill(field.speed.begin(), field.speed.end(), 0.0F);
  const LimitingSpeed limiting_speed({&factor, 1});
  for (float& fastest : field.fastest_etch)
    fastest = fastest_etch(-limiting_speed(0, [&](std::size_t) { return fastest; }));
  return field;
}

inline std::vector<LayerSpeeds> without_normals(std::span<const CornerSpeeds> speeds_of_layers) {
  std::vector<LayerSpeeds> speeds;
  for (const CornerSpeeds& each : speeds_of_layers) speeds.push_back({.speed = each});
  return speeds;
}

/// From facets that lie as close to the surface as simplified ones.
inline SpeedField extend_speeds(const Layers& layers, const OpenGas& gas, const TriMesh& facets,
                                std::span<const CornerSpeeds> speeds_of_layers, double dt) {
  FacetTree tree(facets);
  return extend_speeds(layers, gas, tree, without_normals(speeds_of_layers), {}, dt,
                       close_facets * layers.frame.spacing);
}

/// Of all layers alike, so for any dt.
inline SpeedField extend_speeds(const Layers& layers, const OpenGas& gas, const TriMesh& facets,
                                const CornerSpeeds& speeds) {
  return extend_speeds(layers, gas, facets, std::vector<CornerSpeeds>(layers.stack.size(), speeds),
                       1);
}

inline double stable_time_step(const Layers& layers, std::span<const CornerSpeeds> speeds_of_layers,
                               double cfl) {
  return stable_time_step(layers, without_normals(speeds_of_layers), {}, cfl);
}

}  // namespace scarp

#include "levelset/motion/speed_field.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "levelset/grid/band.h"
#include "levelset/grid/exposure.h"

namespace scarp {

SpeedField prescribe_speeds(const Layers& layers,
                            const std::function<double(Vec3d r, MaterialId material)>& speed,
                            double dt) {
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
  update_max_speed(layers, field);
  return field;
}

SpeedField prescribe_speeds(const Layers& layers, const AngularFactor& factor,
                            const std::function<double(Vec3d r, MaterialId material)>& amplitude) {
  SpeedField field = prescribe_speeds(layers, amplitude);
  field.angular.push_back({factor, field.speed});
  std::fill(field.speed.begin(), field.speed.end(), 0.0F);
  const LimitingSpeed limiting_speed({&factor, 1});
  for (float& fastest : field.fastest_etch)
    fastest = fastest_etch(-limiting_speed(0, [&](std::size_t) { return fastest; }));
  update_max_speed(layers, field);
  return field;
}

float fastest_etch(float speed) {
  if (!(speed < 0)) return 0;
  constexpr float steps = 1024;
  int exponent = 0;
  const float mantissa = std::frexp(-speed, &exponent);
  return std::ldexp(std::ceil(mantissa * steps) / steps, exponent);
}

bool etches_crystal(const SpeedField& field) {
  return std::ranges::any_of(field.angular, [](const AngularSpeed& part) {
    return part.factor.has_cusps() &&
           std::ranges::any_of(part.amplitude, [](float size) { return size < 0; });
  });
}

void update_max_speed(const Layers& layers, SpeedField& field) {
  const auto& leaves = layers.top().band().leaves();
  std::vector<AngularFactor> factors;
  for (const AngularSpeed& part : field.angular) factors.push_back(part.factor);
  const LimitingSpeed limiting_speed(factors);
  field.max_speed = 0;
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    for (int node = 0; node < leaf_size; ++node) {
      if (std::abs(leaves[n].phi[node]) < 1) {
        const std::size_t at = n * leaf_size + static_cast<std::size_t>(node);
        const auto amplitude = [&](std::size_t k) { return field.angular[k].amplitude[at]; };
        const float speed = limiting_speed(field.speed[at], amplitude);
        field.max_speed = std::max(field.max_speed, speed);
      }
    }
  }
}

}  // namespace scarp

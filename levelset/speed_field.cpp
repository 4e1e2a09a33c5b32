#include "levelset/speed_field.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "levelset/band.h"

namespace scarp {

SpeedField prescribe_speeds(const Layers& layers,
                            const std::function<double(Vec3d r, MaterialId material)>& speed) {
  const Frame& frame = layers.frame;
  const Band& band = layers.top().band();
  SpeedField field;
  field.speed.resize(band.leaves().size() * leaf_size);
  parallel_for(band.leaves().size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const Leaf& leaf = band.leaves()[n];
      for (int node = 0; node < leaf_size; ++node) {
        if (std::abs(leaf.phi[node]) < LevelSet::half_width) {
          const int i = leaf.origin[0] + (node >> 6);
          const int j = leaf.origin[1] + ((node >> 3) & 7);
          const int k = leaf.origin[2] + (node & 7);
          const Vec3d r{frame.node_position(0, i), frame.node_position(1, j),
                        frame.node_position(2, k)};
          field.speed[n * leaf_size + node] =
              static_cast<float>(speed(r, material_at_node(layers, i, j, k)));
        }
      }
    }
  });
  update_max_speed(layers, field);
  return field;
}

void update_max_speed(const Layers& layers, SpeedField& field) {
  const auto& leaves = layers.top().band().leaves();
  field.max_speed = 0;
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    for (int node = 0; node < leaf_size; ++node) {
      if (std::abs(leaves[n].phi[node]) < 1) {
        field.max_speed = std::max(field.max_speed, std::abs(field.speed[n * leaf_size + node]));
      }
    }
  }
}

}  // namespace scarp

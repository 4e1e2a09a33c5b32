#include "levelset/grid/exposure.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "levelset/grid/carry.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 8;
constexpr std::uint16_t unknown = std::numeric_limits<std::uint16_t>::max();

/// Prefers what is nearer, then the lower layer: the same whatever the order of asking.
struct Candidate {
  float distance = std::numeric_limits<float>::infinity();
  std::uint16_t layer = unknown;

  void offer(float other_distance, std::uint16_t other) {
    if (other_distance < distance || (other_distance == distance && other < layer)) {
      *this = {other_distance, other};
    }
  }
};

/// The layer of the neighbour that is nearest to the surface, and nearer than the node itself.
float layer_of_neighbour(const float* phi, const float* layer) {
  float nearest = std::abs(*phi);
  float found = no_value;
  for (const std::ptrdiff_t stride : axis_strides) {
    for (const std::ptrdiff_t to : {-stride, stride}) {
      const float there = std::abs(phi[to]);
      const bool nearer = there < nearest || (there == nearest && layer[to] < found);
      if (nearer && there < std::abs(*phi) && layer[to] != no_value) {
        nearest = there;
        found = layer[to];
      }
    }
  }
  return found;
}

/// The layer that is seen where the top's surface cuts the edge between two nodes.
std::uint16_t seen_on_edge(const Layers& layers, const std::array<std::array<int, 3>, 2>& nodes,
                           const std::array<float, 2>& top) {
  const std::size_t solid = top[0] < 0 ? 0 : 1;
  bool reached = false;
  for (std::size_t layer = 0; layer + 1 < layers.stack.size(); ++layer) {
    const auto phi = [&](std::size_t end) {
      const auto [i, j, k] = nodes[end];
      return layers.stack[layer].phi.node(i, j, k);
    };
    const float within = phi(solid);
    reached = reached || within < 0;
    if (!reached) continue;
    if (within <= top[solid] + same_phi || phi(1 - solid) <= top[1 - solid] + same_phi)
      return static_cast<std::uint16_t>(layer);
  }
  return static_cast<std::uint16_t>(layers.stack.size() - 1);
}

}  // namespace

std::size_t layer_at(const Layers& layers, const std::array<int, 3>& node) {
  std::size_t layer = 0;
  while (!(layers.stack[layer].phi.node(node[0], node[1], node[2]) < 0)) ++layer;
  return layer;
}

std::uint16_t exposed_layer(const Layers& layers, std::array<int, 3> node, int axis) {
  std::array<int, 3> next = node;
  ++next[axis];
  const LevelSet& top = layers.top();
  return seen_on_edge(layers, {node, next},
                      {top.node(node[0], node[1], node[2]), top.node(next[0], next[1], next[2])});
}

std::uint16_t exposed_layer_next_to(const Layers& layers, std::array<int, 3> node,
                                    const float* phi) {
  if (layers.stack.size() == 1) {
    return 0;
  }
  Candidate best;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int step : {-1, 1}) {
      const float there = phi[step * axis_strides[axis]];
      if ((*phi < 0) == (there < 0)) {
        continue;
      }
      std::array<int, 3> next = node;
      next[axis] += step;
      best.offer(crossing(*phi, there), seen_on_edge(layers, {node, next}, {*phi, there}));
    }
  }
  return best.layer;
}

std::vector<std::uint16_t> exposed_layers(const Layers& layers) {
  const Band& band = layers.top().band();
  const std::size_t count = band.leaves().size() * leaf_size;
  if (layers.stack.size() == 1) {
    return std::vector<std::uint16_t>(count, 0);
  }
  std::vector<float> seen(count, no_value);
  parallel_for(band.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    Block block;
    for (std::size_t n = begin; n < end; ++n) {
      const Leaf& leaf = band.leaves()[n];
      gather<1>(
          band, n, [&](std::size_t m) -> const float* { return band.leaves()[m].phi; }, block);
      for_each_node(next_to_surface(leaf, block), [&](int node) {
        const int i = node >> 6;
        const int j = (node >> 3) & 7;
        const int k = node & 7;
        seen[n * leaf_size + static_cast<std::size_t>(node)] = exposed_layer_next_to(
            layers, {leaf.origin[0] + i, leaf.origin[1] + j, leaf.origin[2] + k},
            block.row(i, j) + k);
      });
    }
  });
  carry_outward(band, seen, each_of_row(layer_of_neighbour));
  std::vector<std::uint16_t> found(count);
  std::transform(seen.begin(), seen.end(), found.begin(), [&](float layer) {
    return static_cast<std::uint16_t>(layer == no_value ? layers.stack.size() - 1 : layer);
  });
  return found;
}

std::vector<bool> layers_within(const Layers& layers, float depth) {
  const Band& top = layers.top().band();
  std::vector<bool> found(layers.stack.size(), false);
  found.back() = true;
  for (std::size_t layer = 0; layer + 1 < layers.stack.size(); ++layer) {
    const Band& band = layers.stack[layer].phi.band();
    found[layer] = std::any_of(band.leaves().begin(), band.leaves().end(), [&](const Leaf& leaf) {
      const auto [i, j, k] = leaf.origin;
      const int other = top.find(i >> 3, j >> 3, k >> 3);
      for (int node = 0; other >= 0 && node < leaf_size; ++node) {
        const float above = top.leaves()[static_cast<std::size_t>(other)].phi[node];
        if (std::abs(above) < 1 && leaf.phi[node] - above < depth) {
          return true;
        }
      }
      return false;
    });
  }
  return found;
}

namespace {

/// phi of the first layer below the one that is seen at a node.
const LevelSet* layer_below(const Layers& layers, const Node& node, float top) {
  for (std::size_t layer = layers.stack.size() - 1; layer-- > 0;) {
    const LevelSet& phi = layers.stack[layer].phi;
    if (phi.node(node[0], node[1], node[2]) > top + same_phi) return &phi;
  }
  return nullptr;
}

// Above a corner of the layer below its phi is small as well, but does not grow along the normal of
// what is seen: looked at on the surface itself.
bool is_film(const Layers& layers, const LevelSet& below, std::size_t leaf, int node) {
  constexpr double least_cosine = 0.9;
  const Vec3d r = surface_point(layers, leaf, node);
  return dot(below.normal(r), layers.top().normal(r)) > least_cosine;
}

}  // namespace

double thinnest_film(const Layers& layers, float least) {
  constexpr float near_surface = 0.5F;
  constexpr float most = LevelSet::half_width - 1;
  struct Spot {
    float thickness;
    std::size_t leaf;
    int node;
  };
  const std::span<const Leaf> leaves = layers.top().band().leaves();
  std::vector<std::vector<Spot>> of_ranges((leaves.size() + grain - 1) / grain);
  parallel_for(leaves.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      for (int offset = 0; offset < leaf_size; ++offset) {
        const float top = leaves[n].phi[offset];
        if (std::abs(top) >= near_surface) continue;
        const Node node = node_at(leaves[n], offset);
        const LevelSet* const below = layer_below(layers, node, top);
        if (below == nullptr) continue;
        const float thickness = below->node(node[0], node[1], node[2]) - top;
        if (thickness < most) of_ranges[begin / grain].push_back({thickness, n, offset});
      }
    }
  });
  std::vector<Spot> spots;
  for (const std::vector<Spot>& each : of_ranges)
    spots.insert(spots.end(), each.begin(), each.end());
  // What is a film is dear to tell: asked from the thinnest one on, and only until one is.
  const auto is_thicker = [](const Spot& a, const Spot& b) { return a.thickness > b.thickness; };
  std::ranges::make_heap(spots, is_thicker);
  for (; !spots.empty(); spots.pop_back()) {
    std::ranges::pop_heap(spots, is_thicker);
    const auto [thickness, leaf, node] = spots.back();
    const Node at = node_at(leaves[leaf], node);
    const LevelSet& below = *layer_below(layers, at, leaves[leaf].phi[node]);
    if (is_film(layers, below, leaf, node))
      return std::max(thickness, least) * layers.frame.spacing;
  }
  return std::numeric_limits<double>::infinity();
}

Vec3d surface_point(const Layers& layers, std::size_t leaf, int node) {
  const Frame& frame = layers.frame;
  const Leaf& values = layers.top().band().leaves()[leaf];
  const Vec3d r = frame.node_position(node_at(values, node));
  return r - (values.phi[node] * frame.spacing) * layers.top().normal(r);
}

void find_depths(const Layers& layers, Vec3d surface_point, std::vector<float>& depth) {
  const double top = layers.top().distance(surface_point);
  depth.resize(layers.stack.size());
  for (std::size_t layer = 0; layer < layers.stack.size(); ++layer) {
    const double below = layers.stack[layer].phi.distance(surface_point) - top;
    depth[layer] = static_cast<float>(std::max(below, 0.0));
  }
  const auto no_thickness = static_cast<float>(same_phi * layers.frame.spacing);
  for (std::size_t layer = depth.size() - 1; layer > 0; --layer) {
    if (depth[layer - 1] < depth[layer] + no_thickness) {
      depth[layer - 1] = depth[layer];
    }
  }
}

float speed_through_layers(const std::vector<float>& speeds, const std::vector<float>& depth,
                           std::size_t exposed, float dt) {
  if (speeds[exposed] >= 0 || exposed == 0 || !(dt > 0)) {
    return speeds[exposed];
  }
  float left = dt;
  float moved = 0;
  std::size_t layer = exposed;
  for (; layer > 0; --layer) {
    // The highest of the lower layers is met first. One that is not there, like a mask where it is
    // open, takes no time even if it does not move.
    const float to_next = depth[layer - 1] - moved;
    if (!(to_next > 0)) {
      continue;
    }
    if (!(speeds[layer] < 0) || to_next >= left * -speeds[layer]) {
      break;
    }
    left -= to_next / -speeds[layer];
    moved = depth[layer - 1];
  }
  // A layer that would grow or stay stops the surface.
  moved += left * std::max(-speeds[layer], 0.0F);
  return -moved / dt;
}

}  // namespace scarp

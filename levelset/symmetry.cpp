#include "levelset/symmetry.h"

#include <algorithm>
#include <set>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/band.h"

namespace scarp {

namespace {

// The same level set on another frame: places(axis, node) are the new indices of an old node,
// origin(axis, node) the old one of a new node.
template <class Places, class Origin>
LevelSet rebuilt(const LevelSet& level_set, const Frame& frame, const Places& places,
                 const Origin& origin) {
  const Band& from = level_set.band();
  auto band = std::make_unique<Band>(frame);
  std::set<NewLeaf> leaves;
  for (const Leaf& leaf : from.leaves()) {
    const auto along = [&](int axis) {
      const int end = std::min(leaf.origin[axis] + leaf_edge, from.node_count(axis));
      std::set<int> found;
      for (int node = leaf.origin[axis]; node < end; ++node)
        for (const int place : places(axis, node)) found.insert(place / leaf_edge);
      return found;
    };
    for (const int x : along(0))
      for (const int y : along(1))
        leaves.insert({.origin = {x * leaf_edge, y * leaf_edge, leaf.origin[2]}});
  }
  band->change_leaves(std::vector<NewLeaf>(leaves.begin(), leaves.end()), {});
  parallel_for(band->leaves().size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const Leaf& leaf = band->leaves()[n];
      const int i_end = std::min(leaf.origin[0] + leaf_edge, band->node_count(0));
      const int j_end = std::min(leaf.origin[1] + leaf_edge, band->node_count(1));
      for (int i = leaf.origin[0]; i < i_end; ++i) {
        for (int j = leaf.origin[1]; j < j_end; ++j) {
          for (int k = leaf.origin[2]; k < leaf.origin[2] + leaf_edge; ++k)
            leaf.phi[leaf_offset(i, j, k)] = from.node(origin(0, i), origin(1, j), k);
        }
      }
    }
  });
  band->trim();
  return LevelSet(std::move(band));
}

template <class Rebuild>
Layers on_frame(const Layers& layers, const Frame& frame, const Rebuild& rebuild) {
  Layers result{.frame = frame, .stack = {}};
  for (const Layer& layer : layers.stack)
    result.stack.push_back({layer.material, rebuild(layer.phi)});
  return result;
}

bool is_mirror_symmetric(const LevelSet& level_set, int axis) {
  const Band& band = level_set.band();
  const int cells = level_set.frame().cells[axis];
  return std::ranges::all_of(band.leaves(), [&](const Leaf& leaf) {
    const int i_end = std::min(leaf.origin[0] + leaf_edge, band.node_count(0));
    const int j_end = std::min(leaf.origin[1] + leaf_edge, band.node_count(1));
    for (int i = leaf.origin[0]; i < i_end; ++i) {
      for (int j = leaf.origin[1]; j < j_end; ++j) {
        for (int k = leaf.origin[2]; k < leaf.origin[2] + leaf_edge; ++k) {
          const float image = axis == 0 ? band.node(cells - i, j, k) : band.node(i, cells - j, k);
          if (leaf.phi[leaf_offset(i, j, k)] != image) return false;
        }
      }
    }
    return true;
  });
}

}  // namespace

Frame half_of(const Frame& whole, std::array<bool, 2> planes) {
  Frame part = whole;
  for (int axis = 0; axis < 2; ++axis) {
    if (!planes[axis]) continue;
    SCARP_ASSERT(whole.cells[axis] % 2, ==, 0);
    part.half[axis] = true;
    part.cells[axis] /= 2;
  }
  return part;
}

Frame whole_of(const Frame& part) {
  Frame whole = part;
  for (int axis = 0; axis < 2; ++axis)
    if (part.half[axis]) whole.cells[axis] *= 2;
  whole.half = {};
  return whole;
}

bool is_mirror_symmetric(const Layers& layers, int axis) {
  SCARP_ASSERT(layers.frame.cells[axis] % 2, ==, 0);
  return std::ranges::all_of(
      layers.stack, [&](const Layer& layer) { return is_mirror_symmetric(layer.phi, axis); });
}

Layers half_of(const Layers& whole, std::array<bool, 2> planes) {
  const Frame part = half_of(whole.frame, planes);
  const auto places = [&](int axis, int node) -> std::vector<int> {
    if (!planes[axis]) return {node};
    if (node < part.cells[axis]) return {};
    return {node - part.cells[axis]};
  };
  const auto origin = [&](int axis, int node) {
    return planes[axis] ? part.cells[axis] + node : node;
  };
  return on_frame(whole, part,
                  [&](const LevelSet& phi) { return rebuilt(phi, part, places, origin); });
}

Layers with_images(const Layers& part) {
  const Frame whole = whole_of(part.frame);
  const auto places = [&](int axis, int node) -> std::vector<int> {
    if (!part.frame.half[axis]) return {node};
    return {part.frame.cells[axis] - node, part.frame.cells[axis] + node};
  };
  const auto origin = [&](int axis, int node) {
    return part.frame.half[axis] ? std::abs(node - part.frame.cells[axis]) : node;
  };
  return on_frame(part, whole,
                  [&](const LevelSet& phi) { return rebuilt(phi, whole, places, origin); });
}

WholeLayers::WholeLayers(const Layers& part) : part_(&part) {
  if (part.frame.images() > 1) built_ = with_images(part);
}

TriMesh with_images(const TriMesh& part, const Frame& frame) {
  TriMesh whole = part;
  for (int axis = 0; axis < 2; ++axis) {
    if (!frame.half[axis]) continue;
    const auto vertex_count = static_cast<std::uint32_t>(whole.vertices.size());
    const std::size_t facet_count = whole.triangles.size();
    std::vector<std::uint32_t> image(vertex_count);
    for (std::uint32_t v = 0; v < vertex_count; ++v) {
      Vec3f r = whole.vertices[v];
      if (r[axis] == 0) {
        image[v] = v;
        continue;
      }
      image[v] = static_cast<std::uint32_t>(whole.vertices.size());
      r[axis] = -r[axis];
      whole.vertices.push_back(r);
    }
    for (std::size_t f = 0; f < facet_count; ++f) {
      const auto [a, b, c] = whole.triangles[f];
      whole.triangles.push_back({image[a], image[c], image[b]});
    }
    const std::vector<MaterialId> materials = whole.materials;
    whole.materials.insert(whole.materials.end(), materials.begin(), materials.end());
  }
  return whole;
}

std::vector<float> with_images(std::span<const float> values, const Frame& frame) {
  std::vector<float> whole;
  for (int image = 0; image < frame.images(); ++image)
    whole.insert(whole.end(), values.begin(), values.end());
  return whole;
}

}  // namespace scarp

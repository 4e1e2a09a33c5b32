#include "levelset/grid/symmetry.h"

#include <algorithm>
#include <set>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/grid/band.h"

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
      Leaf& leaf = band->leaves()[n];
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

// image(i, j, k): of a node.
template <class Image>
bool is_its_own_image(const LevelSet& level_set, const Image& image) {
  const Band& band = level_set.band();
  return std::ranges::all_of(band.leaves(), [&](const Leaf& leaf) {
    const int i_end = std::min(leaf.origin[0] + leaf_edge, band.node_count(0));
    const int j_end = std::min(leaf.origin[1] + leaf_edge, band.node_count(1));
    for (int i = leaf.origin[0]; i < i_end; ++i) {
      for (int j = leaf.origin[1]; j < j_end; ++j) {
        for (int k = leaf.origin[2]; k < leaf.origin[2] + leaf_edge; ++k)
          if (leaf.phi[leaf_offset(i, j, k)] != image(i, j, k)) return false;
      }
    }
    return true;
  });
}

// Vertices of the image of a mesh, behind those that it has: on the plane they are the same.
template <class Image>
void add_image(TriMesh& mesh, const Image& image) {
  const auto vertex_count = static_cast<std::uint32_t>(mesh.vertices.size());
  const std::size_t facet_count = mesh.triangles.size();
  std::vector<std::uint32_t> image_of(vertex_count);
  for (std::uint32_t v = 0; v < vertex_count; ++v) {
    const Vec3f r = image(mesh.vertices[v]);
    image_of[v] = v;
    if (r == mesh.vertices[v]) continue;
    image_of[v] = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(r);
  }
  for (std::size_t f = 0; f < facet_count; ++f) {
    const auto [a, b, c] = mesh.triangles[f];
    mesh.triangles.push_back({image_of[a], image_of[c], image_of[b]});
  }
  const std::vector<MaterialId> materials = mesh.materials;
  mesh.materials.insert(mesh.materials.end(), materials.begin(), materials.end());
}

}  // namespace

Frame part_of(const Frame& whole, const MirrorPlanes& planes) {
  Frame part = whole;
  for (int axis = 0; axis < 2; ++axis) {
    if (!planes.across[axis]) continue;
    SCARP_ASSERT(whole.cells[axis] % 2, ==, 0);
    part.half[axis] = true;
    part.cells[axis] /= 2;
  }
  part.diagonal = planes.diagonal;
  return part;
}

Frame whole_of(const Frame& part) {
  Frame whole = part;
  for (int axis = 0; axis < 2; ++axis)
    if (part.half[axis]) whole.cells[axis] *= 2;
  whole.half = {};
  whole.diagonal = false;
  return whole;
}

bool is_mirror_symmetric(const Layers& layers, int axis) {
  SCARP_ASSERT(layers.frame.cells[axis] % 2, ==, 0);
  const int cells = layers.frame.cells[axis];
  return std::ranges::all_of(layers.stack, [&](const Layer& layer) {
    const Band& band = layer.phi.band();
    return is_its_own_image(layer.phi, [&](int i, int j, int k) {
      return axis == 0 ? band.node(cells - i, j, k) : band.node(i, cells - j, k);
    });
  });
}

bool is_diagonally_symmetric(const Layers& layers) {
  SCARP_ASSERT(layers.frame.cells[0], ==, layers.frame.cells[1]);
  return std::ranges::all_of(layers.stack, [](const Layer& layer) {
    return is_its_own_image(layer.phi,
                            [&](int i, int j, int k) { return layer.phi.band().node(j, i, k); });
  });
}

Layers part_of(const Layers& whole, const MirrorPlanes& planes) {
  const Frame part = part_of(whole.frame, planes);
  const auto places = [&](int axis, int node) -> std::vector<int> {
    if (!planes.across[axis]) return {node};
    if (node < part.cells[axis]) return {};
    return {node - part.cells[axis]};
  };
  const auto origin = [&](int axis, int node) {
    return planes.across[axis] ? part.cells[axis] + node : node;
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

void mirror_across_diagonal(const Band& band,
                            const std::function<float*(std::size_t leaf)>& values) {
  parallel_for(band.leaves().size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const auto [x, y, z] = band.leaves()[n].origin;
      if (y < x) continue;
      const int image = band.find(y >> 3, x >> 3, z >> 3);
      if (image < 0) continue;
      const float* const from = values(static_cast<std::size_t>(image));
      float* const to = values(n);
      for (int i = x; i < x + leaf_edge; ++i) {
        for (int j = std::max(y, i + 1); j < y + leaf_edge; ++j)
          std::copy_n(from + leaf_offset(j, i, z), leaf_edge, to + leaf_offset(i, j, z));
      }
    }
  });
}

void mirror_across_diagonal(const Band& band, std::span<float> values) {
  mirror_across_diagonal(band, [&](std::size_t n) { return &values[n * leaf_size]; });
}

TriMesh with_images(const TriMesh& part, const Frame& frame) {
  TriMesh whole = part;
  if (frame.diagonal) add_image(whole, [](Vec3f r) { return Vec3f{r.y, r.x, r.z}; });
  for (int axis = 0; axis < 2; ++axis) {
    if (!frame.half[axis]) continue;
    add_image(whole, [axis](Vec3f r) {
      r[axis] = -r[axis];
      return r;
    });
  }
  return whole;
}

std::vector<float> with_images(std::span<const float> values, const Frame& frame) {
  std::vector<float> whole;
  for (int image = 0; image < frame.facet_images(); ++image)
    whole.insert(whole.end(), values.begin(), values.end());
  return whole;
}

}  // namespace scarp

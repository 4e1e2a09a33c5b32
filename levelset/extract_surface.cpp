#include "levelset/extract_surface.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <unordered_map>

#include "core/parallel.h"
#include "levelset/band.h"
#include "levelset/cell_cases.h"
#include "levelset/exposure.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 16;

/// Vertices keep this distance, in spacings, from the nodes at the ends of their edge: then no
/// triangle has zero area.
constexpr float smallest_part = 1e-3F;

/// A vertex in a triangle list: the index of its cut edge, and whether it is the copy of that
/// vertex on the upper side of a periodic axis.
struct Corner {
  std::uint32_t vertex = 0;
  std::uint32_t copy = 0;  ///< bit 0: shifted along x, bit 1: along y
};

/// What one leaf adds to the mesh.
struct LeafSurface {
  std::vector<Vec3f> vertices;
  std::vector<std::uint16_t> exposed;  ///< per vertex, the layer that is seen there
  std::vector<std::array<Corner, 3>> triangles;
};

/// phi of the nodes of a leaf and of the next node along each axis.
struct CellBlock {
  float phi[9][9][9];
};

class Extraction {
 public:
  Extraction(const Band& band, const OpenGas* gas, const Layers* layers)
      : band_(band), gas_(gas), layers_(layers), surfaces_(band.leaves().size()) {}

  TriMesh run();

 private:
  void place_vertices(std::size_t n);
  void place_vertex(std::size_t n, std::array<int, 3> node, int axis, float phi, float next_phi);
  void make_triangles(std::size_t n);
  void make_cell(std::size_t n, std::array<int, 3> cell, int solid_mask);
  Corner corner(std::size_t n, std::array<int, 3> cell, int edge) const;
  bool is_cut(const Leaf& leaf) const;
  void gather_cells(const Leaf& leaf, CellBlock& block) const;
  TriMesh join() const;

  bool is_open(std::array<int, 3> node) const {
    if (gas_ == nullptr) {
      return true;
    }
    const int i = band_.fold(0, node[0]);
    const int j = band_.fold(1, node[1]);
    const int leaf = band_.find(i >> 3, j >> 3, node[2] >> 3);
    return gas_->is_open(static_cast<std::size_t>(leaf), leaf_offset(i, j, node[2]));
  }

  /// Material of a triangle: of the lowest layer that is seen at two of its corners at least.
  MaterialId material(std::array<std::uint16_t, 3> exposed) const {
    std::sort(exposed.begin(), exposed.end());
    return layers_->stack[exposed[1]].material;
  }

  const Band& band_;
  const OpenGas* gas_;
  const Layers* layers_;
  std::vector<LeafSurface> surfaces_;
  std::vector<std::int32_t>
      edge_vertex_;  ///< per leaf, node and axis: place in the leaf's vertices
  std::vector<std::uint32_t> first_vertex_;
};

bool Extraction::is_cut(const Leaf& leaf) const {
  // A leaf without a node nearer than sqrt(3) to the surface has no cell that it passes through.
  return std::any_of(leaf.phi, leaf.phi + leaf_size,
                     [](float phi) { return std::abs(phi) < 1.75F; });
}

void Extraction::gather_cells(const Leaf& leaf, CellBlock& block) const {
  const auto [i0, j0, k0] = leaf.origin;
  for (int i = 0; i < 9; ++i) {
    const int x = band_.fold(0, i0 + i);
    for (int j = 0; j < 9; ++j) {
      const int y = band_.fold(1, j0 + j);
      const int here = band_.find(x >> 3, y >> 3, k0 >> 3);
      const int above = band_.find(x >> 3, y >> 3, (k0 >> 3) + 1);
      const float* row = here >= 0 ? band_.leaves()[here].phi : missing_values(here);
      const float* next = above >= 0 ? band_.leaves()[above].phi : missing_values(above);
      std::memcpy(block.phi[i][j], row + leaf_offset(x, y, 0), 8 * sizeof(float));
      block.phi[i][j][8] = next[leaf_offset(x, y, 0)];
    }
  }
}

void Extraction::place_vertex(std::size_t n, std::array<int, 3> node, int axis, float phi,
                              float next_phi) {
  std::array<int, 3> gas_node = node;
  gas_node[axis] += phi < 0 ? 1 : 0;
  if (!is_open(gas_node)) {
    return;
  }
  const float part = std::clamp(crossing(phi, next_phi), smallest_part, 1 - smallest_part);
  std::array<double, 3> index{};
  for (int a = 0; a < 3; ++a) {
    index[a] = node[a] + (a == axis ? static_cast<double>(part) : 0.0);
  }
  const Frame& frame = band_.frame();
  LeafSurface& surface = surfaces_[n];
  edge_vertex_[(n * leaf_size + leaf_offset(node[0], node[1], node[2])) * 3 + axis] =
      static_cast<std::int32_t>(surface.vertices.size());
  surface.vertices.push_back({static_cast<float>(frame.node_position(0, index[0])),
                              static_cast<float>(frame.node_position(1, index[1])),
                              static_cast<float>(frame.node_position(2, index[2]))});
  if (layers_ != nullptr) {
    surface.exposed.push_back(exposed_layer(*layers_, node, axis));
  }
}

void Extraction::place_vertices(std::size_t n) {
  const Leaf& leaf = band_.leaves()[n];
  if (!is_cut(leaf)) {
    return;
  }
  CellBlock block;
  gather_cells(leaf, block);
  const Frame& frame = band_.frame();
  for (int i = 0; i < std::min(leaf_edge, band_.node_count(0) - leaf.origin[0]); ++i) {
    const bool has_x = leaf.origin[0] + i < frame.cells[0];
    for (int j = 0; j < std::min(leaf_edge, band_.node_count(1) - leaf.origin[1]); ++j) {
      const bool has_y = leaf.origin[1] + j < frame.cells[1];
      for (int k = 0; k < leaf_edge; ++k) {
        const float phi = block.phi[i][j][k];
        const std::array<float, 3> next{block.phi[i + 1][j][k], block.phi[i][j + 1][k],
                                        block.phi[i][j][k + 1]};
        const std::array<bool, 3> has{has_x, has_y, true};
        for (int axis = 0; axis < 3; ++axis) {
          if (has[axis] && (phi < 0) != (next[axis] < 0)) {
            place_vertex(n, {leaf.origin[0] + i, leaf.origin[1] + j, leaf.origin[2] + k}, axis, phi,
                         next[axis]);
          }
        }
      }
    }
  }
}

Corner Extraction::corner(std::size_t n, std::array<int, 3> cell, int edge) const {
  const int base = edge_corner(edge);
  std::array<int, 3> node{};
  Corner corner;
  for (int axis = 0; axis < 3; ++axis) {
    node[axis] = cell[axis] + ((base >> axis) & 1);
    if (axis < 2 && node[axis] >= band_.node_count(axis)) {
      node[axis] = band_.fold(axis, node[axis]);
      corner.copy |= 1U << axis;
    }
  }
  const auto& origin = band_.leaves()[n].origin;
  const bool here = corner.copy == 0 && (node[0] & ~7) == origin[0] &&
                    (node[1] & ~7) == origin[1] && (node[2] & ~7) == origin[2];
  const std::size_t leaf =
      here ? n : static_cast<std::size_t>(band_.find(node[0] >> 3, node[1] >> 3, node[2] >> 3));
  const std::int32_t local =
      edge_vertex_[(leaf * leaf_size + leaf_offset(node[0], node[1], node[2])) * 3 + edge / 4];
  corner.vertex = local < 0 ? ~0U : first_vertex_[leaf] + static_cast<std::uint32_t>(local);
  return corner;
}

void Extraction::make_cell(std::size_t n, std::array<int, 3> cell, int solid_mask) {
  const CellCase& how = cell_case(solid_mask);
  for (std::size_t loop = 0; loop < how.loops.size(); ++loop) {
    std::array<Corner, 12> corners;
    for (std::size_t c = 0; c < how.loops[loop].size(); ++c) {
      corners[c] = corner(n, cell, how.loops[loop][c]);
    }
    // All edges of a loop end in one piece of gas: closed for one is closed for all.
    if (corners[0].vertex == ~0U) {
      continue;
    }
    for (const auto& [a, b, c] : how.triangles[loop]) {
      surfaces_[n].triangles.push_back({corners[a], corners[b], corners[c]});
    }
  }
}

void Extraction::make_triangles(std::size_t n) {
  const Leaf& leaf = band_.leaves()[n];
  if (!is_cut(leaf)) {
    return;
  }
  CellBlock block;
  gather_cells(leaf, block);
  const Frame& frame = band_.frame();
  for (int i = 0; i < std::min(leaf_edge, frame.cells[0] - leaf.origin[0]); ++i) {
    for (int j = 0; j < std::min(leaf_edge, frame.cells[1] - leaf.origin[1]); ++j) {
      for (int k = 0; k < leaf_edge; ++k) {
        int mask = 0;
        for (int c = 0; c < 8; ++c) {
          mask |= (block.phi[i + (c & 1)][j + ((c >> 1) & 1)][k + (c >> 2)] < 0 ? 1 : 0) << c;
        }
        if (mask != 0 && mask != 255) {
          make_cell(n, {leaf.origin[0] + i, leaf.origin[1] + j, leaf.origin[2] + k}, mask);
        }
      }
    }
  }
}

/// Puts the parts together; copies on the upper periodic sides get vertices of their own.
TriMesh Extraction::join() const {
  TriMesh mesh;
  std::vector<std::uint16_t> exposed;
  for (const LeafSurface& surface : surfaces_) {
    mesh.vertices.insert(mesh.vertices.end(), surface.vertices.begin(), surface.vertices.end());
    exposed.insert(exposed.end(), surface.exposed.begin(), surface.exposed.end());
  }
  const Sides sides = band_.frame().sides();
  std::unordered_map<std::uint64_t, std::uint32_t> copies;
  const auto vertex = [&](Corner corner) {
    if (corner.copy == 0) {
      return corner.vertex;
    }
    const std::uint64_t key = (std::uint64_t{corner.copy} << 32) | corner.vertex;
    const auto [copy, is_new] =
        copies.try_emplace(key, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (is_new) {
      Vec3f r = mesh.vertices[corner.vertex];
      for (int axis = 0; axis < 2; ++axis) {
        if ((corner.copy >> axis & 1) != 0) {
          r[axis] = static_cast<float>(sides.upper[axis]);
        }
      }
      mesh.vertices.push_back(r);
      if (!exposed.empty()) {
        exposed.push_back(exposed[corner.vertex]);
      }
    }
    return copy->second;
  };
  for (const LeafSurface& surface : surfaces_) {
    for (const auto& [a, b, c] : surface.triangles) {
      const Triangle triangle{vertex(a), vertex(b), vertex(c)};
      mesh.triangles.push_back(triangle);
      if (layers_ != nullptr) {
        mesh.materials.push_back(
            material({exposed[triangle[0]], exposed[triangle[1]], exposed[triangle[2]]}));
      }
    }
  }
  return mesh;
}

TriMesh Extraction::run() {
  const std::size_t count = band_.leaves().size();
  edge_vertex_.assign(count * leaf_size * 3, -1);
  parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      place_vertices(n);
    }
  });
  first_vertex_.assign(count, 0);
  for (std::size_t n = 1; n < count; ++n) {
    first_vertex_[n] =
        first_vertex_[n - 1] + static_cast<std::uint32_t>(surfaces_[n - 1].vertices.size());
  }
  parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      make_triangles(n);
    }
  });
  return join();
}

}  // namespace

TriMesh extract_surface(const Layers& layers) {
  return Extraction(layers.top().band(), nullptr, &layers).run();
}

TriMesh extract_surface(const Layers& layers, const OpenGas& gas) {
  return Extraction(layers.top().band(), &gas, &layers).run();
}

TriMesh extract_surface(const LevelSet& phi) {
  return Extraction(phi.band(), nullptr, nullptr).run();
}

}  // namespace scarp

#include "levelset/extract_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <unordered_map>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/band.h"
#include "levelset/cell_cases.h"
#include "levelset/crease.h"
#include "levelset/exposure.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 16;

/// Vertices keep this distance, in spacings, from the nodes at the ends of their edge: then no
/// triangle has zero area.
constexpr float smallest_part = 1e-3F;

/// Nodes of a cell that the surface passes through are nearer than this: sqrt(3) spacings for a
/// distance, twice that next to a jump of the speed.
constexpr float far_from_surface = 3.5F;

/// A vertex as a leaf's triangles know it, before all leaves are put together.
struct Corner {
  static constexpr std::uint32_t none = ~0U;

  std::uint32_t vertex = none;  ///< index of a vertex on the grid, or in the leaf's own cells
  std::uint8_t copy = 0;        ///< upper side of a periodic axis: bit 0 shifted along x, 1 along y
  bool in_cell = false;
};

/// What one leaf adds to the mesh.
struct LeafSurface {
  std::vector<Vec3f> vertices;         ///< on edges and faces of the grid, shared with neighbours
  std::vector<std::uint16_t> exposed;  ///< per vertex, the layer that is seen there
  std::vector<std::pair<int, std::uint32_t>> face_vertices;  ///< key of a face, vertex; ordered
  std::vector<Vec3f> cell_vertices;                          ///< corners inside cells
  std::vector<std::uint16_t> cell_exposed;
  std::vector<std::array<Corner, 3>> triangles;
};

/// phi of the nodes of a leaf and of the next node along each axis.
struct CellBlock {
  float phi[9][9][9];

  float at(int i, int j, int k) const { return phi[i][j][k]; }

  /// Mixed second difference over the face from node (i, j, k), normal to an axis.
  float twist(int i, int j, int k, int normal) const {
    const int bi = normal == 2 ? 1 : 0;  // (normal + 1) % 3 is x
    const int bj = normal == 0 ? 1 : 0;
    const int bk = normal == 1 ? 1 : 0;
    const int ci = normal == 1 ? 1 : 0;  // (normal + 2) % 3 is x
    const int cj = normal == 2 ? 1 : 0;
    const int ck = normal == 0 ? 1 : 0;
    return std::abs((at(i, j, k) - at(i + bi, j + bj, k + bk)) -
                    (at(i + ci, j + cj, k + ck) - at(i + bi + ci, j + bj + cj, k + bk + ck)));
  }

  /// Whether one of the six faces of a cell may hold a corner.
  bool is_creased(int i, int j, int k) const {
    return twist(i, j, k, 0) >= least_twist || twist(i + 1, j, k, 0) >= least_twist ||
           twist(i, j, k, 1) >= least_twist || twist(i, j + 1, k, 1) >= least_twist ||
           twist(i, j, k, 2) >= least_twist || twist(i, j, k + 1, 2) >= least_twist;
  }
};

class Extraction {
 public:
  Extraction(const Band& band, const OpenGas* gas, const Layers* layers)
      : band_(band), gas_(gas), layers_(layers), surfaces_(band.leaves().size()) {}

  TriMesh run();

 private:
  using Node = std::array<int, 3>;

  // First pass: vertices where the surface cuts edges, and where creases cross faces.
  bool is_cut(const Leaf& leaf) const;
  void gather_cells(const Leaf& leaf, CellBlock& block) const;
  void place_vertices(std::size_t n);
  void place_at_node(std::size_t n, const CellBlock& block, Node local);
  void place_on_edge(std::size_t n, Node node, int axis, bool starts_solid);
  void place_on_face(std::size_t n, Node node, int normal);
  Vec3f position(std::array<double, 3> index) const;
  bool is_open(Node node) const;

  // Second pass: triangles.
  void make_triangles(std::size_t n);
  void make_cell(std::size_t n, Node cell, int solid_mask, bool creased);
  bool make_creased_loop(std::size_t n, Node cell, const std::vector<int>& edges,
                         const std::vector<int>& faces);
  Corner corner_in_cell(std::size_t n, Node cell, const std::vector<int>& edges,
                        std::uint16_t exposed);
  Corner on_edge(std::size_t n, Node cell, int edge) const;
  Corner on_face(std::size_t n, Node cell, int face) const;
  std::size_t stored_place(std::size_t n, Node& node, Corner& corner) const;

  // Third pass.
  TriMesh join() const;

  /// Material of a triangle: of the lowest layer that is seen at two of its corners at least.
  MaterialId material(std::array<std::uint16_t, 3> exposed) const {
    std::sort(exposed.begin(), exposed.end());
    return layers_->stack[exposed[1]].material;
  }

  const Band& band_;
  const OpenGas* gas_;
  const Layers* layers_;
  std::vector<LeafSurface> surfaces_;
  /// Per leaf, node and axis: place in the leaf's vertices, or no_vertex.
  static constexpr std::uint16_t no_vertex = 0xffff;
  std::vector<std::uint16_t> edge_vertex_;
  std::vector<std::uint32_t> first_vertex_;
};

bool Extraction::is_cut(const Leaf& leaf) const {
  return std::any_of(leaf.phi, leaf.phi + leaf_size,
                     [](float phi) { return std::abs(phi) < far_from_surface; });
}

void Extraction::gather_cells(const Leaf& leaf, CellBlock& block) const {
  const auto [i0, j0, k0] = leaf.origin;
  // Rows of a leaf column are looked up once; only the last one, or a folded one, is another leaf.
  std::array<const float*, 2> values{};
  std::array<int, 2> column{-1, -1};
  for (int i = 0; i < 9; ++i) {
    const int x = band_.fold(0, i0 + i);
    for (int j = 0; j < 9; ++j) {
      const int y = band_.fold(1, j0 + j);
      if (column != std::array<int, 2>{x >> 3, y >> 3}) {
        column = {x >> 3, y >> 3};
        for (int up = 0; up < 2; ++up) {
          const int found = band_.find(column[0], column[1], (k0 >> 3) + up);
          values[up] = found >= 0 ? band_.leaves()[found].phi : missing_values(found);
        }
      }
      const int offset = leaf_offset(x, y, 0);
      std::memcpy(block.phi[i][j], values[0] + offset, 8 * sizeof(float));
      block.phi[i][j][8] = values[1][offset];
    }
  }
}

bool Extraction::is_open(Node node) const {
  if (gas_ == nullptr) {
    return true;
  }
  const int i = band_.fold(0, node[0]);
  const int j = band_.fold(1, node[1]);
  const int leaf = band_.find(i >> 3, j >> 3, node[2] >> 3);
  return gas_->is_open(static_cast<std::size_t>(leaf), leaf_offset(i, j, node[2]));
}

Vec3f Extraction::position(std::array<double, 3> index) const {
  const Frame& frame = band_.frame();
  return {static_cast<float>(frame.node_position(0, index[0])),
          static_cast<float>(frame.node_position(1, index[1])),
          static_cast<float>(frame.node_position(2, index[2]))};
}

void Extraction::place_on_edge(std::size_t n, Node node, int axis, bool starts_solid) {
  Node gas_node = node;
  gas_node[axis] += starts_solid ? 1 : 0;
  if (!is_open(gas_node)) {
    return;
  }
  const float part = std::clamp(cut_part(band_, node, axis), smallest_part, 1 - smallest_part);
  std::array<double, 3> index{};
  for (int a = 0; a < 3; ++a) {
    index[a] = node[a] + (a == axis ? static_cast<double>(part) : 0.0);
  }
  LeafSurface& surface = surfaces_[n];
  edge_vertex_[(n * leaf_size + leaf_offset(node[0], node[1], node[2])) * 3 + axis] =
      static_cast<std::uint16_t>(surface.vertices.size());
  surface.vertices.push_back(position(index));
  surface.exposed.push_back(layers_ != nullptr ? exposed_layer(*layers_, node, axis) : 0);
}

void Extraction::place_on_face(std::size_t n, Node node, int normal) {
  const auto corner = face_corner(band_, node, normal);
  if (!corner) {
    return;
  }
  const int b = (normal + 1) % 3;
  const int c = (normal + 2) % 3;
  std::uint16_t exposed = 0;
  for (int m = 0; m < 4; ++m) {
    Node at = node;
    at[b] += m & 1;
    at[c] += m >> 1;
    if (!(band_.node(at[0], at[1], at[2]) < 0) && !is_open(at)) {
      return;
    }
  }
  if (layers_ != nullptr) {
    // The lower of what is seen at the face's two cuts.
    exposed = std::numeric_limits<std::uint16_t>::max();
    for (const int axis : {b, c}) {
      for (int m = 0; m < 2; ++m) {
        Node at = node;
        at[axis == b ? c : b] += m;
        Node next = at;
        ++next[axis];
        if ((band_.node(at[0], at[1], at[2]) < 0) != (band_.node(next[0], next[1], next[2]) < 0)) {
          exposed = std::min(exposed, exposed_layer(*layers_, at, axis));
        }
      }
    }
  }
  std::array<double, 3> index{};
  index[normal] = node[normal];
  index[b] = node[b] + static_cast<double>((*corner)[0]);
  index[c] = node[c] + static_cast<double>((*corner)[1]);
  LeafSurface& surface = surfaces_[n];
  surface.face_vertices.emplace_back(leaf_offset(node[0], node[1], node[2]) * 3 + normal,
                                     static_cast<std::uint32_t>(surface.vertices.size()));
  surface.vertices.push_back(position(index));
  surface.exposed.push_back(exposed);
}

void Extraction::place_vertices(std::size_t n) {
  const Leaf& leaf = band_.leaves()[n];
  if (!is_cut(leaf)) {
    return;
  }
  CellBlock block;
  gather_cells(leaf, block);
  const int i_count = std::min(leaf_edge, band_.node_count(0) - leaf.origin[0]);
  const int j_count = std::min(leaf_edge, band_.node_count(1) - leaf.origin[1]);
  for (int i = 0; i < i_count; ++i) {
    for (int j = 0; j < j_count; ++j) {
      for (int k = 0; k < leaf_edge; ++k) {
        if (std::abs(block.at(i, j, k)) < far_from_surface) {
          place_at_node(n, block, {i, j, k});
        }
      }
    }
  }
}

/// Vertices on the edges and faces that start at a node of the leaf.
void Extraction::place_at_node(std::size_t n, const CellBlock& block, Node local) {
  const auto [i, j, k] = local;
  const auto& origin = band_.leaves()[n].origin;
  const Node node{origin[0] + i, origin[1] + j, origin[2] + k};
  const Frame& frame = band_.frame();
  const std::array<bool, 3> has{node[0] < frame.cells[0], node[1] < frame.cells[1], true};
  const float phi = block.at(i, j, k);
  const std::array<float, 3> next{block.at(i + 1, j, k), block.at(i, j + 1, k),
                                  block.at(i, j, k + 1)};
  for (int axis = 0; axis < 3; ++axis) {
    if (has[axis] && (phi < 0) != (next[axis] < 0)) {
      place_on_edge(n, node, axis, phi < 0);
    }
  }
  for (int normal = 0; normal < 3; ++normal) {
    if (has[(normal + 1) % 3] && has[(normal + 2) % 3] &&
        block.twist(i, j, k, normal) >= least_twist) {
      place_on_face(n, node, normal);
    }
  }
}

/// Brings a node back into the domain and finds its leaf.
std::size_t Extraction::stored_place(std::size_t n, Node& node, Corner& corner) const {
  for (int axis = 0; axis < 2; ++axis) {
    if (node[axis] >= band_.node_count(axis)) {
      node[axis] = band_.fold(axis, node[axis]);
      corner.copy |= static_cast<std::uint8_t>(1U << axis);
    }
  }
  const Node leaf{node[0] & ~7, node[1] & ~7, node[2] & ~7};
  if (leaf == band_.leaves()[n].origin) {
    return n;
  }
  // The band holds every node of a cell that the surface passes through.
  const int found = band_.find(leaf[0] >> 3, leaf[1] >> 3, leaf[2] >> 3);
  SCARP_ASSERT(found, >=, 0);
  return static_cast<std::size_t>(found);
}

Corner Extraction::on_edge(std::size_t n, Node cell, int edge) const {
  const int base = edge_corner(edge);
  Node node{cell[0] + (base & 1), cell[1] + ((base >> 1) & 1), cell[2] + (base >> 2)};
  Corner corner;
  const std::size_t leaf = stored_place(n, node, corner);
  const std::uint16_t local =
      edge_vertex_[(leaf * leaf_size + leaf_offset(node[0], node[1], node[2])) * 3 + edge / 4];
  if (local != no_vertex) {
    corner.vertex = first_vertex_[leaf] + local;
  }
  return corner;
}

Corner Extraction::on_face(std::size_t n, Node cell, int face) const {
  Node node = cell;
  node[face / 2] += face % 2;
  Corner corner;
  const std::size_t leaf = stored_place(n, node, corner);
  const auto& list = surfaces_[leaf].face_vertices;
  const int key = leaf_offset(node[0], node[1], node[2]) * 3 + face / 2;
  const auto found = std::lower_bound(list.begin(), list.end(), std::pair{key, std::uint32_t{0}});
  if (found != list.end() && found->first == key) {
    corner.vertex = first_vertex_[leaf] + found->second;
  }
  return corner;
}

/// Where three faces or more meet inside a cell.
Corner Extraction::corner_in_cell(std::size_t n, Node cell, const std::vector<int>& edges,
                                  std::uint16_t exposed) {
  std::vector<Tangent> planes;
  Vec3d middle;
  for (const int edge : edges) {
    const int base = edge_corner(edge);
    const Node node{cell[0] + (base & 1), cell[1] + ((base >> 1) & 1), cell[2] + (base >> 2)};
    const int axis = edge / 4;
    Vec3d point{static_cast<double>(base & 1), static_cast<double>((base >> 1) & 1),
                static_cast<double>(base >> 2)};
    point[axis] += static_cast<double>(cut_part(band_, node, axis));
    planes.push_back({point, cut_normal(band_, node, axis)});
    middle += point;
  }
  middle = middle / static_cast<double>(edges.size());
  const Vec3d meeting = meeting_point(planes, middle);
  std::array<double, 3> index{};
  for (int axis = 0; axis < 3; ++axis) {
    index[axis] = cell[axis] + std::clamp(meeting[axis], 0.01, 0.99);
  }
  LeafSurface& surface = surfaces_[n];
  surface.cell_vertices.push_back(position(index));
  surface.cell_exposed.push_back(exposed);
  return {.vertex = static_cast<std::uint32_t>(surface.cell_vertices.size() - 1),
          .copy = 0,
          .in_cell = true};
}

/// Triangles of a loop that creases cross: they fan out from where a crease enters, so that it
/// becomes a chain of edges; from a corner inside if three or more creases meet.
///
/// Source: Ho et al. 2005 (cubical marching squares): sharp points are found on faces first.
bool Extraction::make_creased_loop(std::size_t n, Node cell, const std::vector<int>& edges,
                                   const std::vector<int>& faces) {
  std::array<Corner, 24> polygon;
  std::size_t count = 0;
  std::size_t crease_count = 0;
  std::size_t first_crease = 0;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    polygon[count++] = on_edge(n, cell, edges[e]);
    const Corner crease = on_face(n, cell, faces[e]);
    if (crease.vertex != Corner::none) {
      first_crease = crease_count++ == 0 ? count : first_crease;
      polygon[count++] = crease;
    }
  }
  if (crease_count == 0) {
    return false;
  }
  auto& triangles = surfaces_[n].triangles;
  if (crease_count >= 3) {
    const Corner corner = corner_in_cell(n, cell, edges, 0);
    for (std::size_t c = 0; c < count; ++c) {
      triangles.push_back({corner, polygon[c], polygon[(c + 1) % count]});
    }
    return true;
  }
  for (std::size_t c = 1; c + 1 < count; ++c) {
    triangles.push_back({polygon[first_crease], polygon[(first_crease + c) % count],
                         polygon[(first_crease + c + 1) % count]});
  }
  return true;
}

void Extraction::make_cell(std::size_t n, Node cell, int solid_mask, bool creased) {
  const CellCase& how = cell_case(solid_mask);
  for (std::size_t loop = 0; loop < how.loops.size(); ++loop) {
    std::array<Corner, 12> corners;
    for (std::size_t c = 0; c < how.loops[loop].size(); ++c) {
      corners[c] = on_edge(n, cell, how.loops[loop][c]);
    }
    // All edges of a loop end in one piece of gas: closed for one is closed for all.
    if (corners[0].vertex == Corner::none ||
        (creased && make_creased_loop(n, cell, how.loops[loop], how.faces[loop]))) {
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
          mask |= (block.at(i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2)) < 0 ? 1 : 0) << c;
        }
        if (mask == 0 || mask == 255) {
          continue;
        }
        make_cell(n, {leaf.origin[0] + i, leaf.origin[1] + j, leaf.origin[2] + k}, mask,
                  block.is_creased(i, j, k));
      }
    }
  }
}

/// Puts the parts together; copies on the upper periodic sides get vertices of their own.
TriMesh Extraction::join() const {
  TriMesh mesh;
  std::vector<std::uint16_t> exposed;
  std::vector<std::uint32_t> first_cell_vertex;
  for (const LeafSurface& surface : surfaces_) {
    mesh.vertices.insert(mesh.vertices.end(), surface.vertices.begin(), surface.vertices.end());
    exposed.insert(exposed.end(), surface.exposed.begin(), surface.exposed.end());
  }
  for (const LeafSurface& surface : surfaces_) {
    first_cell_vertex.push_back(static_cast<std::uint32_t>(mesh.vertices.size()));
    mesh.vertices.insert(mesh.vertices.end(), surface.cell_vertices.begin(),
                         surface.cell_vertices.end());
    exposed.insert(exposed.end(), surface.cell_exposed.begin(), surface.cell_exposed.end());
  }

  const Sides sides = band_.frame().sides();
  std::unordered_map<std::uint64_t, std::uint32_t> copies;
  const auto copied = [&](Corner corner) {
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
      exposed.push_back(exposed[corner.vertex]);
    }
    return copy->second;
  };
  for (std::size_t n = 0; n < surfaces_.size(); ++n) {
    for (const auto& corners : surfaces_[n].triangles) {
      Triangle triangle{};
      for (int c = 0; c < 3; ++c) {
        triangle[c] = corners[c].in_cell     ? first_cell_vertex[n] + corners[c].vertex
                      : corners[c].copy != 0 ? copied(corners[c])
                                             : corners[c].vertex;
      }
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
  edge_vertex_.assign(count * leaf_size * 3, no_vertex);
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

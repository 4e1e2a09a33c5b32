#include "levelset/extract_surface.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <unordered_map>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/band.h"
#include "levelset/cell_cases.h"
#include "levelset/crease.h"
#include "levelset/exposure.h"
#include "levelset/stencil.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 16;

/// Vertices keep this distance, in spacings, from the nodes at the ends of their edge: then no
/// triangle has zero area.
constexpr float smallest_part = 1e-3F;

/// A vertex as triangles know it before all parts are put together.
struct Corner {
  static constexpr std::uint32_t none = ~0U;
  static constexpr std::uint32_t in_cell = 4;

  std::uint32_t vertex;  ///< index of a vertex on the grid, or in cells of the same part
  std::uint32_t kind;    ///< upper side of a periodic axis: bit 0 shifted along x, 1 along y; or 4
};

/// Faces of a leaf's cells that hold a vertex, by their normal.
using FaceBits = std::array<LeafMask, 3>;

/// What a few leaves add to the mesh.
struct PartSurface {
  std::vector<Vec3f> vertices;         ///< on edges and faces of the grid, shared with neighbours
  std::vector<std::uint16_t> exposed;  ///< per vertex, the layer that is seen there
  std::vector<std::pair<int, std::uint32_t>> face_vertices;  ///< key of a face, vertex; ordered
  std::vector<Vec3f> cell_vertices;                          ///< corners inside cells
  std::vector<std::uint16_t> cell_exposed;
  std::vector<std::array<Corner, 3>> triangles;
};

SCARP_VECTOR_KERNEL void find_solid(const float* phi, LeafMask& solid) {
  for (int i = 0; i < leaf_edge; ++i) {
    std::uint64_t word = 0;
    for (int j = 0; j < leaf_edge; ++j) {
      const float* row = phi + leaf_offset(i, j, 0);
      std::uint32_t bits = 0;
      for (int k = 0; k < leaf_edge; ++k) {
        bits += row[k] < 0 ? 1U << k : 0U;
      }
      word |= std::uint64_t{bits} << (leaf_edge * j);
    }
    solid[i] = word;
  }
}

/// The nodes of a leaf and the next node along each axis: where each row of nodes is stored.
class CellRows {
 public:
  CellRows(const Band& band, const Leaf& leaf)
      : x_(band, 0, leaf.origin[0], 0, leaf_edge), y_(band, 1, leaf.origin[1], 0, leaf_edge) {
    for (int a = 0; a < x_.count; ++a) {
      for (int b = 0; b < y_.count; ++b) {
        for (int up = 0; up < 2; ++up) {
          leaves_[a][b][up] = band.find(x_.column[a], y_.column[b], (leaf.origin[2] >> 3) + up);
        }
      }
    }
  }

  /// The leaf that holds a row, and the one above it, as find gives them.
  const std::array<int, 2>& leaves(int i, int j) const { return leaves_[x_.place(i)][y_.place(j)]; }
  int offset(int i, int j) const { return leaf_offset(x_.offset(i), y_.offset(j), 0); }

 private:
  FoldedAxis x_;
  FoldedAxis y_;
  std::array<std::array<std::array<int, 2>, FoldedAxis::most>, FoldedAxis::most> leaves_;
};

/// Bit k of row (i, j) tells whether that node lies in the solid; nine nodes along each axis.
struct SolidRows {
  std::uint32_t row[9][9];

  /// Nodes of a row that lie on the other side than the next node along an axis.
  std::uint32_t cut(int i, int j, int axis) const {
    const std::uint32_t here = row[i][j];
    const std::uint32_t next = axis == 0 ? row[i + 1][j] : axis == 1 ? row[i][j + 1] : here >> 1;
    return (here ^ next) & 0xff;
  }

  /// Cells of a row whose corners lie on both sides.
  std::uint32_t cut_cells(int i, int j) const {
    const std::uint32_t any = row[i][j] | row[i][j + 1] | row[i + 1][j] | row[i + 1][j + 1];
    const std::uint32_t all = row[i][j] & row[i][j + 1] & row[i + 1][j] & row[i + 1][j + 1];
    return (any | any >> 1) & ~(all & all >> 1) & 0xff;
  }

  /// The corners of a cell that lie in the solid.
  int corners(int i, int j, int k) const {
    const auto pair = [&](int a, int b) {
      return static_cast<int>(row[i + a][j + b] >> k & 1) |
             static_cast<int>(row[i + a][j + b] >> (k + 1) & 1) << 4;
    };
    return pair(0, 0) | pair(1, 0) << 1 | pair(0, 1) << 2 | pair(1, 1) << 3;
  }
};

/// Calls visit(k) for every bit, from the lowest.
template <class Visit>
void for_each_bit(std::uint32_t bits, const Visit& visit) {
  for (; bits != 0; bits &= bits - 1) {
    visit(std::countr_zero(bits));
  }
}

/// A cell of a leaf that is being made into triangles.
struct Cell {
  std::size_t leaf;
  const CellRows& rows;
  std::array<int, 2> node_count;  ///< of the leaf
  bool near_crease;
  std::array<int, 3> local;

  /// Whether all its corners are stored in the leaf.
  bool is_inner() const {
    return local[0] + 1 < node_count[0] && local[1] + 1 < node_count[1] && local[2] + 1 < leaf_edge;
  }
};

/// From the place of a cell's lowest node to those of its edges, among the edges of a leaf.
constexpr std::array<int, 12> edge_steps = [] {
  std::array<int, 12> steps{};
  for (int edge = 0; edge < 12; ++edge) {
    const int corner = edge_corner(edge);
    steps[edge] = leaf_offset(corner & 1, corner >> 1 & 1, corner >> 2) * 3 + edge / 4;
  }
  return steps;
}();

/// A node as it is stored, and the Corner::kind of what lies at it.
struct Place {
  std::size_t leaf = 0;
  int node = 0;
  std::uint32_t copy = 0;
};

class Extraction {
 public:
  Extraction(const Band& band, const OpenGas* gas, const Layers* layers)
      : band_(band), gas_(gas), layers_(layers) {}

  TriMesh run();

 private:
  // First pass: vertices where the surface cuts edges, and where creases cross faces.
  bool gather_solid(const CellRows& rows, SolidRows& solid) const;
  void place_vertices(std::size_t n);
  void place_at_node(std::size_t n, const SolidRows& solid, Node local);
  float twist(const Leaf& leaf, Node node, int normal) const;
  void place_on_edge(std::size_t n, Node node, int axis, bool starts_solid);
  void place_on_face(std::size_t n, Node node, int normal);
  Vec3f position(std::array<double, 3> index) const;
  bool is_open(Node node) const;

  // Second pass: triangles.
  void make_triangles(std::size_t n);
  void make_cell(const Cell& cell, int solid_mask);
  bool make_creased_loop(const Cell& cell, const CellLoop& loop);
  Corner corner_in_cell(const Cell& cell, const CellLoop& loop, std::uint16_t exposed);
  void find_corners(const Cell& cell, const CellLoop& loop, std::array<Corner, 12>& corners) const;
  Corner on_edge(const Cell& cell, int edge) const;
  Corner on_face(const Cell& cell, int face) const;
  Place stored_place(const Cell& cell, int corner) const;
  bool has_creases(const CellRows& rows) const;

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
  const std::array<CellCase, 256>& cases_ = cell_cases();
  bool several_ = layers_ != nullptr && layers_->stack.size() > 1;
  PartSurface& part(std::size_t leaf) { return parts_[leaf / grain]; }
  const PartSurface& part(std::size_t leaf) const { return parts_[leaf / grain]; }
  int face_key(std::size_t leaf, int node, int normal) const {
    return (static_cast<int>(leaf % grain) * leaf_size + node) * 3 + normal;
  }

  std::vector<PartSurface> parts_;
  std::vector<std::uint32_t> first_vertex_;  ///< of every part
  std::vector<FaceBits> face_vertex_;        ///< of every leaf
  std::vector<std::uint8_t> has_creases_;
  std::vector<LeafMask> solid_;
  /// Per leaf, node and axis: place in the part's vertices, or no_vertex; only for edges that are
  /// cut. A part has less than 16 * 512 * 6 vertices.
  static constexpr std::uint16_t no_vertex = 0xffff;
  std::unique_ptr<std::uint16_t[]> edge_vertex_;
};

/// Tells whether the surface passes through a cell that starts in the leaf.
bool Extraction::gather_solid(const CellRows& rows, SolidRows& solid) const {
  static constexpr LeafMask gas{};
  static constexpr LeafMask full{~0ULL, ~0ULL, ~0ULL, ~0ULL, ~0ULL, ~0ULL, ~0ULL, ~0ULL};
  const auto bits = [&](int leaf) -> const LeafMask& {
    return leaf >= 0                     ? solid_[static_cast<std::size_t>(leaf)]
           : leaf == Band::missing_solid ? full
                                         : gas;
  };
  std::uint32_t any = 0;
  std::uint32_t all = ~0U;
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j < 9; ++j) {
      const auto [here, above] = rows.leaves(i, j);
      const int offset = rows.offset(i, j);
      const auto lower =
          static_cast<std::uint32_t>(bits(here)[offset >> 6] >> (offset & 63)) & 0xff;
      const auto upper = static_cast<std::uint32_t>(bits(above)[offset >> 6] >> (offset & 63)) & 1;
      solid.row[i][j] = lower | upper << 8;
      any |= solid.row[i][j];
      all &= solid.row[i][j];
    }
  }
  return any != 0 && (all & 0x1ff) != 0x1ff;
}

/// Mixed second difference of phi over the lower face of a cell, normal to an axis.
float Extraction::twist(const Leaf& leaf, Node node, int normal) const {
  const int b = (normal + 1) % 3;
  const int c = (normal + 2) % 3;
  if ((node[b] & 7) < 7 && (node[c] & 7) < 7 && node[0] + 1 < band_.node_count(0) &&
      node[1] + 1 < band_.node_count(1)) {
    const float* phi = leaf.phi + leaf_offset(node[0], node[1], node[2]);
    const int to_b = 1 << (6 - 3 * b);
    const int to_c = 1 << (6 - 3 * c);
    return std::abs((phi[0] - phi[to_b]) - (phi[to_c] - phi[to_b + to_c]));
  }
  const auto phi = [&](int step_b, int step_c) {
    Node at = node;
    at[b] += step_b;
    at[c] += step_c;
    return band_.node(at[0], at[1], at[2]);
  };
  return std::abs((phi(0, 0) - phi(1, 0)) - (phi(0, 1) - phi(1, 1)));
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
  PartSurface& surface = part(n);
  std::uint16_t& place =
      edge_vertex_[(n * leaf_size + leaf_offset(node[0], node[1], node[2])) * 3 + axis];
  Node gas_node = node;
  gas_node[axis] += starts_solid ? 1 : 0;
  if (!is_open(gas_node)) {
    place = no_vertex;
    return;
  }
  const float part = std::clamp(cut_part(band_, node, axis), smallest_part, 1 - smallest_part);
  std::array<double, 3> index{};
  for (int a = 0; a < 3; ++a) {
    index[a] = node[a] + (a == axis ? static_cast<double>(part) : 0.0);
  }
  place = static_cast<std::uint16_t>(surface.vertices.size());
  surface.vertices.push_back(position(index));
  surface.exposed.push_back(several_ ? exposed_layer(*layers_, node, axis) : 0);
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
  if (several_) {
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
  PartSurface& surface = part(n);
  const int offset = leaf_offset(node[0], node[1], node[2]);
  surface.face_vertices.emplace_back(face_key(n, offset, normal),
                                     static_cast<std::uint32_t>(surface.vertices.size()));
  face_vertex_[n][normal][offset >> 6] |= std::uint64_t{1} << (offset & 63);
  has_creases_[n] = 1;
  surface.vertices.push_back(position(index));
  surface.exposed.push_back(exposed);
}

void Extraction::place_vertices(std::size_t n) {
  const Leaf& leaf = band_.leaves()[n];
  const CellRows rows(band_, leaf);
  SolidRows solid;
  if (!gather_solid(rows, solid)) {
    return;
  }
  for (int i = 0; i < stored_nodes(band_, leaf, 0); ++i) {
    for (int j = 0; j < stored_nodes(band_, leaf, 1); ++j) {
      // What starts at a node lies in the cell that starts there, or on a face of it.
      for_each_bit(solid.cut_cells(i, j), [&](int k) { place_at_node(n, solid, {i, j, k}); });
    }
  }
}

/// Vertices on the edges and faces that start at a node of the leaf.
void Extraction::place_at_node(std::size_t n, const SolidRows& solid, Node local) {
  const auto [i, j, k] = local;
  const Leaf& leaf = band_.leaves()[n];
  const auto& origin = leaf.origin;
  const Node node{origin[0] + i, origin[1] + j, origin[2] + k};
  const Frame& frame = band_.frame();
  const std::array<bool, 3> has{node[0] < frame.cells[0], node[1] < frame.cells[1], true};
  for (int axis = 0; axis < 3; ++axis) {
    if (has[axis] && (solid.cut(i, j, axis) >> k & 1) != 0) {
      place_on_edge(n, node, axis, (solid.row[i][j] >> k & 1) != 0);
    }
  }
  // Bits of the corners of a cell that make up its lower face normal to an axis.
  static constexpr std::array<int, 3> face_corners{0x55, 0x33, 0x0f};
  const int corners = solid.corners(i, j, k);
  for (int normal = 0; normal < 3; ++normal) {
    const int on_face = corners & face_corners[normal];
    if (on_face != 0 && on_face != face_corners[normal] && has[(normal + 1) % 3] &&
        has[(normal + 2) % 3] && twist(leaf, node, normal) >= least_twist) {
      place_on_face(n, node, normal);
    }
  }
}

/// Where the corner of a cell is stored.
Place Extraction::stored_place(const Cell& cell, int corner) const {
  const int i = cell.local[0] + (corner & 1);
  const int j = cell.local[1] + (corner >> 1 & 1);
  const int k = cell.local[2] + (corner >> 2);
  if (i < cell.node_count[0] && j < cell.node_count[1] && k < leaf_edge) {
    return {cell.leaf, leaf_offset(i, j, k), 0};
  }
  // The band holds every node of a cell that the surface passes through.
  const int found = cell.rows.leaves(i, j)[k / leaf_edge];
  SCARP_ASSERT(found, >=, 0);
  const auto& origin = band_.leaves()[cell.leaf].origin;
  const bool over_x = origin[0] + i >= band_.node_count(0);
  const bool over_y = origin[1] + j >= band_.node_count(1);
  return {static_cast<std::size_t>(found), cell.rows.offset(i, j) | (k & 7),
          (over_x ? 1U : 0U) | (over_y ? 2U : 0U)};
}

Corner Extraction::on_edge(const Cell& cell, int edge) const {
  const Place place = stored_place(cell, edge_corner(edge));
  const std::uint16_t local =
      edge_vertex_[(place.leaf * leaf_size + static_cast<std::size_t>(place.node)) * 3 +
                   static_cast<std::size_t>(edge / 4)];
  return {local != no_vertex ? first_vertex_[place.leaf / grain] + local : Corner::none,
          place.copy};
}

Corner Extraction::on_face(const Cell& cell, int face) const {
  const int normal = face / 2;
  const Place place = stored_place(cell, (face % 2) << normal);
  if ((face_vertex_[place.leaf][normal][place.node >> 6] >> (place.node & 63) & 1) == 0) {
    return {Corner::none, 0};
  }
  const auto& list = part(place.leaf).face_vertices;
  const auto found =
      std::lower_bound(list.begin(), list.end(),
                       std::pair{face_key(place.leaf, place.node, normal), std::uint32_t{0}});
  return {first_vertex_[place.leaf / grain] + found->second, place.copy};
}

/// Where three faces or more meet inside a cell.
Corner Extraction::corner_in_cell(const Cell& cell, const CellLoop& loop, std::uint16_t exposed) {
  std::vector<Tangent> planes;
  Vec3d middle;
  const auto& origin = band_.leaves()[cell.leaf].origin;
  const Node lowest{origin[0] + cell.local[0], origin[1] + cell.local[1],
                    origin[2] + cell.local[2]};
  for (int e = 0; e < loop.edge_count; ++e) {
    const int base = edge_corner(loop.edges[e]);
    const Node node{lowest[0] + (base & 1), lowest[1] + ((base >> 1) & 1), lowest[2] + (base >> 2)};
    const int axis = loop.edges[e] / 4;
    Vec3d point{static_cast<double>(base & 1), static_cast<double>((base >> 1) & 1),
                static_cast<double>(base >> 2)};
    point[axis] += static_cast<double>(cut_part(band_, node, axis));
    planes.push_back({point, cut_normal(band_, node, axis)});
    middle += point;
  }
  middle = middle / static_cast<double>(loop.edge_count);
  const Vec3d meeting = meeting_point(planes, middle);
  std::array<double, 3> index{};
  for (int axis = 0; axis < 3; ++axis) {
    index[axis] = lowest[axis] + std::clamp(meeting[axis], 0.01, 0.99);
  }
  PartSurface& surface = part(cell.leaf);
  surface.cell_vertices.push_back(position(index));
  surface.cell_exposed.push_back(exposed);
  return {static_cast<std::uint32_t>(surface.cell_vertices.size() - 1), Corner::in_cell};
}

/// Triangles of a loop that creases cross: they fan out from where a crease enters, so that it
/// becomes a chain of edges; from a corner inside if three or more creases meet.
///
/// Source: Ho et al. 2005 (cubical marching squares): sharp points are found on faces first.
bool Extraction::make_creased_loop(const Cell& cell, const CellLoop& loop) {
  std::array<Corner, 24> polygon;
  std::size_t count = 0;
  std::size_t crease_count = 0;
  std::size_t first_crease = 0;
  for (int e = 0; e < loop.edge_count; ++e) {
    polygon[count++] = on_edge(cell, loop.edges[e]);
    const Corner crease = on_face(cell, loop.faces[e]);
    if (crease.vertex != Corner::none) {
      first_crease = crease_count++ == 0 ? count : first_crease;
      polygon[count++] = crease;
    }
  }
  if (crease_count == 0) {
    return false;
  }
  auto& triangles = part(cell.leaf).triangles;
  if (crease_count >= 3) {
    const Corner corner = corner_in_cell(cell, loop, 0);
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

void Extraction::find_corners(const Cell& cell, const CellLoop& loop,
                              std::array<Corner, 12>& corners) const {
  if (!cell.is_inner()) {
    for (int e = 0; e < loop.edge_count; ++e) {
      corners[e] = on_edge(cell, loop.edges[e]);
    }
    return;
  }
  const auto [i, j, k] = cell.local;
  const std::uint16_t* places =
      &edge_vertex_[(cell.leaf * leaf_size + static_cast<std::size_t>(leaf_offset(i, j, k))) * 3];
  const std::uint32_t first = first_vertex_[cell.leaf / grain];
  for (int e = 0; e < loop.edge_count; ++e) {
    const std::uint16_t place = places[edge_steps[loop.edges[e]]];
    corners[e] = {place != no_vertex ? first + place : Corner::none, 0};
  }
}

void Extraction::make_cell(const Cell& cell, int solid_mask) {
  const CellCase& how = cases_[solid_mask];
  for (int n = 0; n < how.loop_count; ++n) {
    const CellLoop& loop = how.loops[n];
    std::array<Corner, 12> corners{};
    find_corners(cell, loop, corners);
    // All edges of a loop end in one piece of gas: closed for one is closed for all.
    if (corners[0].vertex == Corner::none || (cell.near_crease && make_creased_loop(cell, loop))) {
      continue;
    }
    for (int t = 0; t < loop.triangle_count(); ++t) {
      const auto& [a, b, c] = loop.triangles[t];
      part(cell.leaf).triangles.push_back({corners[a], corners[b], corners[c]});
    }
  }
}

/// Whether a crease crosses a face of the leaf's cells.
bool Extraction::has_creases(const CellRows& rows) const {
  for (const int i : {0, leaf_edge}) {
    for (const int j : {0, leaf_edge}) {
      for (const int leaf : rows.leaves(i, j)) {
        if (leaf >= 0 && has_creases_[static_cast<std::size_t>(leaf)] != 0) {
          return true;
        }
      }
    }
  }
  return false;
}

void Extraction::make_triangles(std::size_t n) {
  const Leaf& leaf = band_.leaves()[n];
  const CellRows rows(band_, leaf);
  SolidRows solid;
  if (!gather_solid(rows, solid)) {
    return;
  }
  Cell cell{.leaf = n,
            .rows = rows,
            .node_count = {stored_nodes(band_, leaf, 0), stored_nodes(band_, leaf, 1)},
            .near_crease = has_creases(rows),
            .local = {}};
  const Frame& frame = band_.frame();
  for (int i = 0; i < std::min(leaf_edge, frame.cells[0] - leaf.origin[0]); ++i) {
    for (int j = 0; j < std::min(leaf_edge, frame.cells[1] - leaf.origin[1]); ++j) {
      for_each_bit(solid.cut_cells(i, j), [&](int k) {
        cell.local = {i, j, k};
        make_cell(cell, solid.corners(i, j, k));
      });
    }
  }
}

/// Puts the parts together; copies on the upper periodic sides get vertices of their own.
TriMesh Extraction::join() const {
  TriMesh mesh;
  std::vector<std::uint16_t> exposed;
  std::vector<std::uint32_t> first_cell_vertex;
  std::size_t vertex_count = 0;
  std::size_t triangle_count = 0;
  for (const PartSurface& surface : parts_) {
    vertex_count += surface.vertices.size() + surface.cell_vertices.size();
    triangle_count += surface.triangles.size();
  }
  mesh.vertices.reserve(vertex_count);
  exposed.reserve(vertex_count);
  mesh.triangles.reserve(triangle_count);
  mesh.materials.reserve(layers_ != nullptr ? triangle_count : 0);
  for (const PartSurface& surface : parts_) {
    mesh.vertices.insert(mesh.vertices.end(), surface.vertices.begin(), surface.vertices.end());
    exposed.insert(exposed.end(), surface.exposed.begin(), surface.exposed.end());
  }
  for (const PartSurface& surface : parts_) {
    first_cell_vertex.push_back(static_cast<std::uint32_t>(mesh.vertices.size()));
    mesh.vertices.insert(mesh.vertices.end(), surface.cell_vertices.begin(),
                         surface.cell_vertices.end());
    exposed.insert(exposed.end(), surface.cell_exposed.begin(), surface.cell_exposed.end());
  }

  const Sides sides = band_.frame().sides();
  std::unordered_map<std::uint64_t, std::uint32_t> copies;
  const auto copied = [&](Corner corner) {
    const std::uint64_t key = (std::uint64_t{corner.kind} << 32) | corner.vertex;
    const auto [copy, is_new] =
        copies.try_emplace(key, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (is_new) {
      Vec3f r = mesh.vertices[corner.vertex];
      for (int axis = 0; axis < 2; ++axis) {
        if ((corner.kind >> axis & 1) != 0) {
          r[axis] = static_cast<float>(sides.upper[axis]);
        }
      }
      mesh.vertices.push_back(r);
      exposed.push_back(exposed[corner.vertex]);
    }
    return copy->second;
  };
  for (std::size_t n = 0; n < parts_.size(); ++n) {
    for (const auto& corners : parts_[n].triangles) {
      Triangle triangle{};
      for (int c = 0; c < 3; ++c) {
        const auto& [vertex, kind] = corners[c];
        triangle[c] = kind == 0                 ? vertex
                      : kind == Corner::in_cell ? first_cell_vertex[n] + vertex
                                                : copied(corners[c]);
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
  edge_vertex_ = std::make_unique_for_overwrite<std::uint16_t[]>(count * leaf_size * 3);
  solid_.resize(count);
  face_vertex_.resize(count);
  has_creases_.resize(count);
  parts_.resize((count + grain - 1) / grain);
  parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      find_solid(band_.leaves()[n].phi, solid_[n]);
    }
  });
  parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      place_vertices(n);
    }
  });
  first_vertex_.assign(parts_.size(), 0);
  for (std::size_t n = 1; n < parts_.size(); ++n) {
    first_vertex_[n] =
        first_vertex_[n - 1] + static_cast<std::uint32_t>(parts_[n - 1].vertices.size());
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

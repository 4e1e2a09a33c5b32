#include "levelset/metrology/region_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/disjoint_sets.h"
#include "core/error.h"
#include "levelset/metrology/tet_cut.h"
#include "levelset/surface/extract_surface.h"

namespace scarp {

namespace {

using Cell = std::array<int, 3>;

constexpr std::uint32_t none = ~std::uint32_t{0};

/// Nodes nearer to a surface than this, in spacings, are moved onto it. Twice that is less than the
/// least altitude of a tetrahedron, 0.7: none turns over.
constexpr double reach = 0.25;

/// Bodies smaller than this, in cells, are no longer told from what surrounds them.
constexpr double least_body = 0.2;

/// The layers that add a material, and between which heights their surfaces lie.
struct Stack {
  std::vector<const Layer*> layers;
  double lower = 0;
  double upper = 0;

  int count() const { return static_cast<int>(layers.size()); }
};

Stack stack_of(const Layers& layers) {
  Stack stack;
  Box box;
  for (std::size_t k = 0; k < layers.stack.size(); ++k) {
    if (k > 0 && !adds_material(layers, k)) continue;
    stack.layers.push_back(&layers.stack[k]);
    const Box own = bounding_box(extract_surface(layers.stack[k].phi));
    box.add(own.lower);
    box.add(own.upper);
  }
  stack.lower = box.lower.z;
  stack.upper = box.upper.z;
  return stack;
}

/// Heights of the planes of nodes. Those of the grid where surfaces are; beyond, further and
/// further apart.
class Heights {
 public:
  Heights(const Stack& stack, double spacing, double bottom, double top) {
    constexpr double room = 3;  // spacings around the surfaces
    const int lowest =
        static_cast<int>(std::ceil(std::max(stack.lower / spacing - room, bottom / spacing + 0.5)));
    const int highest =
        static_cast<int>(std::floor(std::min(stack.upper / spacing + room, top / spacing - 0.5)));
    for (double z : graded(lowest * spacing, bottom, -spacing)) {
      z_.insert(z_.begin(), z);
      grid_.insert(grid_.begin(), below);
    }
    for (int k = lowest; k <= highest; ++k) {
      z_.push_back(k * spacing);
      grid_.push_back(k);
    }
    for (double z : graded(highest * spacing, top, spacing)) {
      z_.push_back(z);
      grid_.push_back(above);
    }
  }

  static constexpr int below = -1000000000;
  static constexpr int above = 1000000000;

  int count() const { return static_cast<int>(z_.size()); }
  double z(int k) const { return z_[static_cast<std::size_t>(k)]; }
  /// The plane of the grid, or below or above all surfaces.
  int grid(int k) const { return grid_[static_cast<std::size_t>(k)]; }

 private:
  static std::vector<double> graded(double from, double to, double step) {
    constexpr double growth = 1.25;
    std::vector<double> z;
    for (double next = from + step; std::abs(to - next) > 0.7 * std::abs(step); next += step) {
      if ((to - next) * step < 0) break;
      z.push_back(next);
      step *= growth;
    }
    z.push_back(to);
    return z;
  }

  std::vector<double> z_;
  std::vector<int> grid_;
};

/// Number of the sides between which the face of three vertices lies; nothing within the domain.
int side_of(const CutVertices& vertices, const std::array<std::uint32_t, 3>& face) {
  const unsigned common =
      vertices.sides(face[0]) & vertices.sides(face[1]) & vertices.sides(face[2]);
  for (int side = 0; side < RegionMesh::side_count; ++side)
    if ((common >> static_cast<unsigned>(side) & 1U) != 0) return side;
  return RegionMesh::nothing;
}

/// The cut of one wafer.
class RegionCut {
 public:
  RegionCut(const Layers& layers, const RegionOptions& options)
      : layers_(layers),
        frame_(layers.frame),
        stack_(stack_of(layers)),
        first_(frame_.axisymmetric ? frame_.cells[0] / 2 : 0),
        has_lid_(options.lid.has_value()),
        heights_(stack_, frame_.spacing, options.bottom, top_of(options)),
        vertices_(stack_.count(), thinnest_meshed_film) {
    nodes_ = {frame_.cells[0] + 1 - first_, frame_.cells[1] + 1, heights_.count()};
  }

  RegionMesh run() {
    label_nodes();
    find_mixed_cells();
    number_nodes();
    move_nodes();
    cut_cells();
    join_pieces();
    number_bodies();
    return mesh();
  }

 private:
  double top_of(const RegionOptions& options) const {
    constexpr double room = 4;  // spacings of gas that is not kept
    return options.lid.value_or(stack_.upper + room * frame_.spacing);
  }

  std::size_t node(const Cell& n) const {
    const auto at = [](int i) { return static_cast<std::size_t>(i); };
    return (at(n[2]) * at(nodes_[1]) + at(n[1])) * at(nodes_[0]) + at(n[0]);
  }
  std::size_t node_count() const { return node({0, 0, nodes_[2]}); }

  Vec3d position(const Cell& n) const {
    return {frame_.node_position(0, n[0] + first_), frame_.node_position(1, n[1]),
            heights_.z(n[2])};
  }

  std::uint8_t sides(const Cell& n) const {
    unsigned sides = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (n[axis] == 0) sides |= 1U << (2 * axis);
      if (n[axis] == nodes_[axis] - 1) sides |= 2U << (2 * axis);
    }
    return static_cast<std::uint8_t>(sides);
  }

  /// Calls do_it(node) for all nodes, or for the lowest nodes of all cells.
  template <class F>
  void for_each(int fewer, const F& do_it) const {
    for (int k = 0; k < nodes_[2] - fewer; ++k)
      for (int j = 0; j < nodes_[1] - fewer; ++j)
        for (int i = 0; i < nodes_[0] - fewer; ++i) do_it(Cell{i, j, k});
  }

  static Cell corner(const Cell& cell, unsigned n) {
    return {cell[0] + static_cast<int>(n & 1U), cell[1] + static_cast<int>(n >> 1U & 1U),
            cell[2] + static_cast<int>(n >> 2U)};
  }

  /// phi of the layers; a film that is too thin is none.
  void read_values(const Cell& n, std::vector<double>& values) const {
    const int grid = heights_.grid(n[2]);
    for (std::size_t m = 0; m < stack_.layers.size(); ++m) {
      constexpr double far = LevelSet::half_width;
      double value =
          grid == Heights::below ? -far
          : grid == Heights::above
              ? far
              : static_cast<double>(stack_.layers[m]->phi.node(n[0] + first_, n[1], grid));
      if (m > 0 && values[m - 1] - value < thinnest_meshed_film) value = values[m - 1];
      values[m] = value;
    }
  }

  int label_of(const std::vector<double>& values) const {
    int label = 0;
    while (label < stack_.count() && !(values[static_cast<std::size_t>(label)] < 0)) ++label;
    return label;
  }

  void label_nodes() {
    labels_.resize(node_count());
    std::vector<double> values(stack_.layers.size());
    for_each(0, [&](const Cell& n) {
      read_values(n, values);
      labels_[node(n)] = static_cast<std::uint8_t>(label_of(values));
    });
  }

  void find_mixed_cells() {
    is_mixed_.resize(node_count());
    for_each(1, [&](const Cell& cell) {
      for (unsigned n = 1; n < 8; ++n)
        if (labels_[node(corner(cell, n))] != labels_[node(cell)]) is_mixed_[node(cell)] = true;
    });
  }

  /// Nodes of mixed cells are vertices.
  void number_nodes() {
    numbers_.assign(node_count(), none);
    std::vector<double> values(stack_.layers.size());
    for_each(1, [&](const Cell& cell) {
      if (!is_mixed_[node(cell)]) return;
      for (unsigned n = 0; n < 8; ++n) vertex(corner(cell, n), values);
    });
  }

  std::uint32_t vertex(const Cell& n, std::vector<double>& values) {
    std::uint32_t& number = numbers_[node(n)];
    if (number != none) return number;
    read_values(n, values);
    number = vertices_.add(position(n), sides(n), values.data());
    grid_nodes_.push_back(n);
    is_moved_.push_back(false);
    return number;
  }

  /// Where the nearest surface cuts an edge of the lattice at a node.
  struct NearestCut {
    double distance = 0;
    std::uint32_t other = none;
    int surface = 0;
    double part = 0;
  };

  NearestCut nearest_cut(std::uint32_t v) const {
    NearestCut nearest{.distance = reach * frame_.spacing};
    // The edges of a cube's six tetrahedra go along one, two or all axes in one direction.
    for (int direction = -1; direction <= 1; direction += 2) {
      for (unsigned step = 1; step < 8; ++step) {
        Cell n = grid_nodes_[v];
        bool is_inside = true;
        for (unsigned axis = 0; axis < 3; ++axis) {
          if ((step >> axis & 1U) == 0) continue;
          n[axis] += direction;
          is_inside = is_inside && n[axis] >= 0 && n[axis] < nodes_[axis];
        }
        if (!is_inside) continue;
        const std::uint32_t other = numbers_[node(n)];
        if (other == none || (vertices_.sides(v) & ~vertices_.sides(other)) != 0) continue;
        look_along(v, other, nearest);
      }
    }
    return nearest;
  }

  void look_along(std::uint32_t v, std::uint32_t other, NearestCut& nearest) const {
    const double edge = length(vertices_.position(other) - vertices_.position(v));
    for (int m = 0; m < stack_.count(); ++m) {
      const double a = vertices_.value(v, m);
      const double b = vertices_.value(other, m);
      if ((a < 0) == (b < 0)) continue;
      const double part = a / (a - b);
      if (part * edge < nearest.distance)
        nearest = {.distance = part * edge, .other = other, .surface = m, .part = part};
    }
  }

  /// Where nodes and values go depends on where they were alone.
  void move_nodes() {
    CutVertices moved(stack_.count(), thinnest_meshed_film);
    std::vector<double> values(stack_.layers.size());
    for (std::uint32_t v = 0; v < vertices_.size(); ++v) {
      const NearestCut cut = nearest_cut(v);
      Vec3d r = vertices_.position(v);
      std::copy_n(vertices_.values(v), values.size(), values.begin());
      if (cut.other != none) {
        r += cut.part * (vertices_.position(cut.other) - r);
        values_between(vertices_.values(v), vertices_.values(cut.other), cut.part, cut.surface,
                       stack_.count(), thinnest_meshed_film, values.data());
        is_moved_[v] = true;
      }
      moved.add(r, vertices_.sides(v), values.data());
    }
    vertices_ = std::move(moved);
  }

  /// Three moved nodes could have a face between cells lie in a surface.
  bool is_cut(const Cell& cell) const {
    if (is_mixed_[node(cell)]) return true;
    int moved = 0;
    for (unsigned n = 0; n < 8; ++n) {
      const std::uint32_t v = numbers_[node(corner(cell, n))];
      moved += v != none && is_moved_[v] ? 1 : 0;
    }
    return moved >= 3;
  }

  /// The six tetrahedra of a cell lie around its diagonal: along three axes in any order.
  static constexpr std::array<std::array<unsigned, 4>, 6> tetrahedra{
      {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

  void cut_cells() {
    is_cut_.resize(node_count());
    for_each(1, [&](const Cell& cell) { is_cut_[node(cell)] = is_cut(cell); });
    number_other_nodes();
    for_each(1, [&](const Cell& cell) {
      if (!is_cut_[node(cell)]) return;
      for (const auto& tet : tetrahedra) {
        std::array<std::uint32_t, 4> v{};
        for (std::size_t n = 0; n < 4; ++n) v[n] = numbers_[node(corner(cell, tet[n]))];
        cut_tet(v, vertices_, tets_);
      }
    });
  }

  /// Those of cells that are cut and not mixed, and those of faces on sides. They come before all
  /// vertices that are no nodes.
  void number_other_nodes() {
    std::vector<double> values(stack_.layers.size());
    for_each(1, [&](const Cell& cell) {
      if (is_cut_[node(cell)]) {
        for (unsigned n = 0; n < 8; ++n) vertex(corner(cell, n), values);
        return;
      }
      for (const SideFace& face : side_faces(cell))
        for (const Cell& n : face.corners) vertex(n, values);
    });
  }

  struct SideFace {
    int side = 0;
    std::array<Cell, 4> corners;  ///< counter-clockwise seen from outside, a diagonal's end first
  };

  std::vector<SideFace> side_faces(const Cell& cell) const {
    std::vector<SideFace> faces;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      const std::size_t b = (a + 1) % 3;
      const std::size_t c = (a + 2) % 3;
      for (int upper = 0; upper < 2; ++upper) {
        if (cell[a] != (upper == 0 ? 0 : nodes_[a] - 2)) continue;
        SideFace face{.side = 2 * axis + upper, .corners = {cell, cell, cell, cell}};
        for (Cell& n : face.corners) n[a] += upper;
        ++face.corners[upper == 1 ? 1 : 3][b];
        ++face.corners[upper == 1 ? 3 : 1][c];
        ++face.corners[2][b];
        ++face.corners[2][c];
        faces.push_back(face);
      }
    }
    return faces;
  }

  struct Face {
    std::array<std::uint32_t, 3> sorted{};
    std::uint32_t tet = 0;
    std::uint32_t number = 0;

    bool is_same(const Face& other) const { return sorted == other.sorted; }
  };

  /// Face n of a tetrahedron lies opposite to vertex n, counter-clockwise seen from outside.
  static std::array<std::uint32_t, 3> face_of(const CutTet& tet, std::size_t n) {
    static constexpr std::array<std::array<std::size_t, 3>, 4> faces{
        {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
    return {tet.v[faces[n][0]], tet.v[faces[n][1]], tet.v[faces[n][2]]};
  }

  std::vector<Face> sorted_faces() const {
    std::vector<Face> faces;
    faces.reserve(4 * tets_.size());
    for (std::uint32_t t = 0; t < tets_.size(); ++t) {
      for (std::uint32_t n = 0; n < 4; ++n) {
        Face face{.sorted = face_of(tets_[t], n), .tet = t, .number = n};
        std::ranges::sort(face.sorted);
        faces.push_back(face);
      }
    }
    std::ranges::sort(faces, [](const Face& a, const Face& b) {
      return a.sorted != b.sorted ? a.sorted < b.sorted : a.tet < b.tet;
    });
    return faces;
  }

  /// The region of a label: materials in the order of the layers.
  int region_of(int label) const {
    if (label == stack_.count()) return gas_region();
    const MaterialId material = stack_.layers[static_cast<std::size_t>(label)]->material;
    return static_cast<int>(std::ranges::find(materials_, material) - materials_.begin());
  }
  int gas_region() const { return static_cast<int>(materials_.size()); }

  /// Pieces that share a face and a material are one body; so are a node within a material and all
  /// that it is a corner of. In the sets of pieces_ nodes come after the tetrahedra.
  void join_pieces() {
    for (const Layer* layer : stack_.layers)
      if (std::ranges::find(materials_, layer->material) == materials_.end())
        materials_.push_back(layer->material);
    faces_ = sorted_faces();
    pieces_ = DisjointSets(tets_.size() + node_count());
    for (std::size_t n = 0; n + 1 < faces_.size(); ++n) {
      if (!faces_[n].is_same(faces_[n + 1])) continue;
      const CutTet& a = tets_[faces_[n].tet];
      const CutTet& b = tets_[faces_[n + 1].tet];
      if (region_of(a.label) == region_of(b.label)) pieces_.join(faces_[n].tet, faces_[n + 1].tet);
    }
    for (std::uint32_t t = 0; t < tets_.size(); ++t)
      for (const std::uint32_t v : tets_[t].v)
        if (v < is_moved_.size() && !is_moved_[v]) pieces_.join(t, piece(grid_nodes_[v]));
    for_each(1, [&](const Cell& cell) {
      if (is_cut_[node(cell)]) return;
      const Cell inner = inner_node(cell);
      for (unsigned n = 0; n < 8; ++n)
        if (is_inner(corner(cell, n))) pieces_.join(piece(inner), piece(corner(cell, n)));
    });
  }

  std::uint32_t piece(const Cell& n) const {
    return static_cast<std::uint32_t>(tets_.size() + node(n));
  }
  bool is_inner(const Cell& n) const {
    const std::uint32_t v = numbers_[node(n)];
    return v == none || !is_moved_[v];
  }
  /// A node of a cell that is not cut; two at most were moved.
  Cell inner_node(const Cell& cell) const {
    unsigned n = 0;
    while (!is_inner(corner(cell, n))) ++n;
    return corner(cell, n);
  }

  double volume(const CutTet& tet) const {
    const Vec3d a = vertices_.position(tet.v[0]);
    const Vec3d b = vertices_.position(tet.v[1]) - a;
    return dot(b, cross(vertices_.position(tet.v[2]) - a, vertices_.position(tet.v[3]) - a)) / 6;
  }

  /// Small bodies become part of the one with which they share most of their surface.
  void absorb_small_bodies() {
    std::map<std::uint32_t, double> small;
    for (std::uint32_t t = 0; t < tets_.size(); ++t) small[pieces_.lowest(t)] += volume(tets_[t]);
    for (std::uint32_t v = 0; v < is_moved_.size(); ++v)
      if (!is_moved_[v]) small.erase(pieces_.lowest(piece(grid_nodes_[v])));
    const double h = frame_.spacing;
    std::erase_if(small, [&](const auto& body) { return body.second > least_body * h * h * h; });
    if (small.empty()) return;
    std::map<std::uint32_t, std::map<std::uint32_t, double>> shared;
    for_each_pair([&](const Face& face, const Face& other) {
      const std::uint32_t a = pieces_.lowest(face.tet);
      const std::uint32_t b = pieces_.lowest(other.tet);
      if (a == b) return;
      if (small.contains(a) && !small.contains(b)) shared[a][b] += area(face);
      if (small.contains(b) && !small.contains(a)) shared[b][a] += area(face);
    });
    std::map<std::uint32_t, std::uint32_t> into;  // bodies to one of its pieces
    for (const auto& [body, others] : shared)
      into[body] = std::ranges::max_element(others, {}, [](const auto& other) {
                     return other.second;
                   })->first;
    std::map<std::uint32_t, int> label;
    for (std::uint32_t t = 0; t < tets_.size(); ++t)
      label.try_emplace(pieces_.lowest(t), tets_[t].label);
    for (CutTet& tet : tets_) {
      const auto found = into.find(pieces_.lowest(static_cast<std::uint32_t>(&tet - tets_.data())));
      if (found != into.end()) tet.label = label.at(found->second);
    }
    for (const auto& [body, other] : into) pieces_.join(body, other);
  }

  double area(const Face& face) const {
    const Vec3d a = vertices_.position(face.sorted[0]);
    return length(
        cross(vertices_.position(face.sorted[1]) - a, vertices_.position(face.sorted[2]) - a));
  }

  template <class F>
  void for_each_pair(const F& do_it) const {
    for (std::size_t n = 0; n + 1 < faces_.size(); ++n)
      if (faces_[n].is_same(faces_[n + 1])) do_it(faces_[n], faces_[n + 1]);
  }

  void number_bodies() {
    absorb_small_bodies();
    for (std::uint32_t t = 0; t < tets_.size(); ++t) number_body(t, tets_[t].label);
    for_each(1, [&](const Cell& cell) {
      if (!is_cut_[node(cell)])
        number_body(piece(inner_node(cell)), labels_[node(inner_node(cell))]);
    });
    // Gas that the top does not belong to is closed in.
    const int open = bodies_.at(pieces_.lowest(piece({0, 0, nodes_[2] - 1})));
    bool has_voids = false;
    for (std::size_t n = 0; n < body_list_.size(); ++n) {
      if (body_list_[n].region != gas_region() || static_cast<int>(n) == open) continue;
      body_list_[n].region = gas_region() + 1;
      has_voids = true;
    }
    for (const MaterialId material : materials_)
      regions_.push_back({.kind = MeshRegion::Kind::material, .material = material});
    regions_.push_back({.kind = MeshRegion::Kind::gas, .is_meshed = has_lid_});
    if (has_voids)
      regions_.push_back({.kind = MeshRegion::Kind::closed_void, .is_meshed = has_lid_});
  }

  void number_body(std::uint32_t piece, int label) {
    const auto [place, is_new] =
        bodies_.try_emplace(pieces_.lowest(piece), static_cast<int>(body_list_.size()));
    if (is_new) body_list_.push_back({.region = region_of(label)});
  }

  int body_of(std::uint32_t piece) { return bodies_.at(pieces_.lowest(piece)); }

  bool is_kept(int body) const {
    const auto region = static_cast<std::size_t>(body_list_[static_cast<std::size_t>(body)].region);
    return regions_[region].is_meshed || frame_.is_section();
  }

  RegionMesh mesh() {
    RegionMesh mesh;
    mesh.is_flat = frame_.is_section();
    mesh.bodies = body_list_;
    mesh.regions = regions_;
    for (std::size_t n = 0; n < faces_.size(); ++n) {
      const bool is_second = n > 0 && faces_[n].is_same(faces_[n - 1]);
      if (is_second) continue;
      const bool is_pair = n + 1 < faces_.size() && faces_[n].is_same(faces_[n + 1]);
      if (is_pair) {
        add_interface(faces_[n], faces_[n + 1], mesh);
      } else {
        add_side(faces_[n], mesh);
      }
    }
    add_uncut_sides(mesh);
    if (mesh.is_flat) keep_front(mesh);
    keep_used_vertices(mesh);
    const Cell last{nodes_[0] - 1, nodes_[1] - 1, nodes_[2] - 1};
    for (int axis = 0; axis < 3; ++axis) {
      mesh.lower[static_cast<std::size_t>(axis)] = position({0, 0, 0})[axis];
      mesh.upper[static_cast<std::size_t>(axis)] = position(last)[axis];
    }
    return mesh;
  }

  void add_interface(const Face& face, const Face& other, RegionMesh& mesh) {
    const Face* behind = &face;
    const Face* front = &other;
    if (tets_[behind->tet].label > tets_[front->tet].label) std::swap(behind, front);
    const int a = body_of(behind->tet);
    const int b = body_of(front->tet);
    if (a == b) return;
    mesh.facets.push_back({.corners = face_of(tets_[behind->tet], behind->number),
                           .bodies = {a, b},
                           .layer = layer_index(tets_[behind->tet].label)});
  }

  void add_side(const Face& face, RegionMesh& mesh) {
    const CutTet& tet = tets_[face.tet];
    const std::array<std::uint32_t, 3> corners = face_of(tet, face.number);
    const int side = side_of(vertices_, corners);
    const int body = body_of(face.tet);
    if (side == RegionMesh::nothing || !is_kept(body)) return;
    mesh.facets.push_back({.corners = corners,
                           .bodies = {body, RegionMesh::nothing},
                           .side = side,
                           .layer = mesh.is_flat ? layer_index(tet.label) : RegionMesh::nothing});
  }

  /// Of a label among all layers.
  int layer_index(int label) const {
    if (label == stack_.count()) return static_cast<int>(layers_.stack.size());
    return static_cast<int>(stack_.layers[static_cast<std::size_t>(label)] - layers_.stack.data());
  }

  void add_uncut_sides(RegionMesh& mesh) {
    for_each(1, [&](const Cell& cell) {
      if (is_cut_[node(cell)]) return;
      for (const SideFace& face : side_faces(cell)) {
        const Cell inner = inner_node(cell);
        const int body = body_of(piece(inner));
        if (!is_kept(body)) continue;
        const auto number = [&](std::size_t n) { return numbers_[node(face.corners[n])]; };
        for (std::size_t n = 1; n < 3; ++n) {
          mesh.facets.push_back(
              {.corners = {number(0), number(n), number(n + 1)},
               .bodies = {body, RegionMesh::nothing},
               .side = face.side,
               .layer = mesh.is_flat ? layer_index(labels_[node(inner)]) : RegionMesh::nothing});
        }
      }
    });
  }

  /// A section is what is seen from the front of its slice.
  static void keep_front(RegionMesh& mesh) {
    constexpr int front = 2;
    std::erase_if(mesh.facets, [](const RegionMesh::Facet& facet) { return facet.side != front; });
    for (RegionMesh::Facet& facet : mesh.facets) facet.side = RegionMesh::nothing;
  }

  void keep_used_vertices(RegionMesh& mesh) const {
    std::vector<std::uint32_t> number(vertices_.size(), none);
    for (RegionMesh::Facet& facet : mesh.facets) {
      for (std::uint32_t& v : facet.corners) {
        if (number[v] == none) {
          number[v] = static_cast<std::uint32_t>(mesh.vertices.size());
          mesh.vertices.push_back(vertices_.position(v));
        }
        v = number[v];
      }
    }
  }

  const Layers& layers_;
  Frame frame_;
  Stack stack_;
  int first_;  ///< node of the grid at the lower side
  bool has_lid_;
  Heights heights_;
  CutVertices vertices_;
  Cell nodes_{};
  std::vector<std::uint8_t> labels_;    ///< of nodes
  std::vector<bool> is_mixed_;          ///< of cells, by their lowest nodes
  std::vector<bool> is_cut_;            ///< likewise
  std::vector<std::uint32_t> numbers_;  ///< of nodes that are vertices
  std::vector<Cell> grid_nodes_;        ///< of vertices that are nodes
  std::vector<bool> is_moved_;          ///< likewise
  std::vector<CutTet> tets_;
  std::vector<Face> faces_;
  DisjointSets pieces_{0};
  std::vector<MaterialId> materials_;
  std::map<std::uint32_t, int> bodies_;  ///< by the lowest piece
  std::vector<RegionMesh::Body> body_list_;
  std::vector<MeshRegion> regions_;
};

void check(const Layers& layers, const RegionOptions& options) {
  const Stack stack = stack_of(layers);
  const double h = layers.frame.spacing;
  if (!(options.bottom <= stack.lower - h)) {
    throw InputError(fmt::format(
        "the bottom at {:g} nm is not a spacing below the lowest surface, which goes down to "
        "{:g} nm",
        options.bottom, stack.lower));
  }
  if (options.lid && !(*options.lid >= stack.upper + h)) {
    throw InputError(fmt::format(
        "the lid at {:g} nm is not a spacing above the highest surface, which goes up to {:g} nm",
        *options.lid, stack.upper));
  }
}

}  // namespace

RegionMesh region_surface(const Layers& layers, const RegionOptions& options) {
  check(layers, options);
  return RegionCut(layers, options).run();
}

}  // namespace scarp

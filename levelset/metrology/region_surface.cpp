#include "levelset/metrology/region_surface.h"

#include <fmt/format.h>

#include <utility>

#include "core/error.h"
#include "levelset/metrology/region_bodies.h"
#include "levelset/metrology/region_cells.h"
#include "levelset/metrology/region_lattice.h"

namespace scarp {

namespace {

using Node = RegionLattice::Node;

/// Number of the sides between which the face of three vertices lies; nothing within the domain.
int side_of(const CutVertices& vertices, const std::array<std::uint32_t, 3>& face) {
  const unsigned common =
      vertices.sides(face[0]) & vertices.sides(face[1]) & vertices.sides(face[2]);
  for (int side = 0; side < RegionMesh::side_count; ++side)
    if ((common >> static_cast<unsigned>(side) & 1U) != 0) return side;
  return RegionMesh::nothing;
}

/// The faces between bodies and at the sides of the domain.
class RegionFaces {
 public:
  RegionFaces(const Layers& layers, const RegionLattice& lattice, const RegionCells& cells,
              const RegionBodies& bodies)
      : layers_(layers), lattice_(lattice), cells_(cells), bodies_(bodies) {}

  RegionMesh mesh() {
    mesh_.is_flat = lattice_.frame().is_section();
    mesh_.bodies = bodies_.bodies;
    mesh_.regions = bodies_.regions;
    for (int axis = 0; axis < 3; ++axis) {
      mesh_.lower[static_cast<std::size_t>(axis)] = lattice_.position({0, 0, 0})[axis];
      mesh_.upper[static_cast<std::size_t>(axis)] = lattice_.position(lattice_.last_node())[axis];
    }
    mesh_.is_periodic = {lattice_.is_periodic(0), lattice_.is_periodic(1)};
    add_faces();
    add_uncut_sides();
    if (mesh_.is_flat) keep_front();
    keep_used_vertices();
    return std::move(mesh_);
  }

 private:
  void add_faces() {
    const std::vector<TetFace>& faces = bodies_.faces;
    for (std::size_t n = 0; n < faces.size(); ++n) {
      const bool is_second = n > 0 && faces[n].is_same(faces[n - 1]);
      if (is_second) continue;
      const bool is_pair = n + 1 < faces.size() && faces[n].is_same(faces[n + 1]);
      if (is_pair) {
        add_interface(faces[n], faces[n + 1]);
      } else {
        add_side(faces[n]);
      }
    }
  }

  void add_interface(const TetFace& face, const TetFace& other) {
    const TetFace* behind = &face;
    const TetFace* front = &other;
    if (cells_.tets[behind->tet].label > cells_.tets[front->tet].label) std::swap(behind, front);
    const int a = bodies_.of_tets[behind->tet];
    const int b = bodies_.of_tets[front->tet];
    if (a == b) return;
    const CutTet& tet = cells_.tets[behind->tet];
    mesh_.facets.push_back(
        {.corners = corners_of(tet, *behind), .bodies = {a, b}, .layer = layer_index(tet.label)});
  }

  void add_side(const TetFace& face) {
    const CutTet& tet = cells_.tets[face.tet];
    const std::array<std::uint32_t, 3> corners = corners_of(tet, face);
    const int side = side_of(cells_.vertices, corners);
    const int body = bodies_.of_tets[face.tet];
    if (side == RegionMesh::nothing || !is_kept(body)) return;
    add_side(corners, body, side, tet.label);
  }

  void add_side(const std::array<std::uint32_t, 3>& corners, int body, int side, int label) {
    mesh_.facets.push_back({.corners = corners,
                            .bodies = {body, RegionMesh::nothing},
                            .side = side,
                            .layer = mesh_.is_flat ? layer_index(label) : RegionMesh::nothing});
  }

  bool is_kept(int body) const {
    const auto region =
        static_cast<std::size_t>(bodies_.bodies[static_cast<std::size_t>(body)].region);
    return bodies_.regions[region].is_meshed || mesh_.is_flat;
  }

  /// Of a label among all layers.
  int layer_index(int label) const {
    const MeshedStack& stack = lattice_.stack();
    if (label == stack.count()) return static_cast<int>(layers_.stack.size());
    return static_cast<int>(stack.layers[static_cast<std::size_t>(label)] - layers_.stack.data());
  }

  void add_uncut_sides() {
    lattice_.for_each_cell([&](const Node& cell) {
      if (cells_.is_cut[lattice_.index(cell)]) return;
      for (const RegionLattice::SideFace& face : lattice_.side_faces(cell)) {
        const std::size_t inner = lattice_.index(inner_corner(lattice_, cells_, cell));
        const int body = bodies_.of_nodes[inner];
        if (!is_kept(body)) continue;
        const auto number = [&](std::size_t n) {
          return cells_.numbers[lattice_.index(face.corners[n])];
        };
        for (std::size_t n = 1; n < 3; ++n)
          add_side({number(0), number(n), number(n + 1)}, body, face.side, cells_.labels[inner]);
      }
    });
  }

  /// A section is what is seen from the front of its slice.
  void keep_front() {
    constexpr int front = 2;
    std::erase_if(mesh_.facets, [](const RegionMesh::Facet& facet) { return facet.side != front; });
    for (RegionMesh::Facet& facet : mesh_.facets) facet.side = RegionMesh::nothing;
  }

  void keep_used_vertices() {
    constexpr std::uint32_t none = ~std::uint32_t{0};
    std::vector<std::uint32_t> number(cells_.vertices.size(), none);
    for (RegionMesh::Facet& facet : mesh_.facets) {
      for (std::uint32_t& v : facet.corners) {
        if (number[v] == none) {
          number[v] = static_cast<std::uint32_t>(mesh_.vertices.size());
          mesh_.vertices.push_back(cells_.vertices.position(v));
        }
        v = number[v];
      }
    }
  }

  const Layers& layers_;
  const RegionLattice& lattice_;
  const RegionCells& cells_;
  const RegionBodies& bodies_;
  RegionMesh mesh_;
};

void check(const Layers& layers, const RegionOptions& options) {
  const MeshedStack stack = meshed_stack(layers);
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
  const RegionLattice lattice(layers, options.bottom, options.lid);
  RegionCells cells = cut_cells(lattice);
  const RegionBodies bodies = find_bodies(lattice, cells, options.lid.has_value());
  return RegionFaces(layers, lattice, cells, bodies).mesh();
}

}  // namespace scarp

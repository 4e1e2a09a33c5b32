#include "levelset/metrology/region_bodies.h"

#include <algorithm>
#include <utility>

namespace scarp {

namespace {

using Node = RegionLattice::Node;

/// Bodies smaller than this, in cells, are no longer told from what surrounds them.
constexpr double least_body = 0.2;

std::array<std::uint32_t, 3> opposite_to(const CutTet& tet, std::size_t n) {
  static constexpr std::array<std::array<std::size_t, 3>, 4> faces{
      {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
  return {tet.v[faces[n][0]], tet.v[faces[n][1]], tet.v[faces[n][2]]};
}

std::vector<TetFace> sorted_faces(const std::vector<CutTet>& tets) {
  std::vector<TetFace> faces;
  faces.reserve(4 * tets.size());
  for (std::uint32_t t = 0; t < tets.size(); ++t) {
    for (std::uint32_t n = 0; n < 4; ++n) {
      TetFace face{.sorted = opposite_to(tets[t], n), .tet = t, .number = n};
      std::ranges::sort(face.sorted);
      faces.push_back(face);
    }
  }
  std::ranges::sort(faces, [](const TetFace& a, const TetFace& b) {
    return a.sorted != b.sorted ? a.sorted < b.sorted : a.tet < b.tet;
  });
  return faces;
}

double volume(const CutVertices& vertices, const CutTet& tet) {
  const Vec3d a = vertices.position(tet.v[0]);
  const Vec3d b = vertices.position(tet.v[1]) - a;
  return dot(b, cross(vertices.position(tet.v[2]) - a, vertices.position(tet.v[3]) - a)) / 6;
}

double area(const CutVertices& vertices, const TetFace& face) {
  const Vec3d a = vertices.position(face.sorted[0]);
  return length(
      cross(vertices.position(face.sorted[1]) - a, vertices.position(face.sorted[2]) - a));
}

/// Of each vertex on a side across an axis the one at the same place of the opposite side.
std::map<std::uint32_t, std::uint32_t> opposite_vertices(const CutVertices& vertices, int axis) {
  const unsigned lower = 1U << static_cast<unsigned>(2 * axis);
  std::map<std::pair<double, double>, std::uint32_t> at_lower;
  const auto place = [&](std::uint32_t v) {
    return std::pair(vertices.position(v)[1 - axis], vertices.position(v).z);
  };
  for (std::uint32_t v = 0; v < vertices.size(); ++v)
    if ((vertices.sides(v) & lower) != 0) at_lower[place(v)] = v;
  std::map<std::uint32_t, std::uint32_t> opposite;
  for (std::uint32_t v = 0; v < vertices.size(); ++v) {
    if ((vertices.sides(v) & 2 * lower) == 0) continue;
    const auto found = at_lower.find(place(v));
    if (found != at_lower.end()) opposite[v] = found->second;
  }
  return opposite;
}

/// Tetrahedra that share a face across periodic sides.
std::vector<std::array<std::uint32_t, 2>> neighbours_across(const RegionLattice& lattice,
                                                            const CutVertices& vertices,
                                                            const std::vector<TetFace>& faces) {
  std::vector<std::array<std::uint32_t, 2>> neighbours;
  for (int axis = 0; axis < 2; ++axis) {
    if (!lattice.is_periodic(axis)) continue;
    const std::map<std::uint32_t, std::uint32_t> opposite = opposite_vertices(vertices, axis);
    for (const TetFace& face : faces) {
      TetFace other;
      for (std::size_t n = 0; n < 3; ++n) {
        const auto v = opposite.find(face.sorted[n]);
        other.sorted[n] = v == opposite.end() ? RegionCells::none : v->second;
      }
      if (std::ranges::find(other.sorted, RegionCells::none) != other.sorted.end()) continue;
      std::ranges::sort(other.sorted);
      const auto found = std::ranges::lower_bound(faces, other.sorted, {}, &TetFace::sorted);
      if (found != faces.end() && found->is_same(other))
        neighbours.push_back({face.tet, found->tet});
    }
  }
  return neighbours;
}

/// The bodies of one cut.
class BodySearch {
 public:
  BodySearch(const RegionLattice& lattice, RegionCells& cells)
      : lattice_(lattice),
        cells_(cells),
        faces_(sorted_faces(cells.tets)),
        across_(neighbours_across(lattice, cells.vertices, faces_)),
        pieces_(0) {
    for (const Layer* layer : lattice.stack().layers)
      if (std::ranges::find(materials_, layer->material) == materials_.end())
        materials_.push_back(layer->material);
  }

  RegionBodies run(bool has_lid) {
    match_sides();
    join_pieces();
    absorb_small_bodies();
    number_bodies();
    name_regions(has_lid);
    found_.faces = std::move(faces_);
    return std::move(found_);
  }

 private:
  /// The region of a label: materials in the order of the layers.
  int region_of(int label) const {
    if (label == lattice_.stack().count()) return gas_region();
    const MaterialId material = lattice_.stack().layers[static_cast<std::size_t>(label)]->material;
    return static_cast<int>(std::ranges::find(materials_, material) - materials_.begin());
  }
  int gas_region() const { return static_cast<int>(materials_.size()); }

  /// In the sets of pieces_ nodes come after the tetrahedra.
  std::uint32_t piece(const Node& n) const {
    return static_cast<std::uint32_t>(cells_.tets.size() + lattice_.index(n));
  }

  template <class F>
  void for_each_pair(const F& do_it) const {
    for (std::size_t n = 0; n + 1 < faces_.size(); ++n)
      if (faces_[n].is_same(faces_[n + 1])) do_it(faces_[n], faces_[n + 1]);
  }

  /// A face on a periodic side may lie in an interface, with one material behind it and another
  /// one behind the same face of the opposite side: the smaller piece then becomes of that of the
  /// larger one.
  void match_sides() {
    for (const auto& [t, other] : across_) {
      CutTet& a = cells_.tets[t];
      CutTet& b = cells_.tets[other];
      const bool a_is_smaller = volume(cells_.vertices, a) < volume(cells_.vertices, b);
      (a_is_smaller ? a : b).label = (a_is_smaller ? b : a).label;
    }
  }

  void join_pieces() {
    pieces_ = DisjointSets(cells_.tets.size() + lattice_.node_count());
    for_each_pair([&](const TetFace& a, const TetFace& b) {
      if (region_of(cells_.tets[a.tet].label) == region_of(cells_.tets[b.tet].label))
        pieces_.join(a.tet, b.tet);
    });
    for (std::uint32_t t = 0; t < cells_.tets.size(); ++t)
      for (const std::uint32_t v : cells_.tets[t].v)
        if (v < cells_.nodes.size() && !cells_.is_moved[v]) pieces_.join(t, piece(cells_.nodes[v]));
    lattice_.for_each_cell([&](const Node& cell) {
      if (cells_.is_cut[lattice_.index(cell)]) return;
      const Node inner = inner_corner(lattice_, cells_, cell);
      for (unsigned n = 0; n < 8; ++n) {
        const Node corner = RegionLattice::corner(cell, n);
        if (cells_.is_inner(lattice_.index(corner))) pieces_.join(piece(inner), piece(corner));
      }
    });
  }

  /// Volumes of bodies that are small and have no node within them, by their lowest pieces.
  std::map<std::uint32_t, double> small_bodies(DisjointSets& pieces) const {
    std::map<std::uint32_t, double> small;
    for (std::uint32_t t = 0; t < cells_.tets.size(); ++t)
      small[pieces.lowest(t)] += volume(cells_.vertices, cells_.tets[t]);
    for (std::uint32_t v = 0; v < cells_.nodes.size(); ++v)
      if (!cells_.is_moved[v]) small.erase(pieces.lowest(piece(cells_.nodes[v])));
    const double h = lattice_.frame().spacing;
    std::erase_if(small, [&](const auto& body) { return body.second > least_body * h * h * h; });
    return small;
  }

  /// Small bodies become part of the one with which they share most of their surface. Here bodies
  /// go on across periodic sides, so that both sides stay alike.
  void absorb_small_bodies() {
    DisjointSets pieces = pieces_;
    for (const auto& [t, other] : across_) pieces.join(t, other);
    const std::map<std::uint32_t, double> small = small_bodies(pieces);
    if (small.empty()) return;
    std::map<std::uint32_t, std::map<std::uint32_t, double>> shared;
    for_each_pair([&](const TetFace& face, const TetFace& other) {
      const std::uint32_t a = pieces.lowest(face.tet);
      const std::uint32_t b = pieces.lowest(other.tet);
      if (a == b) return;
      if (small.contains(a) && !small.contains(b)) shared[a][b] += area(cells_.vertices, face);
      if (small.contains(b) && !small.contains(a)) shared[b][a] += area(cells_.vertices, face);
    });
    std::map<std::uint32_t, int> label;
    for (std::uint32_t t = 0; t < cells_.tets.size(); ++t)
      label.try_emplace(pieces.lowest(t), cells_.tets[t].label);
    for (std::uint32_t t = 0; t < cells_.tets.size(); ++t) {
      const auto around = shared.find(pieces.lowest(t));
      if (around == shared.end()) continue;
      const auto most = std::ranges::max_element(around->second, {},
                                                 [](const auto& other) { return other.second; });
      cells_.tets[t].label = label.at(most->first);
    }
    join_pieces();
  }

  void number_bodies() {
    found_.of_nodes.assign(lattice_.node_count(), RegionMesh::nothing);
    for (std::uint32_t t = 0; t < cells_.tets.size(); ++t)
      found_.of_tets.push_back(number(t, cells_.tets[t].label));
    lattice_.for_each_cell([&](const Node& cell) {
      if (cells_.is_cut[lattice_.index(cell)]) return;
      const Node inner = inner_corner(lattice_, cells_, cell);
      const std::size_t n = lattice_.index(inner);
      found_.of_nodes[n] = number(piece(inner), cells_.labels[n]);
    });
    // The top belongs to the gas, also where cells there are cut.
    const Node top{0, 0, lattice_.last_node()[2]};
    found_.of_nodes[lattice_.index(top)] = numbers_.at(pieces_.lowest(piece(top)));
  }

  int number(std::uint32_t piece, int label) {
    const auto [place, is_new] =
        numbers_.try_emplace(pieces_.lowest(piece), static_cast<int>(found_.bodies.size()));
    if (is_new) found_.bodies.push_back({.region = region_of(label)});
    return place->second;
  }

  /// Gas that the top does not belong to is closed in.
  void name_regions(bool has_lid) {
    const int open = found_.of_nodes[lattice_.index({0, 0, lattice_.last_node()[2]})];
    bool has_voids = false;
    for (std::size_t n = 0; n < found_.bodies.size(); ++n) {
      if (found_.bodies[n].region != gas_region() || static_cast<int>(n) == open) continue;
      found_.bodies[n].region = gas_region() + 1;
      has_voids = true;
    }
    for (const MaterialId material : materials_)
      found_.regions.push_back({.kind = MeshRegion::Kind::material, .material = material});
    found_.regions.push_back({.kind = MeshRegion::Kind::gas, .is_meshed = has_lid});
    if (has_voids)
      found_.regions.push_back({.kind = MeshRegion::Kind::closed_void, .is_meshed = has_lid});
  }

  const RegionLattice& lattice_;
  RegionCells& cells_;
  std::vector<TetFace> faces_;
  /// Tetrahedra that share a face across periodic sides.
  std::vector<std::array<std::uint32_t, 2>> across_;
  DisjointSets pieces_;
  std::vector<MaterialId> materials_;
  std::map<std::uint32_t, int> numbers_;  ///< of bodies, by their lowest pieces
  RegionBodies found_;
};

}  // namespace

std::array<std::uint32_t, 3> corners_of(const CutTet& tet, const TetFace& face) {
  return opposite_to(tet, face.number);
}

RegionBodies find_bodies(const RegionLattice& lattice, RegionCells& cells, bool has_lid) {
  return BodySearch(lattice, cells).run(has_lid);
}

}  // namespace scarp

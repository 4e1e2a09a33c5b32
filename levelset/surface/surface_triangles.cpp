#include "levelset/surface/surface_triangles.h"

#include <algorithm>

#include "core/error.h"

namespace scarp {

namespace {

/// The triangles of a case of all loops, as edges of the cell. Few bytes, so that all cases stay in
/// the nearest cache.
struct CaseTriangles {
  std::uint8_t count = 0;
  std::array<std::array<std::uint8_t, 3>, 10> edges{};
};

std::array<CaseTriangles, 256> make_case_triangles() {
  std::array<CaseTriangles, 256> all{};
  for (int mask = 0; mask < 256; ++mask) {
    const CellCase& how = cell_cases()[mask];
    for (int n = 0; n < how.loop_count; ++n) {
      const CellLoop& loop = how.loops[n];
      for (int t = 0; t < loop.triangle_count(); ++t) {
        auto& edges = all[mask].edges[all[mask].count++];
        for (int c = 0; c < 3; ++c) edges[c] = loop.edges[loop.triangles[t][c]];
      }
    }
  }
  return all;
}

const std::array<CaseTriangles, 256>& case_triangles() {
  static const std::array<CaseTriangles, 256> all = make_case_triangles();
  return all;
}

}  // namespace

/// From the place of a cell to those of its edges and faces.
const std::array<int, 12> TriangleMaker::edge_places = [] {
  std::array<int, 12> places{};
  for (int edge = 0; edge < 12; ++edge) {
    const int corner = edge_corner(edge);
    places[edge] = place(corner & 1, corner >> 1 & 1, corner >> 2) + edge / 4;
  }
  return places;
}();

const std::array<int, 6> TriangleMaker::face_places = [] {
  std::array<int, 6> places{};
  for (int face = 0; face < 6; ++face) {
    places[face] = face % 2 * strides[face / 2] + 3 + face / 2;
  }
  return places;
}();

struct TriangleMaker::Cell {
  Node node;
  int place;

  std::uint32_t on_edge(const TriangleMaker& maker, int edge) const {
    return maker.corner(place + edge_places[edge]);
  }
  std::uint32_t on_face(const TriangleMaker& maker, int face) const {
    return maker.corner(place + face_places[face]);
  }
};

void TriangleMaker::add_leaf(std::size_t n, PartTriangles& part) {
  const CellLeaves leaves(band_, n);
  const CellWords words(leaves, vertices_.solid());
  std::uint64_t any = 0;
  for (int i = 0; i < leaf_edge; ++i) any |= words.cut_cells(i);
  if (any == 0) return;

  bool creased = false;
  for (const int upper : {0, 1, 2, 4}) {
    const int leaf = leaves.leaf[upper];
    creased = creased || (leaf >= 0 && vertices_.of_leaf(static_cast<std::size_t>(leaf)).has_faces);
  }
  if (creased) corners_.fill(Corner::none);
  number_own(leaves);
  for (int upper = 1; upper < 7; ++upper) number_upper(leaves, upper);
  part.plain = part.plain && leaves.wrapped == 0;
  if (creased) {
    add_creased(leaves, words, part);
  } else {
    add_smooth(leaves, words, part);
  }
}

void TriangleMaker::number_own(const CellLeaves& leaves) {
  const auto n = static_cast<std::size_t>(leaves.leaf[0]);
  const LeafVertices& vertices = vertices_.of_leaf(n);
  if (!vertices.any) return;
  const int kinds = vertices.kinds_used();
  std::uint32_t next = vertices_.first_of_part(n / leaves_per_part) + vertices.first[0];
  for (int i = 0; i < leaf_edge; ++i) {
    for_each_bit(vertices.nodes(i), [&](int bit) {
      std::uint32_t* corners = &corners_[static_cast<std::size_t>(place(i, bit >> 3, bit & 7))];
      for (int kind = 0; kind < kinds; ++kind) {
        const auto has = static_cast<std::uint32_t>(vertices.at[kind][i] >> bit & 1);
        corners[kind] = kind < 3 || has != 0 ? next : Corner::none;
        next += has;
      }
    });
  }
}

/// What the leaf's cells share with one of the upper leaves: with a neighbour across a face edges
/// and faces in it, with one across an edge of the leaf edges along it.
void TriangleMaker::number_upper(const CellLeaves& leaves, int upper) {
  if (leaves.leaf[upper] < 0) return;
  const auto n = static_cast<std::size_t>(leaves.leaf[upper]);
  const LeafVertices& vertices = vertices_.of_leaf(n);
  if (!vertices.any) return;
  const std::uint32_t first = vertices_.first_of_part(n / leaves_per_part);
  const auto copy = static_cast<std::uint32_t>(leaves.wrapped & upper);
  const bool x = (upper & 1) != 0;
  const bool y = (upper & 2) != 0;
  const bool z = (upper & 4) != 0;
  const std::uint64_t nodes = (y ? 0xffULL : ~0ULL) & (z ? 0x0101010101010101ULL : ~0ULL);
  const int origin = place(x ? leaves.nodes[0] : 0, y ? leaves.nodes[1] : 0, z ? leaf_edge : 0);
  for (int kind = 0; kind < vertices.kinds_used(); ++kind) {
    const bool shared = kind < 3 ? (upper >> kind & 1) == 0 : upper == 1 << (kind - 3);
    if (!shared) continue;
    for (int i = 0; i < (x ? 1 : leaf_edge); ++i) {
      for_each_bit(vertices.at[kind][i] & nodes, [&](int bit) {
        corner(origin + place(i, bit >> 3, bit & 7) + kind) =
            Corner::of(copy, first + vertices.number(kind, i, bit));
      });
    }
  }
}

void TriangleMaker::add_smooth(const CellLeaves& leaves, const CellWords& words,
                               PartTriangles& part) {
  const auto& cases = case_triangles();
  for (int i = 0; i < leaves.cells[0]; ++i) {
    for_each_bit(words.cut_cells(i), [&](int bit) {
      const CaseTriangles& how = cases[static_cast<std::size_t>(words.corners(i, bit))];
      const std::uint32_t* corners = &corner(place(i, bit >> 3, bit & 7));
      for (int t = 0; t < how.count; ++t) {
        const auto& [a, b, c] = how.edges[t];
        part.triangles.push_back(
            {corners[edge_places[a]], corners[edge_places[b]], corners[edge_places[c]]});
      }
    });
  }
}

void TriangleMaker::add_creased(const CellLeaves& leaves, const CellWords& words,
                                PartTriangles& part) {
  const Leaf& leaf = band_.leaves()[static_cast<std::size_t>(leaves.leaf[0])];
  for (int i = 0; i < leaves.cells[0]; ++i) {
    for_each_bit(words.cut_cells(i), [&](int bit) {
      const Cell cell{node_at(leaf, 64 * i + bit), place(i, bit >> 3, bit & 7)};
      const CellCase& how = cell_cases()[static_cast<std::size_t>(words.corners(i, bit))];
      for (int n = 0; n < how.loop_count; ++n) {
        const CellLoop& loop = how.loops[n];
        if (!add_creased_loop(cell, loop, part)) add_plain_loop(cell, loop, part);
      }
    });
  }
}

void TriangleMaker::add_plain_loop(const Cell& cell, const CellLoop& loop,
                                   PartTriangles& part) const {
  for (int t = 0; t < loop.triangle_count(); ++t) {
    Triangle triangle{};
    for (int c = 0; c < 3; ++c) triangle[c] = cell.on_edge(*this, loop.edges[loop.triangles[t][c]]);
    part.triangles.push_back(triangle);
  }
}

/// Triangles of a loop that creases cross: they fan out from where a crease enters, so that it
/// becomes a chain of edges; from a corner inside if three or more creases meet.
///
/// Source: Ho et al. 2005 (cubical marching squares): sharp points are found on faces first.
bool TriangleMaker::add_creased_loop(const Cell& cell, const CellLoop& loop,
                                     PartTriangles& part) const {
  std::array<std::uint32_t, 24> polygon;
  std::size_t count = 0;
  std::size_t crease_count = 0;
  std::size_t first_crease = 0;
  for (int e = 0; e < loop.edge_count; ++e) {
    polygon[count++] = cell.on_edge(*this, loop.edges[e]);
    const std::uint32_t crease = cell.on_face(*this, loop.faces[e]);
    if (crease != Corner::none) {
      first_crease = crease_count++ == 0 ? count : first_crease;
      polygon[count++] = crease;
    }
  }
  if (crease_count == 0) {
    return false;
  }
  if (crease_count >= 3) {
    const std::uint32_t corner = corner_in_cell(cell, loop, part);
    for (std::size_t c = 0; c < count; ++c) {
      part.triangles.push_back({corner, polygon[c], polygon[(c + 1) % count]});
    }
    return true;
  }
  for (std::size_t c = 1; c + 1 < count; ++c) {
    part.triangles.push_back({polygon[first_crease], polygon[(first_crease + c) % count],
                              polygon[(first_crease + c + 1) % count]});
  }
  return true;
}

/// Where three faces or more meet inside a cell.
std::uint32_t TriangleMaker::corner_in_cell(const Cell& cell, const CellLoop& loop,
                                            PartTriangles& part) const {
  std::vector<Tangent> planes;
  Vec3d middle;
  for (int e = 0; e < loop.edge_count; ++e) {
    const int base = edge_corner(loop.edges[e]);
    const std::array<int, 3> corner{base & 1, base >> 1 & 1, base >> 2};
    const Node node{cell.node[0] + corner[0], cell.node[1] + corner[1], cell.node[2] + corner[2]};
    const int axis = loop.edges[e] / 4;
    Vec3d point{static_cast<double>(corner[0]), static_cast<double>(corner[1]),
                static_cast<double>(corner[2])};
    const Band& band = vertices_.band_of_edge(node, axis);
    point[axis] += static_cast<double>(cut_part(band, node, axis));
    planes.push_back({point, cut_normal(band, node, axis)});
    middle += point;
  }
  middle = middle / static_cast<double>(loop.edge_count);
  const Vec3d meeting = meeting_point(planes, middle);
  Vec3f r;
  for (int axis = 0; axis < 3; ++axis) {
    const double index = cell.node[axis] + std::clamp(meeting[axis], 0.01, 0.99);
    r[axis] = static_cast<float>(band_.frame().node_position(axis, index));
  }
  part.cell_vertices.push_back(r);
  part.plain = false;
  return Corner::of(Corner::in_cell, static_cast<std::uint32_t>(part.cell_vertices.size() - 1));
}

}  // namespace scarp

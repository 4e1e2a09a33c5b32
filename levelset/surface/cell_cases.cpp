#include "levelset/surface/cell_cases.h"

#include <utility>
#include <vector>

namespace scarp {

namespace {

/// The edge between two corners that differ in one bit.
int edge_between(int a, int b) {
  for (int edge = 0; edge < 12; ++edge) {
    const int from = edge_corner(edge);
    const int to = from | (1 << (edge / 4));
    if ((from == a && to == b) || (from == b && to == a)) {
      return edge;
    }
  }
  return -1;
}

/// The corners of a face, counter-clockwise seen from outside the cell.
std::array<int, 4> face_corners(int face) {
  const int axis = face / 2;
  const int upper = face % 2;
  const int b = 1 << ((axis + 1) % 3);
  const int c = 1 << ((axis + 2) % 3);
  const int base = upper << axis;
  if (upper == 1) {
    return {base, base | b, base | b | c, base | c};
  }
  return {base, base | c, base | b | c, base | b};
}

/// One bit per face that holds the edge.
int faces_of(int edge) {
  int faces = 0;
  for (int face = 0; face < 6; ++face) {
    const auto corners = face_corners(face);
    for (int n = 0; n < 4; ++n) {
      if (edge_between(corners[n], corners[(n + 1) % 4]) == edge) {
        faces |= 1 << face;
      }
    }
  }
  return faces;
}

struct Next {
  int edge = -1;
  int face = -1;
};

/// For every cut edge the next one around its loop and the face on the way; -1 elsewhere.
///
/// On each face every run of gas corners is cut off by one segment, from the edge where the run
/// ends to the edge where it starts. So on a face with two gas corners across the diagonal the gas
/// is parted and the solid joined, from whichever cell one looks: neighbours always fit.
std::array<Next, 12> next_edges(int solid_mask) {
  std::array<Next, 12> next;
  const auto solid = [&](int corner) { return ((solid_mask >> corner) & 1) != 0; };
  for (int face = 0; face < 6; ++face) {
    const auto corners = face_corners(face);
    for (int n = 0; n < 4; ++n) {
      if (!solid(corners[n]) || solid(corners[(n + 1) % 4])) {
        continue;
      }
      int last = n + 1;
      while (!solid(corners[(last + 1) % 4])) {
        ++last;
      }
      const int run_starts = edge_between(corners[n], corners[(n + 1) % 4]);
      const int run_ends = edge_between(corners[last % 4], corners[(last + 1) % 4]);
      next[run_ends] = {run_starts, face};
    }
  }
  return next;
}

/// Cuts a loop into triangles so that no inner edge lies in a face of the cell: there it could
/// meet the same edge of the neighbour, and four triangles would share it.
bool triangulate(const CellLoop& loop, const std::array<int, 12>& faces, int first, int last,
                 std::vector<std::array<int, 3>>& triangles) {
  if (last - first < 2) {
    return true;
  }
  const auto allowed = [&](int a, int b) {
    const bool side = b - a == 1;
    return side || (faces[loop.edges[a]] & faces[loop.edges[b]]) == 0;
  };
  for (int middle = first + 1; middle < last; ++middle) {
    if (!allowed(first, middle) || !allowed(middle, last)) {
      continue;
    }
    const std::size_t before = triangles.size();
    triangles.push_back({first, middle, last});
    if (triangulate(loop, faces, first, middle, triangles) &&
        triangulate(loop, faces, middle, last, triangles)) {
      return true;
    }
    triangles.resize(before);
  }
  return false;
}

/// The loop that starts at an edge; takes its edges out of next.
CellLoop make_loop(std::array<Next, 12>& next, int start, const std::array<int, 12>& faces) {
  CellLoop loop;
  for (int edge = start; next[edge].edge >= 0;) {
    loop.edges[loop.edge_count] = static_cast<std::uint8_t>(edge);
    loop.faces[loop.edge_count] = static_cast<std::uint8_t>(next[edge].face);
    ++loop.edge_count;
    edge = std::exchange(next[edge], Next{}).edge;
  }
  std::vector<std::array<int, 3>> triangles;
  triangulate(loop, faces, 0, loop.edge_count - 1, triangles);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t c = 0; c < 3; ++c) {
      loop.triangles[t][c] = static_cast<std::uint8_t>(triangles[t][c]);
    }
  }
  return loop;
}

CellCase make_case(int solid_mask, const std::array<int, 12>& faces) {
  CellCase result;
  std::array<Next, 12> next = next_edges(solid_mask);
  for (int start = 0; start < 12; ++start) {
    if (next[start].edge >= 0) {
      result.loops[result.loop_count++] = make_loop(next, start, faces);
    }
  }
  return result;
}

std::array<CellCase, 256> make_cases() {
  std::array<int, 12> faces{};
  for (int edge = 0; edge < 12; ++edge) {
    faces[edge] = faces_of(edge);
  }
  std::array<CellCase, 256> cases;
  for (int mask = 0; mask < 256; ++mask) {
    cases[mask] = make_case(mask, faces);
  }
  return cases;
}

}  // namespace

const std::array<CellCase, 256>& cell_cases() {
  static const std::array<CellCase, 256> cases = make_cases();
  return cases;
}

}  // namespace scarp

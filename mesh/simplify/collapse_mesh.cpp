#include "mesh/simplify/collapse_mesh.h"

#include <utility>

#include "core/parallel.h"

namespace scarp {

namespace {

VertexKind kind_of(SideMask mask, std::array<bool, 2> periodic) {
  if (is_corner(mask)) return VertexKind::fixed;
  for (int axis = 0; axis < 2; ++axis) {
    if (fixes(mask, axis) && periodic[axis]) return VertexKind::paired;
  }
  return VertexKind::free;
}

void classify_borders(CollapseMesh& mesh) {
  std::vector<std::uint8_t> borders(mesh.r.size(), 0);
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); ++h) {
    if (!mesh.is_border(h) || !mesh.topology.is_edge(h)) continue;
    for (const std::uint32_t v : {mesh.topology.origin(h), mesh.topology.target(h)}) {
      if (borders[v] < 3) ++borders[v];
    }
  }
  for (std::size_t v = 0; v < borders.size(); ++v) {
    if (borders[v] == 0 || mesh.kind[v] == VertexKind::fixed) continue;
    const bool inside = borders[v] == 2 && mesh.sides[v] == 0;
    mesh.kind[v] = inside ? VertexKind::border : VertexKind::fixed;
  }
}

/// Vertices of a periodic side, by where they lie on it.
struct PlacesOnSide {
  using Place = std::array<double, 2>;
  std::vector<std::pair<Place, std::uint32_t>> vertices;

  PlacesOnSide(const CollapseMesh& mesh, SideMask side, int axis) {
    for (std::uint32_t v = 0; v < mesh.r.size(); ++v) {
      if (mesh.sides[v] != side || mesh.topology.outgoing(v) == HalfEdges::none) continue;
      vertices.push_back({{mesh.r[v][1 - axis], mesh.r[v].z}, v});
    }
    std::sort(vertices.begin(), vertices.end());
  }

  /// The only vertex at a place; none if there is none, or more than one.
  std::uint32_t at(const Place& place) const {
    const auto first = std::lower_bound(vertices.begin(), vertices.end(), std::pair{place, 0U});
    if (first == vertices.end() || first->first != place) return HalfEdges::none;
    const auto next = first + 1;
    return next != vertices.end() && next->first == place ? HalfEdges::none : first->second;
  }
};

/// Joins the vertices of opposite periodic sides. What has no counterpart stays where it is.
void find_twins(CollapseMesh& mesh) {
  mesh.twin.assign(mesh.r.size(), HalfEdges::none);
  for (int axis = 0; axis < 2; ++axis) {
    if (!mesh.periodic[axis]) continue;
    const auto lower_side = static_cast<SideMask>(1U << (2 * axis));
    const PlacesOnSide lower(mesh, lower_side, axis);
    const PlacesOnSide upper(mesh, static_cast<SideMask>(lower_side << 1), axis);
    for (const auto& [place, v] : lower.vertices) {
      const std::uint32_t w = upper.at(place);
      if (w == HalfEdges::none || lower.at(place) != v || mesh.kind[v] != VertexKind::paired ||
          mesh.kind[w] != VertexKind::paired) {
        continue;
      }
      mesh.twin[v] = w;
      mesh.twin[w] = v;
    }
  }
  for (std::size_t v = 0; v < mesh.kind.size(); ++v) {
    if (mesh.kind[v] == VertexKind::paired && mesh.twin[v] == HalfEdges::none) {
      mesh.kind[v] = VertexKind::fixed;
    }
  }
}

/// Numbers 0..count: by what they are in the order, then those that are not in it.
std::vector<std::uint32_t> in_old_order(const std::vector<std::uint32_t>& order,
                                        std::size_t count) {
  std::vector<std::uint32_t> result(count);
  for (std::uint32_t i = 0; i < count; ++i) result[i < order.size() ? order[i] : i] = i;
  return result;
}

/// The living facets by their triangle of the input, or by what that was before.
std::vector<std::uint32_t> facets_in_old_order(const HalfEdges& topology,
                                               const std::vector<std::uint32_t>& order) {
  const std::span<const std::uint32_t> triangles = topology.input_triangles();
  std::vector<std::uint32_t> result(order.size(), HalfEdges::none);
  for (std::uint32_t f = 0; f < triangles.size(); ++f) {
    if (!topology.alive(f)) continue;
    if (order.empty()) {
      result.push_back(f);
    } else {
      result[order[triangles[f]]] = f;
    }
  }
  std::erase(result, HalfEdges::none);
  return result;
}

}  // namespace

CoarseDirection::CoarseDirection(Vec3d n) {
  constexpr double largest = 127;
  const double size = length(n);
  if (!(size > 0)) return;
  x_ = static_cast<std::int8_t>(largest * (n.x / size));
  y_ = static_cast<std::int8_t>(largest * (n.y / size));
  z_ = static_cast<std::int8_t>(largest * (n.z / size));
}

CollapseMesh::CollapseMesh(const TriMesh& mesh, const Sides& side_positions, ThinFacets thin)
    : topology(mesh), planes(side_positions), thin_facets(thin) {
  box = bounding_box(mesh);
  if (!mesh.vertices.empty()) centre = Vec3d(Vec3f(0.5 * (box.lower + box.upper)));
  if (side_positions.diagonal) centre.y = centre.x;
  box = {box.lower - centre, box.upper - centre};
  const std::uint32_t vertex_count = topology.vertex_count();
  r.resize(vertex_count);
  sides.resize(vertex_count);
  kind.resize(vertex_count, VertexKind::free);
  for (int axis = 0; axis < 2; ++axis) {
    periodic[axis] = side_positions.boundary[axis] == Boundary::periodic;
  }
  constexpr std::size_t grain = 4096;
  parallel_for(vertex_count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const bool copy = v >= mesh.vertices.size();
      const Vec3d place(mesh.vertices[copy ? topology.copies()[v - mesh.vertices.size()] : v]);
      r[v] = place - centre;
      sides[v] = planes.mask(place);
      kind[v] = kind_of(sides[v], periodic);
    }
  });
  for (std::uint32_t v = 0; v < vertex_count; ++v) {
    if (topology.outgoing(v) != HalfEdges::none) ++live_vertices;
  }
  // Touching sheets go on touching.
  for (std::uint32_t i = 0; i < topology.copies().size(); ++i) {
    kind[topology.copies()[i]] = VertexKind::fixed;
    kind[mesh.vertices.size() + i] = VertexKind::fixed;
  }
  normals.resize(topology.facet_count());
  parallel_for(normals.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) normals[f] = normal_of(static_cast<std::uint32_t>(f));
  });
  area = parallel_reduce(
      normals.size(), grain, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double twice_area = 0;
        for (std::size_t f = begin; f < end; ++f) twice_area += length(normals[f]);
        return 0.5 * twice_area;
      },
      [](double a, double b) { return a + b; });
  input_normals.resize(normals.size());
  parallel_for(normals.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      Vec3d around = normals[f];
      for (std::uint32_t k = 0; k < 3 && thin_facets == ThinFacets::noisy; ++k) {
        const std::uint32_t across = topology.opposite(static_cast<std::uint32_t>(3 * f + k));
        if (across != HalfEdges::none) around += normals[HalfEdges::facet(across)];
      }
      input_normals[f] = CoarseDirection(around);
    }
  });
  if (!mesh.materials.empty()) {
    for (const std::uint32_t f : topology.input_triangles()) materials.push_back(mesh.materials[f]);
    classify_borders(*this);
  }
  if (periodic[0] || periodic[1]) find_twins(*this);
}

bool CollapseMesh::are_copies(std::uint32_t v, std::uint32_t w, int axis) const {
  if (twin[v] != HalfEdges::none || twin[w] != HalfEdges::none) return twin[v] == w;
  // Ends of a side: corners of the domain, ends of borders.
  return kind[v] == VertexKind::fixed && kind[w] == VertexKind::fixed &&
         ((sides[v] | sides[w]) >> (2 * axis) & 3) == 3 && r[v][1 - axis] == r[w][1 - axis] &&
         r[v].z == r[w].z;
}

std::uint32_t CollapseMesh::found_twin_edge(std::uint32_t h) const {
  if (topology.opposite(h) != HalfEdges::none) return HalfEdges::none;
  const std::uint32_t u = topology.origin(h);
  const std::uint32_t v = topology.target(h);
  if ((sides[u] & sides[v]) == 0) return HalfEdges::none;
  // The boundary goes on at the twin of one of the ends.
  std::uint32_t t = HalfEdges::none;
  if (twin[v] != HalfEdges::none) {
    t = topology.outgoing(twin[v]);
  } else if (twin[u] != HalfEdges::none) {
    topology.for_each_outgoing(twin[u], [&](std::uint32_t g) { t = HalfEdges::previous(g); });
  }
  if (t == HalfEdges::none || topology.opposite(t) != HalfEdges::none) return HalfEdges::none;
  const int axis = fixes(sides[twin[v] != HalfEdges::none ? v : u], 0) ? 0 : 1;
  const bool same =
      are_copies(u, topology.target(t), axis) && are_copies(v, topology.origin(t), axis);
  return same ? t : HalfEdges::none;
}

Vec3d CollapseMesh::twin_place(std::uint32_t h, Vec3d place) const {
  const Vec3d there = r[topology.target(twin_edge(h))];
  const Vec3d here = r[topology.origin(h)];
  for (int axis = 0; axis < 2; ++axis) {
    if (here[axis] != there[axis]) place[axis] = there[axis];
  }
  return place;
}

void CollapseMesh::merge(std::uint32_t h, Vec3d place) {
  const std::uint32_t u = topology.origin(h);
  const std::uint32_t v = topology.target(h);
  topology.collapse(h);
  r[u] = place;
  sides[u] |= sides[v];
  kind[u] = std::max(kind[u], kind[v]);
}

void CollapseMesh::collapse(std::uint32_t h, Vec3d place) {
  const std::uint32_t u = topology.origin(h);
  const std::uint32_t t = twin_edge(h);
  if (t == HalfEdges::none) {
    merge(h, place);
    return;
  }
  const std::uint32_t w = topology.origin(t);
  merge(t, twin_place(h, place));
  merge(h, place);
  const bool is_pair = kind[u] == VertexKind::paired;
  twin[u] = is_pair ? w : HalfEdges::none;
  twin[w] = is_pair ? u : HalfEdges::none;
}

std::uint32_t CollapseMesh::from_twin(std::uint32_t h) const {
  const bool turn = has_twins() && topology.opposite(h) != HalfEdges::none &&
                    twin[topology.target(h)] != HalfEdges::none;
  return turn ? topology.opposite(h) : h;
}

Vec3d CollapseMesh::normal_of(std::uint32_t f) const {
  const Vec3d a = r[topology.origin(3 * f)];
  const Vec3d b = r[topology.origin(3 * f + 1)];
  const Vec3d c = r[topology.origin(3 * f + 2)];
  return cross(b - a, c - a);
}

bool CollapseMesh::is_border(std::uint32_t h) const {
  const std::uint32_t o = topology.opposite(h);
  return !materials.empty() && o != HalfEdges::none &&
         materials[HalfEdges::facet(h)] != materials[HalfEdges::facet(o)];
}

TriMesh CollapseMesh::extract(const SpatialOrder& order) const {
  TriMesh mesh;
  mesh.vertices.reserve(live_vertices);
  std::vector<std::uint32_t> index(r.size(), HalfEdges::none);
  for (const std::uint32_t v : in_old_order(order.vertices, r.size())) {
    if (topology.outgoing(v) == HalfEdges::none) continue;
    index[v] = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(Vec3f(r[v] + centre));
  }
  for (const std::uint32_t f : facets_in_old_order(topology, order.triangles)) {
    mesh.triangles.push_back({index[topology.origin(3 * f)], index[topology.origin(3 * f + 1)],
                              index[topology.origin(3 * f + 2)]});
    if (!materials.empty()) mesh.materials.push_back(materials[f]);
  }
  return mesh;
}

Merge merge_rule(const CollapseMesh& mesh, std::uint32_t h) {
  const std::uint32_t u = mesh.topology.origin(h);
  const std::uint32_t v = mesh.topology.target(h);
  const SideMask sides_u = mesh.sides[u];
  const SideMask sides_v = mesh.sides[v];
  const VertexKind kind_u = mesh.kind[u];
  const VertexKind kind_v = mesh.kind[v];
  if (kind_u == VertexKind::free && kind_v == VertexKind::free) {
    return sides_u == sides_v || sides_u == 0 || sides_v == 0 ? Merge::free : Merge::forbidden;
  }
  const bool both_bound = kind_u != VertexKind::free && kind_v != VertexKind::free;
  const bool both_fixed = kind_u == VertexKind::fixed && kind_v == VertexKind::fixed;
  const bool has_twin = mesh.twin_edge(h) != HalfEdges::none;
  if (both_fixed || (both_bound && !has_twin && !mesh.is_border(h))) return Merge::forbidden;
  // Two pairs become one.
  if (kind_u == VertexKind::paired && kind_v == VertexKind::paired) return Merge::free;
  // An open boundary that begins at a periodic side does so at the opposite one.
  const bool one_paired = kind_u == VertexKind::paired || kind_v == VertexKind::paired;
  if (one_paired && !has_twin && mesh.topology.opposite(h) == HalfEdges::none) {
    return Merge::forbidden;
  }
  // The end that is bound less moves to the other one, unless it would leave its side or border.
  const bool u_may_go = (sides_u & ~sides_v) == 0;
  const bool v_may_go = (sides_v & ~sides_u) == 0;
  if (kind_u == kind_v) return u_may_go && v_may_go ? Merge::onto_either : Merge::forbidden;
  if (kind_u > kind_v) return v_may_go ? Merge::onto_origin : Merge::forbidden;
  return u_may_go ? Merge::onto_target : Merge::forbidden;
}

Subspace allowed_places(const CollapseMesh& mesh, std::uint32_t h) {
  const std::uint32_t u = mesh.topology.origin(h);
  const std::uint32_t v = mesh.topology.target(h);
  const Vec3d edge = mesh.r[v] - mesh.r[u];
  Subspace places;
  places.origin = 0.5 * edge;
  for (int axis = 0; axis < 2; ++axis) {
    if (fixes(mesh.sides[u], axis)) {
      places.fix(axis, 0);
    } else if (fixes(mesh.sides[v], axis)) {
      places.fix(axis, edge[axis]);
    }
  }
  constexpr Vec3d across_diagonal{1, -1, 0};
  if (fixes_diagonal(mesh.sides[u])) {
    places.intersect(across_diagonal, 0);
  } else if (fixes_diagonal(mesh.sides[v])) {
    places.intersect(across_diagonal, edge.x - edge.y);
  }
  return places;
}

}  // namespace scarp

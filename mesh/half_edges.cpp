#include "mesh/half_edges.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "core/recipe/quantity.h"

namespace scarp {

namespace {

std::string place(Vec3f r) { return rounded_place(Vec3d(r)); }

}  // namespace

/// Half edges by origin, in compressed rows.
struct HalfEdges::Rows {
  struct Entry {
    std::uint32_t half_edge;
    std::uint32_t target;
  };
  std::vector<std::uint32_t> begin;
  LargeVector<Entry> entries;

  Rows(std::span<const std::uint32_t> origin, std::size_t vertex_count)
      : begin(vertex_count + 1, 0), entries(origin.size()) {
    for (const std::uint32_t v : origin) ++begin[v + 1];
    for (std::size_t v = 0; v < vertex_count; ++v) begin[v + 1] += begin[v];
    std::vector<std::uint32_t> cursor(begin.begin(), begin.end() - 1);
    for (std::uint32_t h = 0; h < origin.size(); h += 3) {
      const std::array<std::uint32_t, 3> v{origin[h], origin[h + 1], origin[h + 2]};
      entries[cursor[v[0]]++] = {h, v[1]};
      entries[cursor[v[1]]++] = {h + 1, v[2]};
      entries[cursor[v[2]]++] = {h + 2, v[0]};
    }
  }

  std::span<const Entry> row(std::uint32_t v) const {
    return {entries.data() + begin[v], entries.data() + begin[v + 1]};
  }
};

HalfEdges::HalfEdges(const TriMesh& mesh) : outgoing_(mesh.vertices.size(), none) {
  input_triangles_.reserve(mesh.triangles.size());
  origin_.reserve(3 * mesh.triangles.size());
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    const Triangle& t = mesh.triangles[f];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    input_triangles_.push_back(f);
    origin_.insert(origin_.end(), t.begin(), t.end());
  }
  std::optional<Rows> rows(std::in_place, origin_, outgoing_.size());
  std::uint32_t bad = match_opposites(*rows);
  // Repeated triangles share their edges.
  if (bad != none && drop_repeated(*rows)) {
    rows.emplace(origin_, outgoing_.size());
    bad = match_opposites(*rows);
  }
  if (bad != none) {
    throw InputError("the mesh is not a 2-manifold: the edge from " +
                     place(mesh.vertices[origin(bad)]) + " to " +
                     place(mesh.vertices[target(bad)]) +
                     " belongs to more than two triangles, or to two that disagree about which "
                     "side is out");
  }
  split_touching_sheets(*rows);
}

bool HalfEdges::drop_repeated(const Rows& rows) {
  std::vector<bool> repeated(facet_count(), false);
  for (std::uint32_t f = 0; f < facet_count(); ++f) {
    const std::uint32_t h = 3 * f;
    for (const auto& [g, w] : rows.row(origin(h))) {
      if (facet(g) < f && w == target(h) && apex(g) == apex(h)) repeated[f] = true;
    }
  }
  std::uint32_t kept = 0;
  for (std::uint32_t f = 0; f < repeated.size(); ++f) {
    if (repeated[f]) continue;
    input_triangles_[kept] = input_triangles_[f];
    std::copy_n(&origin_[std::size_t{3} * f], 3, &origin_[std::size_t{3} * kept]);
    ++kept;
  }
  input_triangles_.resize(kept);
  origin_.resize(std::size_t{3} * kept);
  return kept < repeated.size();
}

std::uint32_t HalfEdges::match_opposites(const Rows& rows) {
  opposite_.assign(origin_.size(), none);
  constexpr std::size_t grain = 2048;
  std::vector<std::uint32_t> bad(outgoing_.size() / grain + 1, none);
  parallel_for(outgoing_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
      const std::span<const Rows::Entry> row = rows.row(v);
      for (std::size_t i = 0; i < row.size(); ++i) {
        const auto [h, w] = row[i];
        for (std::size_t j = 0; j < i; ++j) {
          if (row[j].target != w) continue;
          bad[begin / grain] = std::min(bad[begin / grain], row[j].half_edge);
        }
        // Of every edge the lower end joins the two.
        if (w < v) continue;
        for (const auto& [g, target_of_g] : rows.row(w)) {
          if (target_of_g == v) link(h, g);
        }
      }
    }
  });
  return *std::min_element(bad.begin(), bad.end());
}

void HalfEdges::split_touching_sheets(const Rows& rows) {
  const auto vertex_count = static_cast<std::uint32_t>(outgoing_.size());
  std::vector<std::uint8_t> has_more(vertex_count, 0);
  constexpr std::size_t grain = 4096;
  parallel_for(vertex_count, grain, [&](std::size_t begin, std::size_t end) {
    for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
      if (rows.row(v).empty()) continue;
      choose_outgoing(v, rows.row(v).front().half_edge);
      std::size_t count = 0;
      for_each_outgoing(v, [&](std::uint32_t) { ++count; });
      has_more[v] = count < rows.row(v).size() ? 1 : 0;
    }
  });
  for (std::uint32_t v = 0; v < vertex_count; ++v) {
    if (has_more[v] != 0) split_sheets_of(v, rows);
  }
}

void HalfEdges::split_sheets_of(std::uint32_t v, const Rows& rows) {
  std::vector<std::uint32_t> seen;
  std::uint32_t sheet = v;
  for (const auto& [h, target_of_h] : rows.row(v)) {
    if (std::count(seen.begin(), seen.end(), h) > 0) continue;
    if (!seen.empty()) {
      sheet = static_cast<std::uint32_t>(outgoing_.size());
      outgoing_.push_back(none);
      copies_.push_back(v);
    }
    choose_outgoing(sheet, h);
    for_each_outgoing(sheet, [&](std::uint32_t g) {
      seen.push_back(g);
      origin_[g] = sheet;
    });
  }
}

void HalfEdges::link(std::uint32_t a, std::uint32_t b) {
  if (a != none) opposite_[a] = b;
  if (b != none) opposite_[b] = a;
}

void HalfEdges::choose_outgoing(std::uint32_t v, std::uint32_t h) {
  const std::uint32_t start = h;
  while (opposite_[h] != none) {
    h = next(opposite_[h]);
    if (h == start) break;
  }
  outgoing_[v] = h;
}

bool HalfEdges::can_collapse(std::uint32_t h) const {
  const std::uint32_t u = origin(h);
  const std::uint32_t v = target(h);
  const std::uint32_t o = opposite_[h];
  // An inner edge between two boundary vertices would pinch the surface.
  if (o != none && on_boundary(u) && on_boundary(v)) return false;
  for (const std::uint32_t side : {h, o}) {
    if (side == none) continue;
    // A facet on an ear would leave an edge without a facet.
    if (opposite_[next(side)] == none && opposite_[previous(side)] == none) return false;
  }
  // Link condition: u and v share no neighbours but the apexes of the edge's own facets.
  std::array<std::uint32_t, 64> ring;
  std::size_t ring_size = 0;
  bool fits = true;
  for_each_neighbour(u, [&](std::uint32_t w) {
    if (ring_size < ring.size()) {
      ring[ring_size++] = w;
    } else {
      fits = false;
    }
  });
  if (!fits) return false;
  int shared = 0;
  int valence = 0;
  for_each_neighbour(v, [&](std::uint32_t w) {
    ++valence;
    for (std::size_t i = 0; i < ring_size; ++i) shared += ring[i] == w ? 1 : 0;
  });
  if (shared != (o == none ? 1 : 2)) return false;
  // A tetrahedron would fold onto itself.
  return !(o != none && ring_size == 3 && valence == 3 && !on_boundary(u) && !on_boundary(v));
}

void HalfEdges::close_facet(std::uint32_t h) {
  const std::uint32_t a = opposite_[next(h)];
  const std::uint32_t b = opposite_[previous(h)];
  const std::uint32_t tip = apex(h);
  link(a, b);
  const std::uint32_t f = facet(h);
  for (std::uint32_t i = 3 * f; i < 3 * f + 3; ++i) {
    origin_[i] = none;
    opposite_[i] = none;
  }
  // a ran from the tip to v, b from u to the tip. What goes out of an inner vertex is as good as
  // anything else; at the end of a boundary it was and stays the first.
  if (a == none || b == none || facet(outgoing_[tip]) == f) {
    choose_outgoing(tip, a != none ? a : next(b));
  }
}

void HalfEdges::collapse(std::uint32_t h) {
  const std::uint32_t u = origin(h);
  const std::uint32_t v = target(h);
  const std::uint32_t o = opposite_[h];
  const std::uint32_t from_tip = opposite_[next(h)];
  const std::uint32_t to_tip = opposite_[previous(h)];
  const bool is_inner = o != none && !on_boundary(u) && !on_boundary(v);
  // Turn around v before any link changes.
  std::uint32_t g = outgoing_[v];
  const std::uint32_t first = g;
  do {
    origin_[g] = u;
    g = opposite_[previous(g)];
  } while (g != none && g != first);

  close_facet(h);
  if (o != none) close_facet(o);
  outgoing_[v] = none;
  // Linked now, so that it is enough to know one living half edge of u.
  if (is_inner) {
    outgoing_[u] = to_tip;
  } else {
    choose_outgoing(u, to_tip != none ? to_tip : next(from_tip));
  }
}

bool HalfEdges::can_flip(std::uint32_t h) const {
  const std::uint32_t o = opposite_[h];
  if (o == none) return false;
  const std::uint32_t a = apex(h);
  const std::uint32_t b = apex(o);
  bool joined = a == b;
  for_each_neighbour(a, [&](std::uint32_t w) { joined = joined || w == b; });
  return !joined;
}

void HalfEdges::flip(std::uint32_t h) {
  const std::uint32_t o = opposite_[h];
  const std::uint32_t u = origin(h);
  const std::uint32_t v = target(h);
  const std::uint32_t a = apex(h);
  const std::uint32_t b = apex(o);
  const std::uint32_t va = opposite_[next(h)];
  const std::uint32_t au = opposite_[previous(h)];
  const std::uint32_t ub = opposite_[next(o)];
  const std::uint32_t bv = opposite_[previous(o)];
  // Facet of h becomes (b, a, u), facet of o becomes (a, b, v).
  origin_[h] = b;
  origin_[next(h)] = a;
  origin_[previous(h)] = u;
  origin_[o] = a;
  origin_[next(o)] = b;
  origin_[previous(o)] = v;
  link(next(h), au);
  link(previous(h), ub);
  link(next(o), bv);
  link(previous(o), va);
  choose_outgoing(a, next(h));
  choose_outgoing(u, previous(h));
  choose_outgoing(b, next(o));
  choose_outgoing(v, previous(o));
}

}  // namespace scarp

#include "levelset/surface/connectivity.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/disjoint_sets.h"
#include "levelset/grid/carry.h"
#include "levelset/grid/redistance.h"
#include "levelset/surface/extract_surface.h"
#include "levelset/surface/phase_graph.h"

namespace scarp {

namespace {

/// Triangles that share vertices have the same number.
std::vector<std::uint32_t> parts_of(const TriMesh& mesh) {
  DisjointSets vertices(mesh.vertices.size());
  for (const Triangle& t : mesh.triangles) {
    vertices.join(t[0], t[1]);
    vertices.join(t[0], t[2]);
  }
  std::vector<std::uint32_t> parts;
  parts.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) parts.push_back(vertices.lowest(t[0]));
  return parts;
}

/// How far the smooth surface through the corners of every facet bulges out of it, on average; 0
/// along edges that end on a crease. Units: nm along the normal.
///
/// Source: quadratic PN triangles (Vlachos et al. 2001): the middle of an edge rises by
/// (p_j - p_i) (n_j - n_i) / 8, the mean over the facet is a third of the sum.
std::vector<double> bulges(const TriMesh& mesh, const Frame& frame) {
  // What the area vectors around a vertex lose when they are added tells how far they fan out. On
  // a ball of 3 spacings it is 2 %, on a right angle up to 30 %.
  constexpr double least_joined = 0.95;
  std::vector<Vec3d> normal(mesh.vertices.size());
  std::vector<double> area(mesh.vertices.size());
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const Vec3d a = area_vector(mesh, f);
    for (const std::uint32_t v : mesh.triangles[f]) {
      normal[v] += a;
      area[v] += length(a);
    }
  }
  const Sides sides = frame.sides();
  for (std::size_t v = 0; v < normal.size(); ++v) {
    // With what is mirrored at a side the surface goes straight through it.
    for (int axis = 0; axis < 2; ++axis) {
      const double at = mesh.vertices[v][axis];
      const bool is_on_side = at == sides.lower[axis] || at == sides.upper[axis];
      if (is_on_side && sides.boundary[axis] == Boundary::reflective) normal[v][axis] = 0;
    }
    const double joined = length(normal[v]);
    normal[v] = joined > least_joined * area[v] ? normal[v] / joined : Vec3d{};
  }
  std::vector<double> rise(mesh.triangles.size());
  for (std::size_t f = 0; f < rise.size(); ++f) {
    const std::array<Vec3d, 3> corner = corners(mesh, f);
    for (int n = 0; n < 3; ++n) {
      const Vec3d& from = normal[mesh.triangles[f][n]];
      const Vec3d& to = normal[mesh.triangles[f][(n + 1) % 3]];
      if (from == Vec3d{} || to == Vec3d{}) continue;
      rise[f] += dot(corner[(n + 1) % 3] - corner[n], to - from) / 24;
    }
  }
  return rise;
}

/// The lowest node of the cell that a point lies in.
Node cell_at(const Frame& frame, Vec3d r) {
  Node node{};
  for (int axis = 0; axis < 3; ++axis) {
    node[axis] =
        static_cast<int>(std::floor((r[axis] - frame.node_position(axis, 0)) / frame.spacing));
  }
  return node;
}

/// Measures the regions of a graph that are closed off: what their surfaces enclose.
class RegionList {
 public:
  RegionList(const Layers& layers, Phase phase, const PhaseGraph& graph)
      : layers_(layers), band_(layers.top().band()), phase_(phase), graph_(graph) {}

  /// Those that are known already are not measured again.
  std::vector<Region> run(std::span<const Region> known) {
    list_regions(known);
    if (std::find(is_new_.begin(), is_new_.end(), true) != is_new_.end()) measure();
    return std::move(regions_);
  }

  /// The surfaces of all of them.
  std::vector<TriMesh> surfaces() {
    list_regions({});
    const TriMesh all = surface();
    const std::vector<std::size_t> region = regions_of_facets(all);
    std::vector<TriMesh> surfaces(regions_.size());
    std::vector<std::uint32_t> renumbered(all.vertices.size(), unused);
    for (std::size_t f = 0; f < all.triangles.size(); ++f) {
      if (region[f] == none) continue;
      TriMesh& surface = surfaces[region[f]];
      Triangle triangle = all.triangles[f];
      for (std::uint32_t& v : triangle) {
        if (renumbered[v] == unused) {
          renumbered[v] = static_cast<std::uint32_t>(surface.vertices.size());
          surface.vertices.push_back(all.vertices[v]);
        }
        v = renumbered[v];
      }
      surface.triangles.push_back(triangle);
      surface.materials.push_back(all.materials[f]);
    }
    return surfaces;
  }

 private:
  static constexpr std::uint32_t unused = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();

  void list_regions(std::span<const Region> known) {
    place_.assign(graph_.region_limit(), none);
    for (std::size_t n = 0; n < band_.leaves().size(); ++n) {
      for (const LeafPiece& piece : graph_.pieces(n)) {
        if (piece.region == 0 || place_[piece.region] != none) continue;
        place_[piece.region] = regions_.size();
        const auto word = std::find_if(piece.nodes.begin(), piece.nodes.end(),
                                       [](std::uint64_t bits) { return bits != 0; });
        const auto i = static_cast<int>(word - piece.nodes.begin());
        const Node first =
            node_at(band_.leaves()[n], i * leaf_edge * leaf_edge + std::countr_zero(*word));
        const auto same = std::find_if(known.begin(), known.end(),
                                       [&](const Region& r) { return r.first_node == first; });
        is_new_.push_back(same == known.end());
        regions_.push_back(
            is_new_.back()
                ? Region{.first_node = first, .volume = 0, .lower = 1e300, .upper = -1e300}
                : *same);
      }
    }
  }

  /// The place in the list of a new region; none for others.
  std::size_t new_region(const LeafPiece& piece) const {
    const std::size_t place = piece.region == 0 ? none : place_[piece.region];
    return place != none && is_new_[place] ? place : none;
  }

  void measure() {
    const TriMesh surface = this->surface();
    const std::vector<std::size_t> region = regions_of_facets(surface);
    const std::vector<double> rise = bulges(surface, band_.frame());
    std::vector<std::array<bool, 2>> is_cut(regions_.size());  // by the planes of symmetry
    for (std::size_t f = 0; f < surface.triangles.size(); ++f) {
      if (region[f] == none) continue;
      add_facet(surface, f, rise[f], regions_[region[f]]);
      for (int axis = 0; axis < 2; ++axis)
        if (reaches_middle(surface, f, axis)) is_cut[region[f]][axis] = true;
    }
    for (std::size_t n = 0; n < regions_.size(); ++n) {
      if (!is_new_[n]) continue;
      for (int axis = 0; axis < 2; ++axis) {
        if (!band_.frame().half[axis]) continue;
        if (is_cut[n][axis] || band_.frame().is_around_axis()) {
          regions_[n].volume *= 2;
        } else {
          regions_[n].images *= 2;
        }
      }
    }
  }

  /// Surfaces end on the sides exactly.
  static bool reaches_middle(const TriMesh& surface, std::size_t f, int axis) {
    return std::ranges::any_of(surface.triangles[f],
                               [&](std::uint32_t v) { return surface.vertices[v][axis] == 0; });
  }

  /// Each part of the surface is that of one region, which any of its cells tells where no two
  /// regions meet.
  std::vector<std::size_t> regions_of_facets(const TriMesh& surface) const {
    const std::vector<std::uint32_t> parts = parts_of(surface);
    std::vector<std::size_t> region_of(surface.vertices.size(), none);
    std::vector<std::size_t> regions;
    regions.reserve(parts.size());
    for (std::size_t f = 0; f < surface.triangles.size(); ++f)
      if (region_of[parts[f]] == none) region_of[parts[f]] = region_next_to(surface, f);
    for (const std::uint32_t part : parts) regions.push_back(region_of[part]);
    return regions;
  }

  /// Of all voids, or of the new islands.
  TriMesh surface() const {
    if (phase_ == Phase::gas) return extract_voids(layers_, graph_);
    OpenGas all_but_islands{
        .open = graph_.nodes_where([&](const LeafPiece& p) { return new_region(p) != none; })};
    for (std::uint64_t& word : all_but_islands.open) word = ~word;
    return extract_surface(layers_, all_but_islands);
  }

  /// The region at the corners of the cell that a facet lies in; none if there are several.
  std::size_t region_next_to(const TriMesh& surface, std::size_t f) const {
    const std::array<Vec3d, 3> corner = corners(surface, f);
    const Node lowest = cell_at(band_.frame(), (corner[0] + corner[1] + corner[2]) / 3.0);
    std::size_t found = none;
    for (int n = 0; n < 8; ++n) {
      const std::size_t region =
          region_at({lowest[0] + (n & 1), lowest[1] + (n >> 1 & 1), lowest[2] + (n >> 2)});
      if (region == none || region == found) continue;
      if (found != none) return none;
      found = region;
    }
    return found;
  }

  std::size_t region_at(const Node& node) const {
    const auto [leaf, offset] = band_.place(node);
    if (leaf < 0) return none;
    for (const LeafPiece& piece : graph_.pieces(static_cast<std::size_t>(leaf))) {
      if ((piece.nodes[offset >> 6] >> (offset & 63) & 1) != 0) {
        return new_region(piece);
      }
    }
    return none;
  }

  /// The divergence of (0, 0, z) is 1, and the domain's sides are upright: facets tell the volume,
  /// with what they rise by.
  void add_facet(const TriMesh& surface, std::size_t f, double rise, Region& region) const {
    const std::array<Vec3d, 3> corner = corners(surface, f);
    const double outwards = phase_ == Phase::gas ? -1 : 1;
    const double first = region.first_node[2] * band_.frame().spacing;
    const double height = (corner[0].z + corner[1].z + corner[2].z) / 3 - first;
    const Vec3d area = area_vector(surface, f);
    const double around = band_.frame().around((corner[0].x + corner[1].x + corner[2].x) / 3);
    region.volume += outwards * around * (height * area.z + rise * length(area));
    for (const Vec3d& r : corner) {
      region.lower = std::min(region.lower, r.z);
      region.upper = std::max(region.upper, r.z);
    }
  }

  const Layers& layers_;
  const Band& band_;
  Phase phase_;
  const PhaseGraph& graph_;
  std::vector<std::size_t> place_;  ///< in the list, by the number in the graph
  std::vector<Region> regions_;
  std::vector<bool> is_new_;  ///< of regions_
};

bool is_next_to_solid(const Band& band, const Node& node) {
  for (int face = 0; face < 6; ++face) {
    Node other = node;
    other[face / 2] += face % 2 == 0 ? -1 : 1;
    if (band.node(other[0], other[1], other[2]) < 0) {
      return true;
    }
  }
  return false;
}

/// Makes gas of the islands, and forgets how far gas was from them.
void clear_islands(Band& band, const PhaseGraph& solid) {
  for (std::size_t n = 0; n < band.leaves().size(); ++n) {
    for (const LeafPiece& piece : solid.pieces(n)) {
      if (piece.region == 0) {
        continue;
      }
      for_each_node(piece.nodes,
                    [&](int node) { band.leaves()[n].phi[node] = LevelSet::half_width; });
    }
  }
  // All of it, so that what comes out does not depend on where leaves begin.
  for (Leaf& leaf : band.leaves()) {
    for (int node = 0; node < leaf_size; ++node) {
      if (!(leaf.phi[node] < 0) && !is_next_to_solid(band, node_at(leaf, node))) {
        leaf.phi[node] = LevelSet::half_width;
      }
    }
  }
  band.trim();
  redistance_fully(band);
}

}  // namespace

bool is_open_gas(const Band& band, const OpenGas& gas, const Node& node) {
  const int i = band.fold(0, node[0]);
  const int j = band.fold(1, node[1]);
  const int leaf = band.find(i >> 3, j >> 3, node[2] >> 3);
  if (leaf >= 0) {
    return gas.is_open(static_cast<std::size_t>(leaf), leaf_offset(i, j, node[2]));
  }
  if (leaf == Band::missing_solid) {
    return false;
  }
  // A missing leaf belongs to the gas at the foot of the next leaf above it, or to the source.
  const auto [begin, end] = band.column(i >> 3, j >> 3);
  for (std::size_t n = begin; n < end; ++n) {
    if (band.leaves()[n].origin[2] > node[2]) {
      return gas.is_open(n, leaf_offset(i, j, 0));
    }
  }
  return true;
}

std::vector<std::uint64_t> closed_nodes(const Layers& layers, const OpenGas& gas) {
  if (gas.voids.empty()) return {};
  std::vector<std::uint64_t> closed(gas.open.size(), 0);
  const Band& band = layers.top().band();
  for (std::size_t n = 0; n < band.leaves().size(); ++n) {
    const Leaf& leaf = band.leaves()[n];
    for (int node = 0; node < leaf_size; ++node) {
      const auto [i, j, k] = node_at(leaf, node);
      if (i >= band.node_count(0) || j >= band.node_count(1)) continue;
      const bool is_closed = !(leaf.phi[node] < 0) && !gas.is_open(n, node);
      closed[n * 8 + static_cast<std::size_t>(node >> 6)] |= std::uint64_t{is_closed}
                                                             << (node & 63);
    }
  }
  return closed;
}

OpenGas open_gas(const Layers& layers, std::span<const Region> known) {
  const Band& band = layers.top().band();
  const PhaseGraph graph(band, Phase::gas);
  OpenGas gas;
  gas.open = graph.nodes_where([](const LeafPiece& piece) { return piece.region == 0; });
  if (graph.has_closed_regions()) {
    gas.voids = RegionList(layers, Phase::gas, graph).run(known);
  }
  return gas;
}

std::vector<TriMesh> void_surfaces(const Layers& layers, const OpenGas& gas) {
  if (gas.voids.empty()) return {};
  const PhaseGraph graph(layers.top().band(), Phase::gas);
  return RegionList(layers, Phase::gas, graph).surfaces();
}

std::vector<Region> remove_islands(Layers& layers) {
  Band& band = layers.top().band();
  const PhaseGraph graph(band, Phase::solid);
  if (!graph.has_closed_regions()) {
    return {};
  }
  std::vector<Region> islands = RegionList(layers, Phase::solid, graph).run({});
  clear_islands(band, graph);
  cut_lower_layers(layers);
  return islands;
}

}  // namespace scarp

#include "mesh/regions/remesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "core/triangle_tree.h"
#include "mesh/regions/region_complex.h"

namespace scarp {

namespace {

constexpr double small_altitude = 0.3;  ///< spacings; facets with less are collapsed if possible
constexpr double short_edge = 0.4;      ///< likewise
constexpr double poor_shape = 0.35;     ///< around vertices that are moved for it
constexpr double any_shape = 1;

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// All edges, each once, the shortest first.
std::vector<Edge> edges_by_length(const RegionComplex& complex, double longest) {
  std::vector<std::pair<double, Edge>> edges;
  for (std::uint32_t f = 0; f < complex.facet_count(); ++f) {
    if (!complex.has_facet(f)) continue;
    const Triangle& t = complex.facet(f).corners;
    for (std::size_t n = 0; n < 3; ++n) {
      const Edge edge = std::minmax(t[n], t[(n + 1) % 3]);
      const double size = length(complex.position(edge.second) - complex.position(edge.first));
      if (size < longest) edges.push_back({size, edge});
    }
  }
  std::ranges::sort(edges);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  std::vector<Edge> sorted;
  sorted.reserve(edges.size());
  for (const auto& [size, edge] : edges) sorted.push_back(edge);
  return sorted;
}

bool collapse_either(RegionComplex& complex, std::uint32_t a, std::uint32_t b) {
  return complex.collapse(b, a) || complex.collapse(a, b);
}

std::size_t collapse_short_edges(RegionComplex& complex, double longest) {
  std::size_t count = 0;
  for (const auto& [a, b] : edges_by_length(complex, longest))
    if (!complex.star(a).empty() && !complex.star(b).empty() && collapse_either(complex, a, b))
      ++count;
  return count;
}

/// Facets that are too thin lose an edge, the shortest first.
///
/// @param part of their target size
/// @param shape of facets that are long for their altitude
std::size_t collapse_thin_facets(RegionComplex& complex, double altitude, double part,
                                 double shape) {
  std::size_t count = 0;
  for (std::uint32_t f = 0; f < complex.facet_count(); ++f) {
    if (!complex.has_facet(f)) continue;
    const std::array<Vec3d, 3> corners = complex.corners_of(f);
    if (least_altitude(corners) >= altitude && shape_of(corners) >= shape &&
        complex.relative_altitude_of(f, part) >= part)
      continue;
    const Triangle t = complex.facet(f).corners;
    std::array<std::pair<double, std::size_t>, 3> edges;
    for (std::size_t n = 0; n < 3; ++n)
      edges[n] = {length(complex.position(t[(n + 1) % 3]) - complex.position(t[n])), n};
    std::ranges::sort(edges);
    for (const auto& [size, n] : edges) {
      if (!collapse_either(complex, t[n], t[(n + 1) % 3])) continue;
      ++count;
      break;
    }
  }
  return count;
}

/// Flips edges of facets of a worse shape.
std::size_t flip_edges(RegionComplex& complex, double shape) {
  std::size_t count = 0;
  for (std::uint32_t f = 0; f < complex.facet_count(); ++f) {
    if (!complex.has_facet(f) || shape_of(complex.corners_of(f)) >= shape) continue;
    for (std::size_t n = 0; n < 3 && complex.has_facet(f); ++n) {
      const Triangle t = complex.facet(f).corners;
      count += complex.flip(t[n], t[(n + 1) % 3]) ? 1 : 0;
    }
  }
  return count;
}

/// The neighbours of a vertex, the nearest to some place first.
std::vector<std::uint32_t> nearest_neighbours(const RegionComplex& complex,
                                              const std::vector<Spoke>& spokes, const Vec3d& r) {
  std::vector<std::pair<double, std::uint32_t>> by_distance;
  by_distance.reserve(spokes.size());
  for (const Spoke& spoke : spokes)
    by_distance.emplace_back(length(complex.position(spoke.other) - r), spoke.other);
  std::ranges::sort(by_distance);
  std::vector<std::uint32_t> neighbours;
  neighbours.reserve(spokes.size());
  for (const auto& [distance, v] : by_distance) neighbours.push_back(v);
  return neighbours;
}

/// Moves a vertex some of the way, or has it take a neighbour's place as well.
bool move_towards(RegionComplex& complex, std::uint32_t v, const std::vector<Spoke>& spokes,
                  const Vec3d& step) {
  const Vec3d r = complex.position(v);
  if (complex.move(v, r + step, false)) return true;
  constexpr std::size_t tried = 4;
  const std::vector<std::uint32_t> neighbours = nearest_neighbours(complex, spokes, r + step);
  for (std::size_t n = 0; n < std::min(tried, neighbours.size()); ++n)
    if (complex.collapse_and_move(neighbours[n], v, r + step)) return true;
  return complex.move(v, r + 0.5 * step, false) || complex.move(v, r + 0.25 * step, false);
}

/// Vertices near edges and corners of surfaces move there, others onto the surface, where facets
/// are further from it than is good.
std::size_t move_to_edges(RegionComplex& complex, double spacing, double good_distance) {
  std::size_t count = 0;
  for (std::uint32_t v = 0; v < complex.vertex_count(); ++v) {
    if (complex.star(v).empty()) continue;
    if (complex.distance_around(v) <= good_distance) continue;
    const Vec3d r = complex.position(v);
    const std::vector<Spoke> spokes = complex.spokes(v);
    const NearestEdge edge = complex.nearest_edge(v, spokes, r);
    if (edge.planes == 0) continue;
    const Vec3d step = edge.r - r;
    const double size = length(step);
    if (size < 1e-6 * spacing) continue;
    count += move_towards(complex, v, spokes, std::min(1.0, spacing / size) * step) ? 1 : 0;
  }
  return count;
}

/// Vertices with a facet of a worse shape move to the middle of their neighbours, along the
/// surface, where that makes facets better.
std::size_t smooth(RegionComplex& complex, double shape) {
  std::size_t count = 0;
  for (std::uint32_t v = 0; v < complex.vertex_count(); ++v) {
    if (complex.star(v).empty() || complex.worst_shape(v) > shape) continue;
    const std::vector<Spoke> spokes = complex.spokes(v);
    const VertexPlace place = complex.place(v, spokes);
    if (place == VertexPlace::corner) continue;
    Vec3d middle;
    double weight = 0;
    for (const Spoke& spoke : spokes) {
      if (place == VertexPlace::curve && !spoke.is_feature) continue;
      middle += complex.position(spoke.other);
      weight += 1;
    }
    if (weight == 0) continue;  // an image is on a line
    middle = middle / weight;
    const Vec3d r = complex.position(v);
    for (const double part : {1.0, 0.5, 0.25}) {
      const Vec3d wanted = r + part * (middle - r);
      const Vec3d onto = complex.nearest_edge(v, spokes, wanted).r;
      if (!complex.move(v, onto, true)) continue;
      ++count;
      break;
    }
  }
  return count;
}

/// Where a body ends in a tongue along another one, the tongue becomes shorter: unions of layers
/// let it end at a node of the grid only.
std::size_t shorten_tongues(RegionComplex& complex) {
  constexpr double narrow = 0.94;  // 20 degrees
  std::size_t count = 0;
  for (std::uint32_t v = 0; v < complex.vertex_count(); ++v) {
    if (complex.star(v).empty()) continue;
    const std::vector<Spoke> spokes = complex.spokes(v);
    if (complex.place(v, spokes) == VertexPlace::patch) continue;
    const Wedge wedge = complex.narrowest_wedge(v, spokes);
    if (wedge.cosine < narrow) continue;
    const Vec3d r = complex.position(v);
    std::vector<std::uint32_t> others(wedge.beyond.begin(), wedge.beyond.end());
    for (const Spoke& spoke : spokes)
      if (spoke.is_feature) others.push_back(spoke.other);
    for (const std::uint32_t other : others) {
      const Vec3d to = complex.position(other);
      const Vec3d onto = complex.nearest_edge(v, spokes, to).r;
      if (!complex.widen_wedge(other, v, to) && !complex.widen_wedge(other, v, onto) &&
          !complex.widen_wedge(v, other, to) && !complex.widen_wedge(other, v, r))
        continue;
      ++count;
      break;
    }
  }
  return count;
}

class Remesher {
 public:
  Remesher(const RegionMesh& mesh, std::span<const TriMesh> surfaces, const RemeshOptions& options)
      : options_(options), complex_(mesh, surfaces, options) {}

  RegionMesh run() {
    const double h = options_.spacing;
    complex_.limit_targets(h);
    constexpr int sharpening_rounds = 8;
    for (int round = 0; round < sharpening_rounds; ++round) {
      // Cuts of the long edges of tetrahedra lie beside curved surfaces: all on the same side.
      const double good_part = round < 2 ? 0.1 : 0.5;
      move_to_edges(complex_, h, good_part * options_.max_distance);
      shorten_tongues(complex_);
      flip_edges(complex_, any_shape);
      collapse_thin_facets(complex_, small_altitude * h, thin_part, 0);
      collapse_short_edges(complex_, short_edge * h);
      smooth(complex_, poor_shape);
    }
    coarsen();
    complex_.limit_targets(options_.size);
    constexpr int last_rounds = 6;
    for (int round = 0; round < last_rounds; ++round) {
      std::size_t changes = flip_edges(complex_, any_shape);
      changes += collapse_thin_facets(complex_, small_altitude * h, thin_part, 0);
      changes += smooth(complex_, poor_shape);
      if (changes == 0) break;
    }
    repair();
    return complex_.mesh();
  }

 private:
  /// What is still thin costs some distance.
  void repair() {
    const double h = options_.spacing;
    constexpr double nearly_thin = 1.5 * thin_part;
    constexpr double thin_shape = 0.1;
    constexpr int rounds = 4;
    for (int round = 1; round <= rounds; ++round) {
      complex_.allow_distance_at_detail(
          options_.max_distance + (largest_repair * h - options_.max_distance) * round / rounds);
      collapse_thin_facets(complex_, 0, nearly_thin, 0);
      complex_.allow_distance_at_detail(0);
      flip_edges(complex_, thin_shape);
      smooth(complex_, thin_shape);
    }
  }

  void coarsen() {
    constexpr double growth = 1.4;
    constexpr double short_part = 0.7;
    for (double size = options_.spacing; size < options_.size; size *= growth) {
      const double next = std::min(size * growth, options_.size);
      complex_.limit_targets(next);
      collapse_short_edges(complex_, short_part * next);
      flip_edges(complex_, any_shape);
      smooth(complex_, poor_shape);
    }
  }

  RemeshOptions options_;
  RegionComplex complex_;
};

/// The places of a triangle as dense as the grid.
template <class F>
void for_each_place(const std::array<Vec3d, 3>& c, double spacing, const F& do_it) {
  const double longest = std::max({length(c[1] - c[0]), length(c[2] - c[1]), length(c[0] - c[2])});
  const int parts = 2 * std::max(1, static_cast<int>(std::ceil(longest / spacing)));
  for (int a = 0; a <= parts; ++a) {
    for (int b = 0; a + b <= parts; ++b) {
      const double u = static_cast<double>(a) / parts;
      const double w = static_cast<double>(b) / parts;
      do_it(u * c[0] + w * c[1] + (1 - u - w) * c[2]);
    }
  }
}

}  // namespace

RegionMesh remesh(const RegionMesh& mesh, std::span<const TriMesh> surfaces,
                  const RemeshOptions& options) {
  return Remesher(mesh, surfaces, options).run();
}

RegionQuality quality(const RegionMesh& mesh, std::span<const TriMesh> surfaces, double spacing,
                      double size) {
  RegionQuality quality{.least_altitude = 1e300, .least_relative_altitude = 1e300};
  const double plain = (1 + SizeField::growth) * spacing;
  const SizeField targets(surfaces, spacing, std::max(size, plain));
  for (const RegionMesh::Facet& facet : mesh.facets) {
    const int region = mesh.bodies[static_cast<std::size_t>(facet.bodies[0])].region;
    if (mesh.is_flat && !mesh.regions[static_cast<std::size_t>(region)].is_meshed) continue;
    const std::array<Vec3d, 3> c = corners(mesh, facet);
    const double altitude = least_altitude(c);
    const double part = altitude / std::min(size, targets.of_facet(c));
    quality.least_altitude = std::min(quality.least_altitude, altitude);
    quality.least_relative_altitude = std::min(quality.least_relative_altitude, part);
    quality.thin_facets += part < thin_part ? 1 : 0;
  }
  std::vector<TriangleTree> trees;
  for (const TriMesh& surface : surfaces) trees.emplace_back(surface);
  const auto compare = [&](int layer, const Vec3d& r) {
    const ClosestPoint closest = trees[static_cast<std::size_t>(layer)].closest(r);
    if (!closest.found()) return;
    quality.max_distance = std::max(quality.max_distance, closest.distance);
    if (closest.distance > quality.max_plain_distance && targets.at(r) >= plain)
      quality.max_plain_distance = closest.distance;
  };
  if (mesh.is_flat) {
    for (const RegionLine& line : lines_of(mesh)) {
      if (line.layer == RegionMesh::nothing) continue;
      const Vec3d a = mesh.vertices[line.ends[0]];
      const Vec3d b = mesh.vertices[line.ends[1]];
      const int parts = 2 * std::max(1, static_cast<int>(std::ceil(length(b - a) / spacing)));
      for (int n = 0; n <= parts; ++n)
        compare(line.layer, a + (static_cast<double>(n) / parts) * (b - a));
    }
    return quality;
  }
  TriMesh interfaces;
  for (const Vec3d& r : mesh.vertices) interfaces.vertices.emplace_back(r);
  for (const RegionMesh::Facet& facet : mesh.facets) {
    if (facet.layer == RegionMesh::nothing) continue;
    interfaces.triangles.push_back(facet.corners);
    for_each_place(corners(mesh, facet), spacing, [&](const Vec3d& r) { compare(facet.layer, r); });
  }
  const TriangleTree tree(interfaces);
  for (const TriMesh& surface : surfaces)
    for (const Vec3f& r : surface.vertices)
      quality.reverse_max_distance =
          std::max(quality.reverse_max_distance, tree.closest(Vec3d(r)).distance);
  return quality;
}

}  // namespace scarp

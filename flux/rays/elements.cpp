#include "flux/rays/elements.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "flux/rays/spatial_order.h"

namespace scarp {

namespace {

// A facet is cut into at most 2^10 pieces.
constexpr int most_cuts = 10;

constexpr double least_cosine = 0.906;  // of 25 degrees, across an edge

// Of the length of the mean normal in a cell: an arc of 20 degrees.
constexpr double least_mean_normal = 0.995;

// In spacings: cells are not halved further because the surface turns in them.
constexpr double narrowest_cell = 2;

double square_of(Vec3d v) { return dot(v, v); }

bool has_longer_edge(const std::array<Vec3d, 3>& corners, double longest) {
  const auto& [a, b, c] = corners;
  return std::max({square_of(b - a), square_of(c - b), square_of(a - c)}) > longest * longest;
}

std::array<Vec3d, 3> as_double(const std::array<Vec3f, 3>& corners) {
  return {Vec3d(corners[0]), Vec3d(corners[1]), Vec3d(corners[2])};
}

// The shares of the corners of a facet at a point of it.
std::array<double, 3> shares(const std::array<Vec3d, 3>& corners, Vec3d n, Vec3d r) {
  const auto& [a, b, c] = corners;
  return {dot(n, cross(b - r, c - r)), dot(n, cross(c - r, a - r)), dot(n, cross(a - r, b - r))};
}

}  // namespace

Elements::Elements(const RayScene& scene, double longest_edge, bool of_section)
    : are_of_section_(of_section), scene_(&scene) {
  first_of_facet_.reserve(scene.facet_count() + 1);
  root_.reserve(scene.facet_count());
  pieces_.reserve(scene.facet_count());
  nodes_.reserve(scene.facet_count());
  for (std::uint32_t f = 0; f < scene.facet_count(); ++f) {
    first_of_facet_.push_back(static_cast<std::uint32_t>(pieces_.size()));
    root_.push_back(cut(f, as_double(scene.corners(f)), scene.area(f), longest_edge, 0));
  }
  first_of_facet_.push_back(static_cast<std::uint32_t>(pieces_.size()));
  of_facet_.resize(pieces_.size());
  std::iota(of_facet_.begin(), of_facet_.end(), 0U);
  join_with(of_facet_);
}

void Elements::join(const TriMesh& mesh, double width) {
  join(mesh, std::vector<float>(scene_->facet_count(), static_cast<float>(width)));
}

void Elements::join(const TriMesh& mesh, std::span<const float> widths) {
  widths_.assign(widths.begin(), widths.end());
  const auto [narrowest, widest] = std::ranges::minmax(widths);
  DisjointSets joined(pieces_.size());
  std::vector<std::uint32_t> left;
  for (float width = widest; width >= narrowest || !left.empty(); width /= 2) {
    for (std::uint32_t p = 0; p < pieces_.size(); ++p)
      if (widths[pieces_[p].facet] == width) left.push_back(p);
    left = join_in_cells(mesh, left, width, joined, width > narrowest_cell);
  }
  std::vector<std::uint32_t> lowest(pieces_.size());
  for (std::uint32_t p = 0; p < lowest.size(); ++p) lowest[p] = joined.lowest(p);
  join_with(lowest);
}

// Joins some pieces by cells; returns those of cells in which the surface turns, if these are to be
// left alone.
std::vector<std::uint32_t> Elements::join_in_cells(const TriMesh& mesh,
                                                   std::span<const std::uint32_t> some,
                                                   double width, DisjointSets& joined,
                                                   bool leave_turning) const {
  const SceneCells cells(*scene_, width);
  std::vector<std::uint64_t> keys;
  std::vector<std::uint32_t> short_ones;
  keys.reserve(some.size());
  short_ones.reserve(some.size());
  for (const std::uint32_t p : some) {
    if (has_longer_edge(pieces_[p].corners, width)) continue;
    const int direction = main_direction(pieces_[p].normal);
    Vec3d r = middle_of(pieces_[p].corners);
    // Along a wall flux changes less than down it.
    if (direction / 2 < 2) r = {r.x / 2, r.y / 2, r.z};
    keys.push_back(cells.key(r, direction));
    short_ones.push_back(p);
  }
  std::vector<std::uint32_t> left;
  std::vector<std::uint32_t> in_cell;
  const std::vector<std::uint32_t> order = sorted_order(keys);
  for (std::size_t k = 0; k < order.size();) {
    const std::uint64_t key = keys[order[k]];
    in_cell.clear();
    for (; k < order.size() && keys[order[k]] == key; ++k) in_cell.push_back(short_ones[order[k]]);
    if (leave_turning && turns(in_cell))
      left.insert(left.end(), in_cell.begin(), in_cell.end());
    else
      join_neighbours(mesh, in_cell, joined);
  }
  return left;
}

bool Elements::turns(std::span<const std::uint32_t> pieces) const {
  Vec3d normal;
  double area = 0;
  for (const std::uint32_t p : pieces) {
    normal += pieces_[p].area * pieces_[p].normal;
    area += pieces_[p].area;
  }
  return length(normal) < least_mean_normal * area;
}

// Pieces whose facets are the same or have a common edge.
void Elements::join_neighbours(const TriMesh& mesh, std::span<const std::uint32_t> pieces,
                               DisjointSets& joined) const {
  struct Edge {
    std::uint32_t from;
    std::uint32_t to;
    std::uint32_t piece;
  };
  const auto ends = [](const Edge& e) { return std::tuple(e.from, e.to); };
  const auto material = [&](std::uint32_t f) {
    return mesh.materials.empty() ? 0 : mesh.materials[f];
  };
  std::vector<Edge> edges;
  edges.reserve(3 * pieces.size());
  for (const std::uint32_t p : pieces) {
    const Triangle& t = mesh.triangles[pieces_[p].facet];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
      edges.push_back({low, high, p});
    }
  }
  std::sort(edges.begin(), edges.end(), [&](const Edge& a, const Edge& b) {
    return std::tuple(ends(a), a.piece) < std::tuple(ends(b), b.piece);
  });
  for (std::size_t k = 1; k < edges.size(); ++k) {
    const Piece& a = pieces_[edges[k - 1].piece];
    const Piece& b = pieces_[edges[k].piece];
    if (ends(edges[k - 1]) == ends(edges[k]) && material(a.facet) == material(b.facet) &&
        dot(a.normal, b.normal) > least_cosine)
      joined.join(edges[k - 1].piece, edges[k].piece);
  }
}

void Elements::join_rings(std::span<const std::uint32_t> rings) {
  std::vector<std::uint32_t> lowest(rings.size());
  for (std::uint32_t f = 1; f < lowest.size(); ++f)
    lowest[f] = rings[f] == rings[f - 1] ? lowest[f - 1] : f;
  join_with(lowest);
  are_rings_ = true;
}

// lowest: of the pieces that each one is joined with. Elements are numbered by it.
void Elements::join_with(std::span<const std::uint32_t> lowest) {
  std::vector<std::uint32_t> element_of(pieces_.size());
  area_.clear();
  middle_.clear();
  normal_.clear();
  for (std::uint32_t p = 0; p < pieces_.size(); ++p) {
    if (lowest[p] == p) {
      element_of[p] = static_cast<std::uint32_t>(area_.size());
      area_.push_back(0);
      middle_.emplace_back();
      normal_.emplace_back();
    } else {
      element_of[p] = element_of[lowest[p]];
    }
    area_[element_of[p]] += pieces_[p].area;
    middle_[element_of[p]] += pieces_[p].area * middle_of(pieces_[p].corners);
    normal_[element_of[p]] += pieces_[p].area * pieces_[p].normal;
  }
  for (std::size_t e = 0; e < area_.size(); ++e) {
    middle_[e] = middle_[e] / area_[e];
    normal_[e] = normal_[e] / area_[e];
  }
  element_of_ = std::move(element_of);
  first_of_element_.assign(area_.size() + 1, 0);
  for (const std::uint32_t element : element_of_) ++first_of_element_[element + 1];
  std::partial_sum(first_of_element_.begin(), first_of_element_.end(), first_of_element_.begin());
  below_.resize(pieces_.size());
  if (area_.size() < pieces_.size()) put_together();
}

// Rays start anywhere on an element: its pieces have to lie close together in memory.
void Elements::put_together() {
  std::vector<std::uint32_t> next(first_of_element_.begin(), first_of_element_.end() - 1);
  std::vector<double> filled(area_.size());
  std::vector<Piece> pieces(pieces_.size());
  std::vector<std::uint32_t> place(pieces_.size());
  for (std::uint32_t p = 0; p < pieces_.size(); ++p) {
    const std::uint32_t element = element_of_[p];
    place[p] = next[element]++;
    pieces[place[p]] = pieces_[p];
    below_[place[p]] = filled[element];
    filled[element] += pieces_[p].area;
  }
  pieces_ = std::move(pieces);
  for (std::uint32_t& p : of_facet_) p = place[p];
  for (Node& node : nodes_)
    if (node.corner < 0) node.next = place[node.next];
  for (std::uint32_t element = 0; element < area_.size(); ++element)
    for (const std::uint32_t p : pieces_of(element)) element_of_[p] = element;
}

// The halves of (p, q, r), cut from p to the middle m of q and r, are (p, q, m) and (p, m, r).
std::uint32_t Elements::cut(std::uint32_t facet, const std::array<Vec3d, 3>& corners, double area,
                            double longest_edge, int depth) {
  int opposite = 0;
  double longest = 0;
  for (int corner = 0; corner < 3; ++corner) {
    const double edge = square_of(corners[(corner + 2) % 3] - corners[(corner + 1) % 3]);
    if (edge > longest) {
      longest = edge;
      opposite = corner;
    }
  }
  const auto node = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  if (longest <= longest_edge * longest_edge || depth == most_cuts) {
    nodes_[node].next = static_cast<std::uint32_t>(pieces_.size());
    pieces_.push_back({corners, scene_->normal(facet), area, facet});
    return node;
  }
  const Vec3d p = corners[opposite];
  const Vec3d q = corners[(opposite + 1) % 3];
  const Vec3d r = corners[(opposite + 2) % 3];
  const Vec3d m = 0.5 * (q + r);
  const std::uint32_t next = cut(facet, {p, q, m}, area / 2, longest_edge, depth + 1);
  const std::uint32_t other = cut(facet, {p, m, r}, area / 2, longest_edge, depth + 1);
  nodes_[node] = {.corner = opposite, .next = next, .other = other};
  return node;
}

// A point with shares (p, q, r) has shares (p, q - r, 2 r) in the half (p, q, m) if q >= r, and
// (p, 2 q, r - q) in the other half if not.
std::uint32_t Elements::piece_at(std::uint32_t facet, Vec3d r) const {
  const Node* node = &nodes_[root_[facet]];
  if (node->corner < 0) return node->next;
  auto share = shares(as_double(scene_->corners(facet)), scene_->normal(facet), r);
  while (node->corner >= 0) {
    const double of_p = share[node->corner];
    const double of_q = share[(node->corner + 1) % 3];
    const double of_r = share[(node->corner + 2) % 3];
    if (of_q >= of_r) {
      share = {of_p, of_q - of_r, 2 * of_r};
      node = &nodes_[node->next];
    } else {
      share = {of_p, 2 * of_q, of_r - of_q};
      node = &nodes_[node->other];
    }
  }
  return node->next;
}

Elements elements_of(const FluxProblem& problem, std::span<const float> widths) {
  const FluxOptions& options = problem.options;
  if (!options.rings.empty()) {
    Elements rings(problem.scene, std::numeric_limits<double>::infinity(), true);
    rings.join_rings(options.rings);
    return rings;
  }
  // What is seen along a narrow lobe has true errors with blocks of any length.
  const bool joins = !widths.empty();
  Elements elements(problem.scene, longest_piece_edge, joins && !options.joins_facets());
  if (joins && options.joins_facets()) elements.join(problem.mesh, widths);
  return elements;
}

}  // namespace scarp

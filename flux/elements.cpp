#include "flux/elements.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/disjoint_sets.h"
#include "flux/spatial_order.h"

namespace scarp {

namespace {

// A facet is cut into at most 2^10 pieces.
constexpr int most_cuts = 10;

// In spacings. In trenches and holes 20 spacings wide, patches (which are made of whole cells) have
// half the error with joined facets that they have without, from as many rays, and elements of this
// size shift them by less than .0005 of the source; twice the size gains nothing more.
constexpr double cell_width = 2;
constexpr double longest_joined_edge = 2;

constexpr double least_cosine = 0.906;  // of 25 degrees

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
  for (auto* const per_facet : {&first_of_facet_, &count_of_facet_, &root_})
    per_facet->reserve(scene.facet_count());
  pieces_.reserve(scene.facet_count());
  nodes_.reserve(scene.facet_count());
  for (std::uint32_t f = 0; f < scene.facet_count(); ++f) {
    const std::size_t first = pieces_.size();
    first_of_facet_.push_back(static_cast<std::uint32_t>(first));
    root_.push_back(cut(f, as_double(scene.corners(f)), scene.area(f), longest_edge, 0));
    count_of_facet_.push_back(static_cast<std::uint32_t>(pieces_.size() - first));
  }
  element_of_.resize(pieces_.size());
  std::iota(element_of_.begin(), element_of_.end(), 0U);
  first_of_element_ = element_of_;
  first_of_element_.push_back(static_cast<std::uint32_t>(pieces_.size()));
  area_.reserve(pieces_.size());
  for (const Piece& piece : pieces_) area_.push_back(piece.area);
  below_.resize(pieces_.size());
}

bool Elements::can_be_joined(std::uint32_t facet) const {
  return count_of_facet_[facet] == 1 &&
         !has_longer_edge(pieces_[first_of_facet_[facet]].corners, longest_joined_edge);
}

// The lowest facet that each one is joined with.
std::vector<std::uint32_t> Elements::joined_facets(const TriMesh& mesh) const {
  const SceneCells cells(*scene_, cell_width);
  std::vector<std::uint64_t> keys;
  std::vector<std::uint32_t> facets;
  keys.reserve(scene_->facet_count());
  facets.reserve(scene_->facet_count());
  for (std::uint32_t f = 0; f < scene_->facet_count(); ++f) {
    if (!can_be_joined(f)) continue;
    keys.push_back(cells.key(middle_of(pieces_[first_of_facet_[f]].corners),
                             main_direction(scene_->normal(f))));
    facets.push_back(f);
  }
  const std::vector<std::uint32_t> order = sorted_order(keys);
  const auto material = [&](std::uint32_t f) {
    return mesh.materials.empty() ? 0 : mesh.materials[f];
  };

  struct Edge {
    std::uint32_t from;
    std::uint32_t to;
    std::uint32_t facet;
  };
  const auto ends = [](const Edge& e) { return std::tuple(e.from, e.to); };
  DisjointSets joined(scene_->facet_count());
  std::vector<Edge> edges;
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin;
    edges.clear();
    for (; end < order.size() && keys[order[end]] == keys[order[begin]]; ++end) {
      const std::uint32_t f = facets[order[end]];
      const Triangle& t = mesh.triangles[f];
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
        edges.push_back({low, high, f});
      }
    }
    std::sort(edges.begin(), edges.end(), [&](const Edge& a, const Edge& b) {
      return std::tuple(ends(a), a.facet) < std::tuple(ends(b), b.facet);
    });
    for (std::size_t k = 1; k < edges.size(); ++k) {
      const auto [f, g] = std::pair(edges[k - 1].facet, edges[k].facet);
      if (ends(edges[k - 1]) == ends(edges[k]) && material(f) == material(g) &&
          dot(scene_->normal(f), scene_->normal(g)) > least_cosine)
        joined.join(f, g);
    }
    begin = end;
  }
  std::vector<std::uint32_t> lowest(scene_->facet_count());
  for (std::uint32_t f = 0; f < lowest.size(); ++f) lowest[f] = joined.lowest(f);
  return lowest;
}

void Elements::join(const TriMesh& mesh) { join_with(joined_facets(mesh)); }

void Elements::join_rings(std::span<const std::uint32_t> rings) {
  std::vector<std::uint32_t> lowest(rings.size());
  for (std::uint32_t f = 1; f < lowest.size(); ++f)
    lowest[f] = rings[f] == rings[f - 1] ? lowest[f - 1] : f;
  join_with(lowest);
  are_rings_ = true;
}

// lowest: of the facets that each one is joined with, which are not cut.
void Elements::join_with(std::span<const std::uint32_t> lowest) {
  area_.clear();
  for (std::uint32_t p = 0; p < pieces_.size(); ++p) {
    const std::uint32_t facet = pieces_[p].facet;
    if (lowest[facet] == facet) {
      element_of_[p] = static_cast<std::uint32_t>(area_.size());
      area_.push_back(pieces_[p].area);
    } else {
      element_of_[p] = element_of_[first_of_facet_[lowest[facet]]];
      area_[element_of_[p]] += pieces_[p].area;
    }
  }
  first_of_element_.assign(area_.size() + 1, 0);
  for (const std::uint32_t element : element_of_) ++first_of_element_[element + 1];
  std::partial_sum(first_of_element_.begin(), first_of_element_.end(), first_of_element_.begin());
  put_together();
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
  for (std::uint32_t& first : first_of_facet_) first = place[first];
  for (Node& node : nodes_)
    if (node.corner < 0) node.next = place[node.next];
  for (std::uint32_t element = 0; element < area_.size(); ++element)
    for (const std::uint32_t p : pieces_of(element)) element_of_[p] = element;
}

Vec3d Elements::middle(std::size_t element) const {
  Vec3d sum;
  for (const std::uint32_t p : pieces_of(element))
    sum += pieces_[p].area * middle_of(pieces_[p].corners);
  return sum / area_[element];
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

Elements elements_of(const FluxProblem& problem, bool joins) {
  const FluxOptions& options = problem.options;
  if (!options.rings.empty()) {
    Elements rings(problem.scene, std::numeric_limits<double>::infinity(), true);
    rings.join_rings(options.rings);
    return rings;
  }
  // What is seen along a narrow lobe has true errors with blocks of any length.
  Elements elements(problem.scene, longest_element_edge, joins && options.two_dimensional);
  if (joins && !options.two_dimensional) elements.join(problem.mesh);
  return elements;
}

}  // namespace scarp

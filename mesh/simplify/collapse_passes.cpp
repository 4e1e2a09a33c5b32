#include "mesh/simplify/collapse_passes.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <span>

#include "core/parallel.h"
#include "mesh/simplify/blocks.h"
#include "mesh/simplify/collapse_worker.h"
#include "mesh/simplify/tracked_points.h"

namespace scarp {

namespace {

/// For each vertex that is left, the last passes try at least so much, or there would be many.
constexpr double least_tries_per_vertex = 0.05;

/// An edge that has changed is ranked again once the last pass went up to half of its old rank.
constexpr float stale_is_dear = 2;

/// Of passes whose second looks know the points: most of what they try waits.
constexpr CollapsePasses::Approach with_second_looks{.tries = 2.5};

/// Facets whose edges are ranked together.
constexpr std::size_t facets_per_range = 4096;

/// So few vertices are removed as quickly in one block.
constexpr std::uint32_t few = 200;

/// After so many passes that collapse nothing the next ones try more and more.
constexpr int most_idle_passes = 8;

/// Passes are counted in two bytes.
constexpr std::uint16_t most_passes = 0xfff0;

/// Limit of a pass that tries all that is not refused.
constexpr float most_dear = std::numeric_limits<float>::max();

constexpr double unlimited = std::numeric_limits<double>::infinity();

}  // namespace

CollapsePasses::CollapsePasses(CollapseMesh& mesh, CollapseChecks& checks, EdgeSizes& sizes,
                               const PassOrder& order)
    : mesh_(mesh),
      checks_(checks),
      sizes_(sizes),
      order_(order),
      placement_(LindstromTurkPlacement::without_memory(order.measure)),
      planes_(order.by_planes ? std::make_optional<GarlandHeckbertPlacement>(mesh) : std::nullopt),
      floats_(mesh),
      squared_unit_(1 / (floats_.scale * floats_.scale)),
      terms_(mesh.r.size()),
      cost_(mesh.topology.half_edge_count(), never),
      ranked_in_(cost_.size(), 0),
      changed_in_(mesh.r.size(), first_pass),
      merged_in_(mesh.r.size(), 0),
      tied_(mesh.r.size(), 1),
      merged_into_(mesh.r.size()) {
  std::iota(merged_into_.begin(), merged_into_.end(), 0U);
  constexpr std::size_t grain = 4096;
  parallel_for(terms_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
      if (mesh_.topology.outgoing(v) == HalfEdges::none) continue;
      find_terms(v);
      tied_[v] = is_tied(v) ? 1 : 0;
    }
  });
  double twice_area = 0;
  for (std::uint32_t f = 0; f < floats_.normals.size(); ++f) {
    floats_.normals[f].w = floats_.length(checks_.error(f));
    has_kept_ = has_kept_ || floats_.normals[f].w == never;
    twice_area += double{length(normal(f))};
  }
  if (twice_area > 0) points_per_area_ = mesh.live_vertices / twice_area;
}

void CollapsePasses::find_terms(std::uint32_t v) {
  FloatTerms terms;
  mesh_.topology.for_each_outgoing(v, [&](std::uint32_t h) {
    const FloatRecord& record = floats_.normals[HalfEdges::facet(h)];
    terms += FloatTerms::of(order_.measure, vector_lanes(record));
  });
  terms_[v] = terms;
}

[[gnu::always_inline]] inline bool CollapsePasses::is_stale(std::uint32_t h, std::uint32_t u,
                                                            std::uint32_t v) const {
  std::uint16_t changed = std::max(changed_in_[u], changed_in_[v]);
  if (const std::uint32_t twin = mesh_.twin_edge(h); twin != HalfEdges::none) {
    changed = std::max({changed, changed_in_[mesh_.topology.origin(twin)],
                        changed_in_[mesh_.topology.target(twin)]});
  }
  if (ranked_in_[h] >= changed) return false;
  // Far from its turn the old rank will do.
  const bool can_wait = ranked_in_[h] != 0 && cost_[h] < never && cost_[h] > stale_is_dear * limit_;
  return !can_wait;
}

float CollapsePasses::tied_rank(std::uint32_t h) const {
  const Merge rule = merge_rule(mesh_, h);
  return rule == Merge::forbidden ? never : rank_of_tied(h, place(h, rule));
}

float CollapsePasses::rank_of_tied(std::uint32_t h, const Placed& placed) const {
  const double per_cost =
      squared_unit_ * squared_unit_ * (order_.measure == Measure::volume ? squared_unit_ : 1);
  return rank_of(static_cast<float>(placed.cost / per_cost), mesh_.topology.origin(h),
                 mesh_.topology.target(h), squared_length(h));
}

[[gnu::always_inline]] inline bool CollapsePasses::is_wanted(std::uint32_t h, std::uint32_t u,
                                                             std::uint32_t v) const {
  const auto wants = [this](std::uint32_t a, std::uint32_t b) {
    const Vec3f along = edge(a, b);
    const float longest = floats_.length(sizes_.limit_between(a, b));
    return dot(along, along) < longest * longest;
  };
  const std::uint32_t twin = mesh_.twin_edge(h);
  return wants(u, v) && (twin == HalfEdges::none ||
                         wants(mesh_.topology.origin(twin), mesh_.topology.target(twin)));
}

void CollapsePasses::rank_edges_of(std::uint32_t begin, std::uint32_t end, Ranked& ranked) {
  const HalfEdges& topology = mesh_.topology;
  EdgeCosts costs(order_.measure);
  const auto finish = [&] {
    costs.finish([&](const EdgeCosts::Edge& edge, float cost, float square) {
      cost_[edge.h] = rank_of(cost, edge.u, edge.v, square);
    });
  };
  std::array<std::uint32_t, std::size_t{3} * facets_per_range> edges;
  const std::size_t edge_count = list_edges(begin, end, edges);
  const bool has_limits = sizes_.has_limits();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < edge_count; ++i) {
    const std::uint32_t h = edges[i];
    const std::uint32_t u = topology.origin(h);
    const std::uint32_t v = topology.target(h);
    const bool stale = is_stale(h, u, v);
    if (!stale && cost_[h] == never) continue;
    if (has_limits && !is_wanted(h, u, v)) continue;
    edges[kept++] = h;
    if (!stale) continue;
    ranked_in_[h] = static_cast<std::uint16_t>(pass_ - 1);
    if ((tied_[u] | tied_[v]) != 0) {
      cost_[h] = tied_rank(h);
      continue;
    }
    const FloatLanes along = vector_lanes(floats_.r[v]) - vector_lanes(floats_.r[u]);
    costs.add({h, u, v}, along, terms_[u], terms_[v],
              vector_lanes(floats_.normals[HalfEdges::facet(h)]),
              vector_lanes(floats_.normals[HalfEdges::facet(topology.opposite(h))]));
    if (costs.is_full()) finish();
  }
  finish();
  ranked.edge_count = edge_count;
  ranked.candidates.edges.assign(edges.begin(), edges.begin() + kept);
  ranked.candidates.bins.resize(kept);
  for (std::size_t i = 0; i < kept; ++i) {
    const std::uint32_t bin = CostHistogram::bin(cost_[edges[i]]);
    ranked.candidates.bins[i] = static_cast<std::uint16_t>(bin);
    ranked.costs.add(bin);
  }
}

/// Edges of a range of facets, into an array with room for all their half edges. Returns how many.
std::size_t CollapsePasses::list_edges(std::uint32_t begin, std::uint32_t end,
                                       std::span<std::uint32_t> edges) const {
  const HalfEdges& topology = mesh_.topology;
  std::size_t count = 0;
  for (std::uint32_t f = begin; f < end; ++f) {
    if (!topology.alive(f)) continue;
    for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h) {
      // Written anyway, and kept or not: half of all are not, in no order that could be foreseen.
      edges[count] = h;
      count += topology.is_edge(h) ? 1 : 0;
    }
  }
  if (!mesh_.has_twins()) return count;
  const auto is_of_twin = [&](std::uint32_t h) {
    return topology.opposite(h) == HalfEdges::none && mesh_.edge(h) != h;
  };
  const auto listed_end = edges.begin() + static_cast<std::ptrdiff_t>(count);
  return static_cast<std::size_t>(std::remove_if(edges.begin(), listed_end, is_of_twin) -
                                  edges.begin());
}

std::vector<CollapsePasses::Ranked> CollapsePasses::rank() {
  const std::size_t facet_count = mesh_.normals.size();
  std::vector<Ranked> ranked((facet_count + facets_per_range - 1) / facets_per_range);
  parallel_for(facet_count, facets_per_range, [&](std::size_t begin, std::size_t end) {
    rank_edges_of(static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end),
                  ranked[begin / facets_per_range]);
  });
  return ranked;
}

/// Of the candidates of a range those up to a bin of costs, by the block that holds both ends.
void CollapsePasses::split(const Blocks& blocks, std::uint32_t last_bin, Ranked& ranked) const {
  const auto& [edges, bins] = ranked.candidates;
  std::vector<Part>& parts = ranked.parts;
  std::size_t last = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (bins[i] > last_bin) continue;
    const std::uint32_t h = edges[i];
    const std::uint32_t block = blocks.of(mesh_.topology.origin(h));
    if (!blocks.holds(block, mesh_.topology.target(h))) continue;
    // Few blocks meet in a range, and neighbours are mostly in the same one.
    if (last == parts.size() || parts[last].block != block) {
      const auto part = std::find_if(parts.begin(), parts.end(),
                                     [&](const Part& each) { return each.block == block; });
      last = static_cast<std::size_t>(part - parts.begin());
      if (part == parts.end()) parts.push_back({block, {}});
    }
    parts[last].candidates.edges.push_back(h);
    parts[last].candidates.bins.push_back(bins[i]);
  }
}

/// How many edges each block has, after split().
std::vector<std::size_t> CollapsePasses::edges_of(std::span<const Ranked> ranked,
                                                  std::uint32_t block_count) {
  std::vector<std::size_t> result(block_count, 0);
  for (const Ranked& each : ranked) {
    for (const Part& part : each.parts) result[part.block] += part.candidates.edges.size();
  }
  return result;
}

/// Returns how many vertices are gone, of those that are more than the target.
std::uint32_t CollapsePasses::run_pass(const Blocks& blocks, std::uint32_t target,
                                       double most_share, double most_tries) {
  ++pass_;
  std::vector<Ranked> ranked = rank();
  CostHistogram costs;
  std::size_t edge_count = 0;
  for (const Ranked& each : ranked) {
    costs.add(each.costs);
    edge_count += each.edge_count;
  }
  const double tries = std::min(most_share * static_cast<double>(edge_count), most_tries);
  const std::uint32_t last_bin = costs.bin_beyond(tries);
  limit_ = CostHistogram::upper_end(last_bin);
  // The blocks together collapse no more than are to go.
  const double share = (mesh_.live_vertices - target + 0.5) / costs.up_to(last_bin);

  parallel_for(ranked.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t range = begin; range < end; ++range) split(blocks, last_bin, ranked[range]);
  });
  std::vector<std::uint32_t> removed(blocks.count(), 0);
  std::vector<std::uint8_t> bound_was_met(blocks.count(), 0);
  for_each_block(edges_of(ranked, blocks.count()), [&](std::uint32_t block) {
    Worker worker(*this, blocks, block);
    worker.run(ranked, last_bin, share);
    removed[block] = worker.removed();
    bound_was_met[block] = worker.bound_was_met() ? 1 : 0;
  });
  if (std::find(bound_was_met.begin(), bound_was_met.end(), 1) != bound_was_met.end()) {
    checks_.note_bound_was_met();
  }
  const std::uint32_t sum = std::accumulate(removed.begin(), removed.end(), 0U);
  mesh_.live_vertices -= sum;
  return sum;
}

bool CollapsePasses::approach(std::uint32_t target, const Approach& until) {
  int idle_passes = 0;
  double factor = 1;
  while (mesh_.live_vertices > target && pass_ < most_passes) {
    const std::uint32_t before = mesh_.live_vertices;
    const std::uint32_t wanted = before - target;
    if (target > 0 && wanted <= std::max<double>(few, until.nearest * before)) return true;
    const double most_tries = target > 0 ? factor * until.tries * wanted : unlimited;
    const std::uint32_t removed =
        run_pass(Blocks(mesh_, pass_ + 1), target, factor * until.share_of_pass, most_tries);
    const bool all_refused = removed == 0 && limit_ < most_dear;
    // What is dearer than its rank says, by rounding, comes up again and again.
    idle_passes = all_refused ? idle_passes + 1 : 0;
    factor = idle_passes > most_idle_passes ? 2 * factor : 1;
    if (removed <= until.least * wanted && !all_refused) return false;
  }
  return mesh_.live_vertices <= target;
}

void CollapsePasses::run_to(std::uint32_t target) {
  approach(target, order_.looks_twice ? with_second_looks : Approach{});
  double factor = 1;
  while (mesh_.live_vertices > target && pass_ < most_passes) {
    const double tries = factor * std::max(Approach{}.tries * (mesh_.live_vertices - target),
                                           least_tries_per_vertex * mesh_.live_vertices);
    if (run_pass(Blocks::whole(mesh_), target, 1, tries) > 0) continue;
    if (limit_ >= most_dear) return;
    // All that it tried was refused, or a pair where one vertex is to go.
    factor *= 2;
  }
}

void CollapsePasses::forget_refusals() { std::fill(ranked_in_.begin(), ranked_in_.end(), 0); }

}  // namespace scarp

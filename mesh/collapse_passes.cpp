#include "mesh/collapse_passes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <numeric>
#include <optional>
#include <span>

#include "core/parallel.h"
#include "mesh/blocks.h"
#include "mesh/edge_cost.h"
#include "mesh/pass_star.h"
#include "mesh/placement.h"

namespace scarp {

namespace {

constexpr float never = std::numeric_limits<float>::infinity();

/// How much of all edges a pass tries, the cheapest first.
constexpr double share_of_pass = 0.25;

/// An edge that has changed is ranked again once the last pass went up to half of its old cost.
constexpr float stale_is_dear = 2;

/// What an edge may cost after the changes of its pass, in limits of the pass.
constexpr float slack = 2;

/// A pass that removes less of the vertices is the last one.
constexpr double least_share = 0.01;

/// Passes are counted in a byte; there are about ten.
constexpr std::uint8_t most_passes = 100;

/// Before the first pass; 0 is before that.
constexpr std::uint8_t first_pass = 1;

/// Costs by their order of magnitude, eight parts to each factor of two.
class Histogram {
 public:
  static constexpr std::uint32_t size = 1U << 11;

  Histogram() : counts_(size, 0) {}
  /// cost: not negative.
  static std::uint32_t bin(float cost) { return std::bit_cast<std::uint32_t>(cost) >> 20; }
  void add(float cost) { ++counts_[bin(cost)]; }
  void add(const Histogram& other) {
    for (std::uint32_t i = 0; i < size; ++i) counts_[i] += other.counts_[i];
  }

  /// The bin with which the cheapest bins hold more than so many; at most the last finite one.
  std::uint32_t bin_beyond(double wanted) const {
    const std::uint32_t last = bin(std::numeric_limits<float>::max());
    std::uint32_t i = 0;
    for (double sum = counts_[0]; sum <= wanted && i < last; sum += counts_[i]) ++i;
    return i;
  }
  static float upper_end(std::uint32_t bin) { return std::bit_cast<float>((bin + 1) << 20); }

 private:
  std::vector<std::uint32_t> counts_;
};

class CollapsePasses {
 public:
  CollapsePasses(CollapseMesh& mesh, CollapseChecks& checks, EdgeSizes& sizes);

  void run();
  std::vector<std::uint32_t> merged_into() && { return std::move(merged_into_); }

 private:
  /// Of a block, in a pass.
  struct Candidates {
    std::vector<std::uint32_t> edges;
    Histogram costs;
    std::size_t edge_count = 0;
  };
  class Worker;

  void find_terms(std::uint32_t v);
  std::vector<Candidates> rank(const Blocks& blocks);
  void rank_block(const Blocks& blocks, std::uint32_t block, Candidates& candidates);
  void list_edges(const Blocks& blocks, std::uint32_t block, std::vector<std::uint32_t>& edges);
  bool is_stale(std::uint32_t h, std::uint32_t u, std::uint32_t v) const;
  float tied_cost(std::uint32_t h) const;
  std::uint32_t run_pass();

  bool is_tied(std::uint32_t v) const {
    return mesh_.kind[v] != VertexKind::free || mesh_.sides[v] != 0 ||
           mesh_.topology.on_boundary(v);
  }
  Vec3f edge(std::uint32_t u, std::uint32_t v) const {
    const FloatRecord& a = floats_.r[u];
    const FloatRecord& b = floats_.r[v];
    return {b.x - a.x, b.y - a.y, b.z - a.z};
  }
  Vec3f normal(std::uint32_t f) const {
    const FloatRecord& n = floats_.normals[f];
    return {n.x, n.y, n.z};
  }
  float stretched(float cost, std::uint32_t u, std::uint32_t v, float squared_length) const {
    return cost * static_cast<float>(sizes_.stretch(u, v, squared_length));
  }

  CollapseMesh& mesh_;
  CollapseChecks& checks_;
  EdgeSizes& sizes_;
  LindstromTurkPlacement placement_;  ///< of tied edges
  FloatMesh floats_;
  LargeVector<FloatTerms> terms_;           ///< per vertex
  LargeVector<float> cost_;                 ///< per half edge; never: refused
  LargeVector<std::uint8_t> ranked_in_;     ///< per half edge: the pass; 0: not yet
  std::vector<std::uint8_t> changed_in_;    ///< per vertex: the pass that changed its facets
  std::vector<std::uint8_t> merged_in_;     ///< per vertex: the pass that merged it
  std::vector<std::uint8_t> tied_;          ///< per vertex: whether not free to go anywhere
  std::vector<std::uint8_t> at_seam_;       ///< per vertex: whether it has neighbours elsewhere
  std::vector<std::uint32_t> merged_into_;  ///< per vertex
  bool has_kept_ = false;                   ///< facets
  float limit_ = 0;                         ///< on the costs of the last pass
  std::uint8_t pass_ = first_pass;
};

/// Collapses edges of a block.
class CollapsePasses::Worker {
 public:
  Worker(CollapsePasses& all, const Blocks& blocks, std::uint32_t block)
      : all_(all),
        mesh_(all.mesh_),
        blocks_(blocks),
        block_(block),
        checks_(all.checks_.sharing()),
        bound_(static_cast<float>(all.checks_.bound())) {
    if (mesh_.has_twins()) twin_checks_.emplace(checks_.sharing());
  }

  /// From cheap to dear, up to a bin of costs.
  void run(std::span<const std::uint32_t> edges, std::uint32_t last_bin) {
    const std::vector<std::uint32_t> in_order = sorted(edges, last_bin);
    for (std::size_t i = 0; i < in_order.size(); ++i) {
      fetch_ahead(in_order, i);
      const std::uint32_t h = in_order[i];
      const std::uint32_t u = mesh_.topology.origin(h);
      if (u == HalfEdges::none) continue;
      const std::uint32_t v = mesh_.topology.target(h);
      if (all_.merged_in_[u] == all_.pass_ || all_.merged_in_[v] == all_.pass_) continue;
      if ((all_.tied_[u] | all_.tied_[v]) != 0) {
        try_tied(h);
      } else if ((all_.at_seam_[u] | all_.at_seam_[v]) == 0) {
        try_free(h, u, v);
      }
    }
  }

  std::uint32_t removed() const { return removed_; }
  bool bound_was_met() const { return checks_.bound_was_met(); }

 private:
  std::vector<std::uint32_t> sorted(std::span<const std::uint32_t> edges,
                                    std::uint32_t last_bin) const {
    std::vector<std::uint32_t> begin(last_bin + 2, 0);
    const auto bin = [this](std::uint32_t h) { return Histogram::bin(all_.cost_[h]); };
    for (const std::uint32_t h : edges) {
      if (bin(h) <= last_bin) ++begin[bin(h) + 1];
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::uint32_t> result(begin.back());
    for (const std::uint32_t h : edges) {
      if (bin(h) <= last_bin) result[begin[bin(h)]++] = h;
    }
    return result;
  }

  /// Asks for the memory of edges whose turn comes soon: those of one cost lie anywhere.
  void fetch_ahead(std::span<const std::uint32_t> edges, std::size_t i) const {
    constexpr std::size_t far = 12;
    constexpr std::size_t near = 6;
    if (i + far < edges.size()) mesh_.topology.prefetch(edges[i + far]);
    if (i + near >= edges.size()) return;
    const std::uint32_t u = mesh_.topology.origin(edges[i + near]);
    if (u == HalfEdges::none) return;
    prefetch(&all_.terms_[u]);
    prefetch(&all_.floats_.r[u]);
    prefetch(&all_.floats_.normals[HalfEdges::facet(edges[i + near])]);
  }

  void refuse(std::uint32_t h) { all_.cost_[h] = never; }

  void try_free(std::uint32_t h, std::uint32_t u, std::uint32_t v) {
    const Vec3f edge = all_.edge(u, v);
    const FloatPlaced placed =
        place_merged(edge, all_.terms_[u], all_.terms_[v], all_.normal(HalfEdges::facet(h)),
                     all_.normal(HalfEdges::facet(mesh_.topology.opposite(h))));
    // Dearer now, after the changes of this pass: perhaps in the next one.
    if (!(all_.stretched(placed.cost, u, v, dot(edge, edge)) <= slack * all_.limit_)) return;
    const Vec3d r = mesh_.rounded(mesh_.r[u] + Vec3d(placed.r));
    if (allows(h, r)) {
      collapse_free(h, r);
    } else {
      refuse(h);
    }
  }

  bool allows(std::uint32_t h, Vec3d r) {
    if (!star_.gather(mesh_.topology, h)) return false;
    for (int i = 0; i < star_.star().count; ++i) prefetch(&all_.terms_[star_.star().ring[i]]);
    star_.place_at(mesh_, all_.floats_, FloatMesh::record(r));
    if (!keeps_lengths() || !star_.keeps_facets(mesh_)) return false;
    if (!all_.has_kept_ && star_.exceeds(all_.floats_, bound_)) {
      checks_.note_bound_was_met();
      return false;
    }
    return star_.makes_no_fold(mesh_, all_.floats_) && mesh_.is_within_sides(r) &&
           checks_.keeps_bound(mesh_, star_.star(), r);
  }

  bool keeps_lengths() {
    const EdgeSizes& sizes = all_.sizes_;
    if (!sizes.has_limits()) return true;
    if (sizes.limit.empty()) return star_.keeps_length(static_cast<float>(2 * sizes.l_max));
    const Star& star = star_.star();
    std::array<float, PassStar::capacity> limits;
    for (int i = 0; i < star.count; ++i) {
      limits[i] = static_cast<float>(2 * std::min(sizes.limit_between(star.u, star.ring[i]),
                                                  sizes.limit_between(star.v, star.ring[i])));
    }
    return star_.keeps_lengths(limits);
  }

  void collapse_free(std::uint32_t h, Vec3d r) {
    const Star& star = star_.star();
    checks_.accept(star);
    replace_terms(star, r);
    mesh_.collapse(h, r);
    note_merger(star);
  }

  /// The terms of the merged vertex and its ring: by what the facets around become.
  void replace_terms(const Star& star, Vec3d r) {
    FloatTerms merged;
    std::array<FloatTerms, PassStar::capacity> changes;
    Vec3d x = mesh_.r[star.ring[0]] - r;
    for (int i = 0; i < star.count; ++i) {
      const Vec3d y = mesh_.r[star.ring[i + 1]] - r;
      const std::uint32_t f = star.facet[i];
      const Vec3d n = cross(x, y);
      mesh_.normals[f] = n;
      FloatTerms& change = changes[i];
      change.add(1, Vec3f(n));
      merged.add(change);
      change.add(-1, all_.normal(f));
      all_.floats_.normals[f] = FloatMesh::record(n, checks_.error(f));
      x = y;
    }
    for (int i = 0; i < star.count; ++i) {
      FloatTerms& terms = all_.terms_[star.ring[i]];
      terms.add(changes[i]);
      terms.add(changes[i == 0 ? star.count - 1 : i - 1]);
    }
    for (const std::uint32_t f : star.dying) {
      const std::uint32_t h = 3 * f;
      for (std::uint32_t g = h; g < h + 3; ++g) {
        const std::uint32_t w = mesh_.topology.origin(g);
        if (w != star.u && w != star.v) all_.terms_[w].add(-1, all_.normal(f));
      }
    }
    all_.terms_[star.u] = merged;
  }

  void note_merger(const Star& star) {
    ++removed_;
    all_.floats_.r[star.u] = FloatMesh::record(mesh_.r[star.u]);
    all_.sizes_.merged(star.u, star.v);
    all_.merged_into_[star.v] = star.u;
    all_.merged_in_[star.u] = all_.pass_;
    all_.changed_in_[star.u] = all_.pass_;
    for (int i = 0; i <= star.count; ++i) all_.changed_in_[star.ring[i]] = all_.pass_;
  }

  /// An edge that is not free in its places, and its twin edge if it has one.
  void try_tied(std::uint32_t listed) {
    if (!blocks_.holds_edge(block_, mesh_, listed)) return;
    const std::uint32_t h = mesh_.from_twin(listed);
    const std::uint32_t twin = mesh_.twin_edge(h);
    const Merge rule = merge_rule(mesh_, h);
    if (rule == Merge::forbidden) {
      refuse(listed);
      return;
    }
    const Vec3d r = all_.placement_.place(mesh_, h, rule).r;
    const bool fits =
        checks_.gather(mesh_, h, r) &&
        (twin == HalfEdges::none || twin_checks_->gather(mesh_, twin, mesh_.twin_place(h, r)));
    // What surrounds it may be changing.
    if (fits && !is_mine(twin)) return;
    if (fits && keeps_tied(h, twin)) {
      collapse_tied(h, twin, r);
    } else {
      refuse(listed);
    }
  }

  bool is_mine(std::uint32_t twin) const {
    return blocks_.holds(block_, checks_.star()) &&
           (twin == HalfEdges::none || blocks_.holds(block_, twin_checks_->star()));
  }

  bool keeps_tied(std::uint32_t h, std::uint32_t twin) {
    const EdgeSizes& sizes = all_.sizes_;
    if (!checks_.keeps_surface(mesh_, h) || !sizes.allows(mesh_, checks_)) return false;
    if (twin == HalfEdges::none) return checks_.keeps_bound(mesh_);
    if (!twin_checks_->keeps_surface(mesh_, twin) || !sizes.allows(mesh_, *twin_checks_) ||
        !checks_.star().is_apart_from(twin_checks_->star())) {
      return false;
    }
    if (checks_.keeps_bound(mesh_) && twin_checks_->keeps_bound(mesh_)) return true;
    checks_.note_bound_was_met();
    return false;
  }

  void collapse_tied(std::uint32_t h, std::uint32_t twin, Vec3d r) {
    checks_.accept(mesh_, h);
    if (twin != HalfEdges::none) twin_checks_->accept(mesh_, twin);
    mesh_.collapse(h, r);
    note_tied(checks_);
    if (twin != HalfEdges::none) note_tied(*twin_checks_);
  }

  void note_tied(const CollapseChecks& checks) {
    const Star& star = checks.star();
    for (int i = 0; i < star.count; ++i) {
      const std::uint32_t f = star.facet[i];
      mesh_.normals[f] = checks.normals()[i];
      all_.floats_.normals[f] = FloatMesh::record(mesh_.normals[f], checks.error(f));
    }
    note_merger(star);
    all_.find_terms(star.u);
    for (int i = 0; i <= star.count; ++i) all_.find_terms(star.ring[i]);
    all_.tied_[star.u] = all_.is_tied(star.u) ? 1 : 0;
  }

  CollapsePasses& all_;
  CollapseMesh& mesh_;
  const Blocks& blocks_;
  std::uint32_t block_;
  CollapseChecks checks_;
  std::optional<CollapseChecks> twin_checks_;  ///< only where there are twins
  PassStar star_;
  float bound_;
  std::uint32_t removed_ = 0;
};

CollapsePasses::CollapsePasses(CollapseMesh& mesh, CollapseChecks& checks, EdgeSizes& sizes)
    : mesh_(mesh),
      checks_(checks),
      sizes_(sizes),
      placement_(LindstromTurkPlacement::without_memory()),
      floats_(mesh),
      terms_(mesh.r.size()),
      cost_(mesh.topology.half_edge_count(), never),
      ranked_in_(cost_.size(), 0),
      changed_in_(mesh.r.size(), first_pass),
      merged_in_(mesh.r.size(), 0),
      tied_(mesh.r.size(), 1),
      at_seam_(mesh.r.size(), 0),
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
  for (std::uint32_t f = 0; f < floats_.normals.size(); ++f) {
    floats_.normals[f].w = static_cast<float>(checks_.error(f));
    has_kept_ = has_kept_ || floats_.normals[f].w == never;
  }
}

void CollapsePasses::find_terms(std::uint32_t v) {
  FloatTerms terms;
  mesh_.topology.for_each_outgoing(
      v, [&](std::uint32_t h) { terms.add(1, normal(HalfEdges::facet(h))); });
  terms_[v] = terms;
}

bool CollapsePasses::is_stale(std::uint32_t h, std::uint32_t u, std::uint32_t v) const {
  std::uint8_t changed = std::max(changed_in_[u], changed_in_[v]);
  if (const std::uint32_t twin = mesh_.twin_edge(h); twin != HalfEdges::none) {
    changed = std::max({changed, changed_in_[mesh_.topology.origin(twin)],
                        changed_in_[mesh_.topology.target(twin)]});
  }
  if (ranked_in_[h] >= changed) return false;
  // Far from its turn the old rank will do.
  const bool can_wait = ranked_in_[h] != 0 && cost_[h] < never && cost_[h] > stale_is_dear * limit_;
  return !can_wait;
}

float CollapsePasses::tied_cost(std::uint32_t h) const {
  const Merge rule = merge_rule(mesh_, h);
  if (rule == Merge::forbidden) return never;
  const double square = mesh_.squared_length(h);
  const std::uint32_t twin = mesh_.twin_edge(h);
  if (!sizes_.wanted(mesh_, h, square)) return never;
  if (twin != HalfEdges::none && !sizes_.wanted(mesh_, twin, square)) return never;
  return stretched(static_cast<float>(placement_.place(mesh_, h, rule).cost),
                   mesh_.topology.origin(h), mesh_.topology.target(h), static_cast<float>(square));
}

void CollapsePasses::rank_block(const Blocks& blocks, std::uint32_t block, Candidates& candidates) {
  const HalfEdges& topology = mesh_.topology;
  EdgeCosts costs;
  const auto finish = [&] {
    costs.finish([&](std::uint32_t h, float cost, float square) {
      const bool wanted = !sizes_.has_limits() || sizes_.wanted(mesh_, h, square);
      cost_[h] = wanted ? stretched(cost, topology.origin(h), topology.target(h), square) : never;
    });
  };
  list_edges(blocks, block, candidates.edges);
  candidates.edge_count = candidates.edges.size();
  for (const std::uint32_t h : candidates.edges) {
    const std::uint32_t u = topology.origin(h);
    const std::uint32_t v = topology.target(h);
    if (!is_stale(h, u, v)) continue;
    ranked_in_[h] = static_cast<std::uint8_t>(pass_ - 1);
    if ((tied_[u] | tied_[v]) != 0) {
      cost_[h] = tied_cost(h);
      continue;
    }
    costs.add(h, edge(u, v), terms_[u], terms_[v], normal(HalfEdges::facet(h)),
              normal(HalfEdges::facet(topology.opposite(h))));
    if (costs.is_full()) finish();
  }
  finish();
  std::erase_if(candidates.edges, [&](std::uint32_t h) { return cost_[h] == never; });
  for (const std::uint32_t h : candidates.edges) candidates.costs.add(cost_[h]);
}

/// Edges whose lower end lies in the block; at boundaries, those that begin there.
void CollapsePasses::list_edges(const Blocks& blocks, std::uint32_t block,
                                std::vector<std::uint32_t>& edges) {
  const HalfEdges& topology = mesh_.topology;
  edges.resize(4 * blocks.vertices(block).size() + 2);
  std::size_t count = 0;
  for (const std::uint32_t u : blocks.vertices(block)) {
    std::uint32_t at_seam = 0;
    topology.for_each_outgoing(u, [&](std::uint32_t h) {
      const std::uint32_t v = topology.target(h);
      at_seam |= blocks.holds(block, v) ? 0 : 1;
      // Written anyway, and kept or not: half of all are not, in no order that could be foreseen.
      if (count == edges.size()) edges.resize(2 * count);
      edges[count] = h;
      count += topology.opposite(h) == HalfEdges::none || u < v ? 1 : 0;
    });
    at_seam_[u] = static_cast<std::uint8_t>(at_seam);
  }
  edges.resize(count);
  if (!mesh_.has_twins()) return;
  std::erase_if(edges, [&](std::uint32_t h) {
    return topology.opposite(h) == HalfEdges::none && mesh_.edge(h) != h;
  });
}

std::vector<CollapsePasses::Candidates> CollapsePasses::rank(const Blocks& blocks) {
  std::vector<Candidates> candidates(blocks.count());
  parallel_for(blocks.count(), 1, [&](std::size_t begin, std::size_t end) {
    for (auto block = static_cast<std::uint32_t>(begin); block < end; ++block) {
      rank_block(blocks, block, candidates[block]);
    }
  });
  return candidates;
}

/// Returns how many vertices are gone.
std::uint32_t CollapsePasses::run_pass() {
  const Blocks blocks(mesh_, pass_);
  const std::vector<Candidates> candidates = rank(blocks);
  Histogram costs;
  std::size_t edge_count = 0;
  for (const Candidates& each : candidates) {
    costs.add(each.costs);
    edge_count += each.edge_count;
  }
  const std::uint32_t last_bin = costs.bin_beyond(share_of_pass * static_cast<double>(edge_count));
  limit_ = Histogram::upper_end(last_bin);

  std::vector<std::uint32_t> removed(blocks.count(), 0);
  std::vector<std::uint8_t> bound_was_met(blocks.count(), 0);
  parallel_for(blocks.count(), 1, [&](std::size_t begin, std::size_t end) {
    for (auto block = static_cast<std::uint32_t>(begin); block < end; ++block) {
      Worker worker(*this, blocks, block);
      worker.run(candidates[block].edges, last_bin);
      removed[block] = worker.removed();
      bound_was_met[block] = worker.bound_was_met() ? 1 : 0;
    }
  });
  if (std::find(bound_was_met.begin(), bound_was_met.end(), 1) != bound_was_met.end()) {
    checks_.note_bound_was_met();
  }
  return std::accumulate(removed.begin(), removed.end(), 0U);
}

void CollapsePasses::run() {
  while (pass_ < most_passes) {
    ++pass_;
    const std::uint32_t before = mesh_.live_vertices;
    const std::uint32_t removed = run_pass();
    mesh_.live_vertices -= removed;
    if (removed <= least_share * before) return;
  }
}

}  // namespace

std::vector<std::uint32_t> collapse_in_passes(CollapseMesh& mesh, CollapseChecks& checks,
                                              EdgeSizes& sizes) {
  CollapsePasses passes(mesh, checks, sizes);
  passes.run();
  return std::move(passes).merged_into();
}

}  // namespace scarp

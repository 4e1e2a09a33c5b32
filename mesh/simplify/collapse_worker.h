#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "mesh/simplify/blocks.h"
#include "mesh/simplify/collapse_passes.h"
#include "mesh/simplify/cost_histogram.h"
#include "mesh/simplify/facet_shape.h"
#include "mesh/simplify/tracked_points.h"

// What passes of CollapsePasses do in one block; for collapse_passes.cpp alone.

namespace scarp {

/// Edges that may go in a pass.
struct CollapsePasses::Candidates {
  std::vector<std::uint32_t> edges;
  std::vector<std::uint16_t> bins;  ///< of their costs
};

/// Those of a block.
struct CollapsePasses::Part {
  std::uint32_t block;
  Candidates candidates;
};

/// Those of a range of facets.
struct CollapsePasses::Ranked {
  Candidates candidates;
  std::vector<Part> parts;  ///< after split()
  CostHistogram costs;
  std::size_t edge_count = 0;
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
        bound_(all.floats_.length(all.checks_.bound())) {
    if (mesh_.has_twins()) twin_checks_.emplace(checks_.sharing());
  }

  /// From cheap to dear, up to a bin of costs. share: of the edges, which may be collapsed.
  void run(std::span<const Ranked> ranked, std::uint32_t last_bin, double share) {
    const std::vector<std::uint32_t> edges = in_order(ranked, last_bin);
    most_ = share < 1 ? static_cast<std::uint32_t>(share * static_cast<double>(edges.size()))
                      : static_cast<std::uint32_t>(edges.size());
    for (std::size_t i = 0; i < edges.size() && removed_ < most_; ++i) {
      fetch_ahead(edges, i);
      const std::uint32_t h = edges[i];
      const std::uint32_t u = mesh_.topology.origin(h);
      if (u == HalfEdges::none) continue;
      const std::uint32_t v = mesh_.topology.target(h);
      if (all_.merged_in_[u] == all_.pass_ || all_.merged_in_[v] == all_.pass_) continue;
      if ((all_.tied_[u] | all_.tied_[v]) != 0) {
        try_tied(h);
      } else {
        try_free(h, u, v);
      }
    }
  }

  std::uint32_t removed() const { return removed_; }
  bool bound_was_met() const { return checks_.bound_was_met(); }

 private:
  /// Of the limit of a pass, up to where an edge goes by its second look: the next pass has others
  /// that are as cheap.
  static constexpr float share_of_second_look = 0.85F;
  static constexpr float share_with_points = 0.7F;

  /// How much more shapes weigh in a second look without points: what they are by then is what
  /// later collapses have to live with.
  static constexpr double weight_of_early_shapes = 5.0 / 3;

  /// How much too low costs are as squared distances of points: an estimate that is too low is
  /// corrected, one that is too high comes too late.
  static constexpr double optimism = 0.5;

  std::vector<std::uint32_t> in_order(std::span<const Ranked> ranked,
                                      std::uint32_t last_bin) const {
    std::vector<std::uint32_t> begin(last_bin + 2, 0);
    for_each_part(ranked, [&](const Candidates& candidates) {
      for (const std::uint32_t bin : candidates.bins) ++begin[bin + 1];
    });
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::uint32_t> result(begin.back());
    for_each_part(ranked, [&](const Candidates& candidates) {
      for (std::size_t i = 0; i < candidates.bins.size(); ++i) {
        result[begin[candidates.bins[i]]++] = candidates.edges[i];
      }
    });
    return result;
  }

  template <class Visit>
  void for_each_part(std::span<const Ranked> ranked, const Visit& visit) const {
    for (const Ranked& each : ranked) {
      for (const Part& part : each.parts) {
        if (part.block == block_) visit(part.candidates);
      }
    }
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
    const FloatPlaced placed = place_merged(
        all_.order_.measure, edge, all_.terms_[u], all_.terms_[v], all_.normal(HalfEdges::facet(h)),
        all_.normal(HalfEdges::facet(mesh_.topology.opposite(h))));
    const float square = dot(edge, edge);
    if (is_dear(all_.rank_of(placed.cost, u, v, square))) return;
    if (!star_.gather(mesh_.topology, h)) {
      // The other checks have room for more facets.
      try_tied(h);
      return;
    }
    const Star& star = star_.star();
    // What surrounds it may be changing.
    if (!blocks_.holds(block_, star)) return;
    for (int i = 0; i < star.count; ++i) prefetch(&all_.terms_[star.ring[i]]);
    const Vec3d r = mesh_.rounded(mesh_.r[u] + Vec3d(placed.r) / all_.floats_.scale);
    star_.place_at(all_.floats_, all_.floats_.place(r));
    const double shapes = cost_of_early_shapes();
    // Half of what waits does so for its shapes alone, the quickest to see.
    const auto look_at_shapes = [&] { return look(placed.cost + shapes, square); };
    if (all_.points_ == nullptr && comes_later(h, look_at_shapes)) return;
    if (!keeps_lengths() || !star_.keeps_facets(mesh_)) {
      refuse(h);
    } else if (!comes_later(h, [&] { return second_look(placed.cost, shapes, square, r); })) {
      if (allows(r)) {
        collapse_free(h, r);
      } else {
        refuse(h);
      }
    }
  }

  /// Dearer than it was, after the changes of this pass: perhaps in the next one.
  bool is_dear(float rank) const { return !(rank <= all_.limit_); }

  /// Whether the rank that look() finds is too high for this pass. The edge waits with it.
  template <class Look>
  bool comes_later(std::uint32_t h, const Look& look) {
    if (!all_.order_.looks_twice) return false;
    const float rank = look();
    const float share = all_.points_ == nullptr ? share_of_second_look : share_with_points;
    if (rank <= share * all_.limit_) return false;
    all_.cost_[h] = rank / share;
    all_.ranked_in_[h] = all_.pass_;
    return true;
  }

  /// Of a second look without points, after place_at().
  double cost_of_early_shapes() {
    const double weight = weight_of_early_shapes * all_.order_.shape_weight;
    const bool looks = all_.order_.looks_twice && all_.points_ == nullptr && weight > 0;
    return looks ? all_.cost_of_shapes(weight * star_.shape_growth(all_.floats_)) : 0;
  }

  /// Of an edge between free vertices that goes to r, after place_at(). shapes: what they cost
  /// where there are no points.
  float second_look(float cost, double shapes, float square, Vec3d r) {
    if (all_.points_ == nullptr) {
      const double ends = star_.squared_heights_of_ends(all_.floats_) * all_.squared_unit_;
      return look(std::max(double{cost}, all_.cost_of_points(ends)) + shapes, square);
    }
    const Star& star = star_.star();
    const std::span<const Vec3d> normals = normals_around(r);
    fan_.spread(mesh_, star, r, normals);
    return look(all_.cost_of_points(growth_of_points(star, fan_, r, normals) / optimism), square);
  }

  float look(double cost, float square) const {
    const Star& star = star_.star();
    return all_.rank_of(static_cast<float>(std::max(cost, 0.0)), star.u, star.v, square);
  }

  /// Of an edge that is not free in its places, and its twin edge; after their stars are gathered.
  float second_look_at_tied(std::uint32_t h, std::uint32_t twin, const Placed& placed) {
    const auto squares = [&](CollapseChecks& checks) {
      Fan& fan = checks.fan(mesh_);
      const Star& star = checks.star();
      if (all_.points_ != nullptr) {
        return growth_of_points(star, fan, checks.place(), checks.normals()) / optimism;
      }
      return fan.nearest(mesh_.r[star.u]).squared_distance +
             fan.nearest(mesh_.r[star.v]).squared_distance;
    };
    double sum = squares(checks_);
    // The ends of the twin edge go as far, and more vertices go; its points are others.
    if (twin != HalfEdges::none && all_.points_ != nullptr) sum += squares(*twin_checks_);
    const float cost = static_cast<float>(std::max(all_.cost_of_points(sum), 0.0));
    const float square = all_.squared_length(h);
    const float rank = all_.rank_of(cost, checks_.star().u, checks_.star().v, square);
    return all_.points_ != nullptr ? rank : std::max(rank, all_.rank_of_tied(h, placed));
  }

  std::span<const Vec3d> normals_around(Vec3d r) {
    const Star& star = star_.star();
    Vec3d x = mesh_.r[star.ring[0]] - r;
    for (int i = 0; i < star.count; ++i) {
      const Vec3d y = mesh_.r[star.ring[i + 1]] - r;
      normals_[i] = cross(x, y);
      x = y;
    }
    return {normals_.data(), static_cast<std::size_t>(star.count)};
  }

  /// Of their squared distances, with the shapes.
  double growth_of_points(const Star& star, Fan& fan, Vec3d r,
                          std::span<const Vec3d> normals) const {
    double sum = all_.points_->growth(star, fan);
    const double weight = all_.order_.shape_weight;
    if (weight > 0) {
      sum += weight * all_.points_->per_facet(star) * shape_growth(mesh_, star, r, normals);
    }
    return sum;
  }

  bool allows(Vec3d r) {
    // A second look has seen to it that little exceeds the bound.
    const bool look_first = !all_.has_kept_ && !all_.order_.looks_twice;
    if (look_first && star_.exceeds(all_.floats_, bound_)) {
      checks_.note_bound_was_met();
      return false;
    }
    return star_.makes_no_fold(mesh_, all_.floats_) && mesh_.is_within_sides(r) &&
           checks_.keeps_bound(mesh_, star_.star(), r);
  }

  bool keeps_lengths() {
    const EdgeSizes& sizes = all_.sizes_;
    if (!sizes.limit_new_edges()) return true;
    if (sizes.limit.empty()) return star_.keeps_length(all_.floats_.length(2 * sizes.l_max));
    const Star& star = star_.star();
    std::array<float, PassStar::capacity> limits;
    for (int i = 0; i < star.count; ++i) {
      limits[i] = all_.floats_.length(2 * std::min(sizes.limit_between(star.u, star.ring[i]),
                                                   sizes.limit_between(star.v, star.ring[i])));
    }
    return star_.keeps_lengths(limits);
  }

  void collapse_free(std::uint32_t h, Vec3d r) {
    const Star& star = star_.star();
    checks_.accept(star);
    if (all_.points_ != nullptr) all_.points_->move(star, fan_);
    replace_terms(star, r);
    mesh_.collapse(h, r);
    note_merger(star);
  }

  /// The terms of the merged vertex and its ring: by what the facets around become.
  void replace_terms(const Star& star, Vec3d r) {
    const Measure measure = all_.order_.measure;
    FloatTerms merged;
    FloatTerms first_change;
    FloatTerms change;
    Vec3d x = mesh_.r[star.ring[0]] - r;
    for (int i = 0; i < star.count; ++i) {
      const Vec3d y = mesh_.r[star.ring[i + 1]] - r;
      const std::uint32_t f = star.facet[i];
      const Vec3d n = cross(x, y);
      mesh_.normals[f] = n;
      FloatRecord& record = all_.floats_.normals[f];
      const FloatTerms before = FloatTerms::of(measure, vector_lanes(record));
      record = all_.floats_.normal(n, checks_.error(f));
      const FloatTerms after = FloatTerms::of(measure, vector_lanes(record));
      merged += after;
      // A vertex of the ring has this facet and the one before.
      FloatTerms both = change;
      change = after;
      change -= before;
      both += change;
      if (i == 0) {
        first_change = change;
      } else {
        all_.terms_[star.ring[i]] += both;
      }
      x = y;
    }
    first_change += change;
    all_.terms_[star.ring[0]] += first_change;
    for (const std::uint32_t f : star.dying) {
      const FloatTerms before = FloatTerms::of(measure, vector_lanes(all_.floats_.normals[f]));
      for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h) {
        const std::uint32_t w = mesh_.topology.origin(h);
        if (w != star.u && w != star.v) all_.terms_[w] -= before;
      }
    }
    all_.terms_[star.u] = merged;
  }

  void note_merger(const Star& star) {
    ++removed_;
    all_.floats_.r[star.u] = all_.floats_.place(mesh_.r[star.u]);
    all_.sizes_.merged(star.u, star.v);
    all_.merged_into_[star.v] = star.u;
    if (all_.planes_) all_.planes_->collapsed(mesh_, star.u, star.v);
    all_.merged_in_[star.u] = all_.pass_;
    all_.changed_in_[star.u] = all_.pass_;
    for (int i = 0; i <= star.count; ++i) all_.changed_in_[star.ring[i]] = all_.pass_;
  }

  /// An edge that is not free in its places, and its twin edge if it has one.
  void try_tied(std::uint32_t listed) {
    if (!blocks_.holds_edge(block_, mesh_, listed)) return;
    const std::uint32_t h = mesh_.from_twin(listed);
    const std::uint32_t twin = mesh_.twin_edge(h);
    // Two vertices go; one of them may be too many.
    if (twin != HalfEdges::none && removed_ + 2 > most_) return;
    const Merge rule = merge_rule(mesh_, h);
    if (rule == Merge::forbidden) {
      refuse(listed);
      return;
    }
    const Placed placed = all_.place(h, rule);
    if (is_dear(all_.rank_of_tied(h, placed))) return;
    const bool fits = gather(h, twin, placed.r);
    // What surrounds it may be changing.
    if (fits && !is_mine(twin)) return;
    if (!fits || !keeps_surface(h, twin)) {
      refuse(listed);
    } else if (!comes_later(listed, [&] { return second_look_at_tied(h, twin, placed); })) {
      if (keeps_bound(twin)) {
        collapse_tied(h, twin, placed.r);
      } else {
        refuse(listed);
      }
    }
  }

  bool gather(std::uint32_t h, std::uint32_t twin, Vec3d r) {
    return checks_.gather(mesh_, h, r) &&
           (twin == HalfEdges::none || twin_checks_->gather(mesh_, twin, mesh_.twin_place(h, r)));
  }

  bool is_mine(std::uint32_t twin) const {
    return blocks_.holds(block_, checks_.star()) &&
           (twin == HalfEdges::none || blocks_.holds(block_, twin_checks_->star()));
  }

  bool keeps_surface(std::uint32_t h, std::uint32_t twin) {
    const EdgeSizes& sizes = all_.sizes_;
    if (!checks_.keeps_surface(mesh_, h) || !sizes.allows(mesh_, checks_)) return false;
    return twin == HalfEdges::none ||
           (twin_checks_->keeps_surface(mesh_, twin) && sizes.allows(mesh_, *twin_checks_) &&
            checks_.star().is_apart_from(twin_checks_->star()));
  }

  bool keeps_bound(std::uint32_t twin) {
    if (!checks_.keeps_bound(mesh_)) return false;
    if (twin == HalfEdges::none || twin_checks_->keeps_bound(mesh_)) return true;
    checks_.note_bound_was_met();
    return false;
  }

  void collapse_tied(std::uint32_t h, std::uint32_t twin, Vec3d r) {
    accept(checks_, h);
    if (twin != HalfEdges::none) accept(*twin_checks_, twin);
    mesh_.collapse(h, r);
    note_tied(checks_);
    if (twin != HalfEdges::none) note_tied(*twin_checks_);
  }

  void accept(CollapseChecks& checks, std::uint32_t h) {
    checks.accept(mesh_, h);
    if (all_.points_ != nullptr) all_.points_->move(checks.star(), checks.fan(mesh_));
  }

  void note_tied(const CollapseChecks& checks) {
    const Star& star = checks.star();
    for (int i = 0; i < star.count; ++i) {
      const std::uint32_t f = star.facet[i];
      mesh_.normals[f] = checks.normals()[i];
      all_.floats_.normals[f] = all_.floats_.normal(mesh_.normals[f], checks.error(f));
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
  Fan fan_;
  std::array<Vec3d, PassStar::capacity> normals_;
  float bound_;
  std::uint32_t most_ = 0;
  std::uint32_t removed_ = 0;
};

}  // namespace scarp

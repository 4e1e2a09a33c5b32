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

/// A block that is worked on, with its checks, and what was done there.
struct CollapsePasses::BlockWork {
  BlockWork(CollapsePasses& of_all, const Blocks& blocks_of_pass, std::uint32_t its_number)
      : all(of_all),
        mesh(of_all.mesh_),
        blocks(blocks_of_pass),
        number(its_number),
        checks(of_all.checks_.sharing()) {}

  bool holds(const Star& star) const { return blocks.holds(number, star); }
  bool has_room_for(std::uint32_t count) const { return removed + count <= most; }

  void refuse(std::uint32_t h) { all.cost_[h] = never; }

  /// Dearer than it was, after the changes of this pass: perhaps in the next one.
  bool is_dear(float rank) const { return !(rank <= all.limit_); }

  /// Whether the rank that look() finds is too high for this pass. The edge waits with it.
  template <class Look>
  bool comes_later(std::uint32_t h, const Look& look) {
    if (!all.order_.looks_twice) return false;
    const float rank = look();
    const float share = all.points_ == nullptr ? share_of_second_look : share_with_points;
    if (rank <= share * all.limit_) return false;
    all.cost_[h] = rank / share;
    all.ranked_in_[h] = all.pass_;
    return true;
  }

  /// By how much squared distances of points grow, with the shapes, as a second look has it.
  double growth_of_points(const Star& star, Fan& fan, Vec3d r,
                          std::span<const Vec3d> normals) const {
    double sum = all.points_->growth(star, fan);
    const double weight = all.order_.shape_weight;
    if (weight > 0) {
      sum += weight * all.points_->per_facet(star) * shape_growth(mesh, star, r, normals);
    }
    return sum / optimism;
  }

  void note_merger(const Star& star) {
    ++removed;
    all.floats_.r[star.u] = all.floats_.place(mesh.r[star.u]);
    all.sizes_.merged(star.u, star.v);
    all.merged_into_[star.v] = star.u;
    if (all.planes_) all.planes_->collapsed(mesh, star.u, star.v);
    all.merged_in_[star.u] = all.pass_;
    all.changed_in_[star.u] = all.pass_;
    for (int i = 0; i <= star.count; ++i) all.changed_in_[star.ring[i]] = all.pass_;
  }

  CollapsePasses& all;
  CollapseMesh& mesh;
  const Blocks& blocks;
  std::uint32_t number;
  CollapseChecks checks;
  std::uint32_t most = 0;  ///< vertices that may go
  std::uint32_t removed = 0;

 private:
  /// Of the limit of a pass, up to where an edge goes by its second look: the next pass has others
  /// that are as cheap.
  static constexpr float share_of_second_look = 0.85F;
  static constexpr float share_with_points = 0.7F;

  /// How much too low costs are as squared distances of points: an estimate that is too low is
  /// corrected, one that is too high comes too late.
  static constexpr double optimism = 0.5;
};

/// Edges that are not free in their places, at sides, borders and boundaries, with their twin
/// edges.
class CollapsePasses::TiedEdges {
 public:
  explicit TiedEdges(BlockWork& work) : work_(work), all_(work.all), mesh_(work.mesh) {
    if (mesh_.has_twins()) twin_checks_.emplace(work.checks.sharing());
  }

  /// One of the list, and its twin edge if it has one.
  void try_edge(std::uint32_t listed) {
    if (!work_.blocks.holds_edge(work_.number, mesh_, listed)) return;
    const std::uint32_t h = mesh_.from_twin(listed);
    const std::uint32_t twin = mesh_.twin_edge(h);
    // Two vertices go; one of them may be too many.
    if (twin != HalfEdges::none && !work_.has_room_for(2)) return;
    const Merge rule = merge_rule(mesh_, h);
    if (rule == Merge::forbidden) {
      work_.refuse(listed);
      return;
    }
    const Placed placed = all_.place(h, rule);
    if (work_.is_dear(all_.rank_of_tied(h, placed))) return;
    const bool fits = gather(h, twin, placed.r);
    // What surrounds it may be changing.
    if (fits && !is_mine(twin)) return;
    if (!fits || !keeps_surface(h, twin)) {
      work_.refuse(listed);
    } else if (!work_.comes_later(listed, [&] { return second_look(h, twin, placed); })) {
      if (keeps_bound(twin)) {
        collapse(h, twin, placed.r);
      } else {
        work_.refuse(listed);
      }
    }
  }

 private:
  bool gather(std::uint32_t h, std::uint32_t twin, Vec3d r) {
    return work_.checks.gather(mesh_, h, r) &&
           (twin == HalfEdges::none || twin_checks_->gather(mesh_, twin, mesh_.twin_place(h, r)));
  }

  bool is_mine(std::uint32_t twin) const {
    return work_.holds(work_.checks.star()) &&
           (twin == HalfEdges::none || work_.holds(twin_checks_->star()));
  }

  bool keeps_surface(std::uint32_t h, std::uint32_t twin) {
    const EdgeSizes& sizes = all_.sizes_;
    if (!work_.checks.keeps_surface(mesh_, h) || !sizes.allows(mesh_, work_.checks)) return false;
    return twin == HalfEdges::none ||
           (twin_checks_->keeps_surface(mesh_, twin) && sizes.allows(mesh_, *twin_checks_) &&
            work_.checks.star().is_apart_from(twin_checks_->star()));
  }

  bool keeps_bound(std::uint32_t twin) {
    if (!work_.checks.keeps_bound(mesh_)) return false;
    if (twin == HalfEdges::none || twin_checks_->keeps_bound(mesh_)) return true;
    work_.checks.note_bound_was_met();
    return false;
  }

  void collapse(std::uint32_t h, std::uint32_t twin, Vec3d r) {
    accept(work_.checks, h);
    if (twin != HalfEdges::none) accept(*twin_checks_, twin);
    mesh_.collapse(h, r);
    note(work_.checks);
    if (twin != HalfEdges::none) note(*twin_checks_);
  }

  void accept(CollapseChecks& checks, std::uint32_t h) {
    checks.accept(mesh_, h);
    if (all_.points_ != nullptr) all_.points_->move(checks.star(), checks.fan(mesh_));
  }

  void note(const CollapseChecks& checks) {
    const Star& star = checks.star();
    for (int i = 0; i < star.count; ++i) {
      const std::uint32_t f = star.facet[i];
      mesh_.normals[f] = checks.normals()[i];
      all_.floats_.normals[f] = all_.floats_.normal(mesh_.normals[f], checks.error(f));
    }
    work_.note_merger(star);
    all_.find_terms(star.u);
    for (int i = 0; i <= star.count; ++i) all_.find_terms(star.ring[i]);
    all_.tied_[star.u] = all_.is_tied(star.u) ? 1 : 0;
  }

  /// Of an edge and its twin edge, after their stars are gathered.
  float second_look(std::uint32_t h, std::uint32_t twin, const Placed& placed) {
    const auto squares = [&](CollapseChecks& checks) {
      Fan& fan = checks.fan(mesh_);
      const Star& star = checks.star();
      if (all_.points_ != nullptr) {
        return work_.growth_of_points(star, fan, checks.place(), checks.normals());
      }
      return fan.nearest(mesh_.r[star.u]).squared_distance +
             fan.nearest(mesh_.r[star.v]).squared_distance;
    };
    double sum = squares(work_.checks);
    // The ends of the twin edge go as far, and more vertices go; its points are others.
    if (twin != HalfEdges::none && all_.points_ != nullptr) sum += squares(*twin_checks_);
    const float cost = static_cast<float>(std::max(all_.cost_of_points(sum), 0.0));
    const float square = all_.squared_length(h);
    const float rank = all_.rank_of(cost, work_.checks.star().u, work_.checks.star().v, square);
    return all_.points_ != nullptr ? rank : std::max(rank, all_.rank_of_tied(h, placed));
  }

  BlockWork& work_;
  CollapsePasses& all_;
  CollapseMesh& mesh_;
  std::optional<CollapseChecks> twin_checks_;  ///< only where there are twins
};

/// Edges between vertices that are free to go anywhere.
class CollapsePasses::FreeEdges {
 public:
  explicit FreeEdges(BlockWork& work)
      : work_(work),
        all_(work.all),
        mesh_(work.mesh),
        bound_(work.all.floats_.length(work.checks.bound())) {}

  /// False if the edge has more facets around it than there is room for: it is none of these then.
  bool try_edge(std::uint32_t h, std::uint32_t u, std::uint32_t v) {
    const Vec3f edge = all_.edge(u, v);
    const FloatPlaced placed = place_merged(
        all_.order_.measure, edge, all_.terms_[u], all_.terms_[v], all_.normal(HalfEdges::facet(h)),
        all_.normal(HalfEdges::facet(mesh_.topology.opposite(h))));
    const float square = dot(edge, edge);
    if (work_.is_dear(all_.rank_of(placed.cost, u, v, square))) return true;
    if (!star_.gather(mesh_.topology, h)) return false;
    const Star& star = star_.star();
    // What surrounds it may be changing.
    if (!work_.holds(star)) return true;
    for (int i = 0; i < star.count; ++i) prefetch(&all_.terms_[star.ring[i]]);
    const Vec3d r = mesh_.rounded(mesh_.r[u] + Vec3d(placed.r) / all_.floats_.scale);
    star_.place_at(all_.floats_, all_.floats_.place(r));
    const double shapes = cost_of_early_shapes();
    // Half of what waits does so for its shapes alone, the quickest to see.
    const auto look_at_shapes = [&] { return look(placed.cost + shapes, square); };
    if (all_.points_ == nullptr && work_.comes_later(h, look_at_shapes)) return true;
    if (!keeps_lengths() || !star_.keeps_facets(mesh_)) {
      work_.refuse(h);
    } else if (!work_.comes_later(h, [&] { return second_look(placed.cost, shapes, square, r); })) {
      if (allows(r)) {
        collapse(h, r);
      } else {
        work_.refuse(h);
      }
    }
    return true;
  }

 private:
  /// How much more shapes weigh in a second look without points: what they are by then is what
  /// later collapses have to live with.
  static constexpr double weight_of_early_shapes = 5.0 / 3;

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
    return look(all_.cost_of_points(work_.growth_of_points(star, fan_, r, normals)), square);
  }

  float look(double cost, float square) const {
    const Star& star = star_.star();
    return all_.rank_of(static_cast<float>(std::max(cost, 0.0)), star.u, star.v, square);
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

  bool allows(Vec3d r) {
    // A second look has seen to it that little exceeds the bound.
    const bool look_first = !all_.has_kept_ && !all_.order_.looks_twice;
    if (look_first && star_.exceeds(all_.floats_, bound_)) {
      work_.checks.note_bound_was_met();
      return false;
    }
    return star_.makes_no_fold(mesh_, all_.floats_) && mesh_.is_within_sides(r) &&
           work_.checks.keeps_bound(mesh_, star_.star(), r);
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

  void collapse(std::uint32_t h, Vec3d r) {
    const Star& star = star_.star();
    work_.checks.accept(star);
    if (all_.points_ != nullptr) all_.points_->move(star, fan_);
    replace_terms(star, r);
    mesh_.collapse(h, r);
    work_.note_merger(star);
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
      record = all_.floats_.normal(n, work_.checks.error(f));
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

  BlockWork& work_;
  CollapsePasses& all_;
  CollapseMesh& mesh_;
  PassStar star_;
  Fan fan_;
  std::array<Vec3d, PassStar::capacity> normals_;
  float bound_;
};

/// Collapses edges of a block.
class CollapsePasses::Worker {
 public:
  Worker(CollapsePasses& all, const Blocks& blocks, std::uint32_t block)
      : all_(all), mesh_(all.mesh_), work_(all, blocks, block), tied_(work_), free_(work_) {}

  /// From cheap to dear, up to a bin of costs. share: of the edges, which may be collapsed.
  void run(std::span<const Ranked> ranked, std::uint32_t last_bin, double share) {
    const std::vector<std::uint32_t> edges = in_order(ranked, last_bin);
    work_.most = share < 1 ? static_cast<std::uint32_t>(share * static_cast<double>(edges.size()))
                           : static_cast<std::uint32_t>(edges.size());
    for (std::size_t i = 0; i < edges.size() && work_.has_room_for(1); ++i) {
      fetch_ahead(edges, i);
      const std::uint32_t h = edges[i];
      const std::uint32_t u = mesh_.topology.origin(h);
      if (u == HalfEdges::none) continue;
      const std::uint32_t v = mesh_.topology.target(h);
      if (all_.merged_in_[u] == all_.pass_ || all_.merged_in_[v] == all_.pass_) continue;
      const bool is_tied = (all_.tied_[u] | all_.tied_[v]) != 0;
      // The checks of tied edges have room for more facets.
      if (is_tied || !free_.try_edge(h, u, v)) tied_.try_edge(h);
    }
  }

  std::uint32_t removed() const { return work_.removed; }
  bool bound_was_met() const { return work_.checks.bound_was_met(); }

 private:
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
        if (part.block == work_.number) visit(part.candidates);
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

  CollapsePasses& all_;
  CollapseMesh& mesh_;
  BlockWork work_;
  TiedEdges tied_;
  FreeEdges free_;
};

}  // namespace scarp

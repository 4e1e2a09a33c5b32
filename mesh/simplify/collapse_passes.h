#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "mesh/simplify/collapse.h"
#include "mesh/simplify/edge_cost.h"
#include "mesh/simplify/edge_sizes.h"
#include "mesh/simplify/pass_star.h"
#include "mesh/simplify/placement.h"

namespace scarp {

class Blocks;
class TrackedPoints;

/// What passes collapse first.
struct PassOrder {
  Measure measure = Measure::distance;  ///< of costs and places
  bool by_planes = false;               ///< those of Garland and Heckbert instead, by volume
  bool shortest_first = false;          ///< whatever it costs

  /// Whether an edge is looked at again when its turn comes: how far its two ends will be from the
  /// surface, and the shapes around.
  bool looks_twice = false;
  /// Squared length that a facet of the worst shape (facet_shape.h) weighs for each vertex that
  /// facets here have had on average.
  double shape_weight = 0;
};

/// Collapses edges in passes over all of them: those that change the surface least go early, but
/// only roughly in their order.
///
/// A pass finds what edges cost whose ends have changed (placement.h), takes the cheapest of all,
/// at most a share of them, and goes through them block by block (blocks.h), within a block from
/// cheap to dear. A vertex is merged once in a pass, so the collapses spread over the mesh; an edge
/// that was refused waits until one of its ends has changed.
///
/// Edges between free vertices go through the checks of pass_star.h first. Those at sides, borders
/// and boundaries, also in periodic pairs, go through CollapseChecks alone. Nothing goes that the
/// proven bound does not allow.
///
/// Costs do not know what earlier collapses did. A second look may: after follow(), an edge whose
/// turn it is has to be among the cheapest by how much it adds to the squared distances of all
/// vertices of the input as well. That is dear, and it is enough for the last part of the way.
///
/// A number of vertices is reached by passes that try less the nearer it is; the last ones go
/// through the whole mesh in one block, and stop at the number.
///
/// Cost:   about 2 us of one core per vertex removed; 240 bytes per vertex.
/// Source: the placement and cost are those of Lindstrom and Turk 1998, sec. 4.
class CollapsePasses {
 public:
  /// The mesh, the checks and the sizes have to outlive it; limits of sizes may change between
  /// runs.
  CollapsePasses(CollapseMesh& mesh, CollapseChecks& checks, EdgeSizes& sizes,
                 const PassOrder& order);

  /// How far approach() goes.
  struct Approach {
    double nearest = 0;           ///< to its number, of the vertices that are left
    double least = 0.01;          ///< of what has to go: a pass that removes less is the last one
    double share_of_pass = 0.25;  ///< how much of all edges it tries, the cheapest first
    /// At most so many for each vertex that has still to go: expensive edges must not go in place
    /// of cheap ones that come up later.
    double tries = 1.5;
  };
  /// Until passes do little, or nearly so few vertices are left (0: as few as may be). Returns
  /// whether that is so.
  bool approach(std::uint32_t target, const Approach& until);
  /// Until exactly so many vertices are left, or nothing may be collapsed any more.
  void run_to(std::uint32_t target);

  /// Points of the mesh as it is now, for second looks; kept up from now on.
  void follow(TrackedPoints& points) { points_ = &points; }
  /// Refused edges are tried again: the bound was raised.
  void forget_refusals();

  /// For each vertex the one that it went into last, or itself.
  std::span<const std::uint32_t> merged_into() const { return merged_into_; }

 private:
  /// Before the first pass; 0 is before that.
  static constexpr std::uint16_t first_pass = 1;
  /// Cost of what is refused.
  static constexpr float never = std::numeric_limits<float>::infinity();

  struct Candidates;
  struct Part;
  struct Ranked;
  struct BlockWork;
  class TiedEdges;
  class FreeEdges;
  class Worker;

  void find_terms(std::uint32_t v);
  std::vector<Ranked> rank();
  void rank_edges_of(std::uint32_t begin, std::uint32_t end, Ranked& ranked);
  std::size_t list_edges(std::uint32_t begin, std::uint32_t end,
                         std::span<std::uint32_t> edges) const;
  void split(const Blocks& blocks, std::uint32_t last_bin, Ranked& ranked) const;
  static std::vector<std::size_t> edges_of(std::span<const Ranked> ranked,
                                           std::uint32_t block_count);
  bool is_stale(std::uint32_t h, std::uint32_t u, std::uint32_t v) const;
  float tied_rank(std::uint32_t h) const;
  float rank_of_tied(std::uint32_t h, const Placed& placed) const;
  bool is_wanted(std::uint32_t h, std::uint32_t u, std::uint32_t v) const;
  std::uint32_t run_pass(const Blocks& blocks, std::uint32_t target, double most_share,
                         double most_tries);

  bool is_tied(std::uint32_t v) const {
    return planes_ || mesh_.kind[v] != VertexKind::free || mesh_.sides[v] != 0 ||
           mesh_.topology.on_boundary(v);
  }
  Placed place(std::uint32_t h, Merge rule) const {
    return planes_ ? planes_->place(mesh_, h, rule) : placement_.place(mesh_, h, rule);
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
  // What follows is in the unit of the floats.

  float squared_length(std::uint32_t h) const {
    return static_cast<float>(mesh_.squared_length(h) / squared_unit_);
  }
  /// What decides about the order of edges.
  float rank_of(float cost, std::uint32_t u, std::uint32_t v, float squared_length) const {
    if (order_.shortest_first) return squared_length;
    return cost * static_cast<float>(sizes_.stretch(u, v, squared_length * squared_unit_));
  }
  /// The height of the next surface over a facet falls from h at one corner to 0 at the others; its
  /// mean square is h^2 / 6. The cost has h^2 times twice the area.
  double cost_of_points(double squares) const {
    return 6 * squares / (squared_unit_ * points_per_area_);
  }
  /// weighed_shapes: a squared length times PassStar::shape_growth().
  double cost_of_shapes(double weighed_shapes) const { return 6 * weighed_shapes / squared_unit_; }

  CollapseMesh& mesh_;
  CollapseChecks& checks_;
  EdgeSizes& sizes_;
  PassOrder order_;
  LindstromTurkPlacement placement_;  ///< of tied edges
  std::optional<GarlandHeckbertPlacement> planes_;
  FloatMesh floats_;
  double squared_unit_;         ///< of the floats
  double points_per_area_ = 0;  ///< twice the area, in the unit of the floats
  TrackedPoints* points_ = nullptr;
  LargeVector<FloatTerms> terms_;           ///< per vertex
  LargeVector<float> cost_;                 ///< per half edge; never: refused
  LargeVector<std::uint16_t> ranked_in_;    ///< per half edge: the pass; 0: not yet
  std::vector<std::uint16_t> changed_in_;   ///< per vertex: the pass that changed its facets
  std::vector<std::uint16_t> merged_in_;    ///< per vertex: the pass that merged it
  std::vector<std::uint8_t> tied_;          ///< per vertex: whether not free to go anywhere
  std::vector<std::uint32_t> merged_into_;  ///< per vertex
  bool has_kept_ = false;                   ///< facets
  float limit_ = 0;                         ///< on the costs of the last pass
  std::uint16_t pass_ = first_pass;
};

}  // namespace scarp

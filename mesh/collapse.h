#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "mesh/collapse_mesh.h"
#include "mesh/error_bound.h"
#include "mesh/star.h"

namespace scarp {

/// What a collapse may not do to the facets around it, whatever the method.
class CollapseChecks {
 public:
  /// max_error bounds the distance to the input; border_error how far a border between materials
  /// may be cut short.
  CollapseChecks(const CollapseMesh& mesh, std::optional<double> max_error, double border_error);

  /// Whether h may be collapsed to r: no facet flips or loses its area, borders stay, and the
  /// bound holds. The star of h is gathered on the way.
  bool allow(const CollapseMesh& mesh, std::uint32_t h, Vec3d r) {
    return keeps_surface(mesh, h, r) && keeps_bound(mesh);
  }

  /// The cheap part of allow(), and the dear one, to be asked after it.
  bool keeps_surface(const CollapseMesh& mesh, std::uint32_t h, Vec3d r);
  bool keeps_bound(const CollapseMesh& mesh);

  /// To be called right before the collapse that was allowed last.
  void accept(const CollapseMesh& mesh, std::uint32_t h);

  /// Makes the star that of a vertex; then whether the vertex may move to r without turning a facet
  /// much against a reference (per facet of the mesh), to be followed by keeps_bound() and
  /// accept_move(). Not for vertices of borders between materials.
  bool gather_vertex(const CollapseMesh& mesh, std::uint32_t v) {
    return star_.gather_vertex(mesh.topology, v);
  }
  bool may_move(const CollapseMesh& mesh, Vec3d r, std::span<const Vec3d> reference) {
    return keeps_facets(mesh, r) && turns_little(reference) && makes_no_fold(mesh);
  }
  void accept_move() {
    if (bound_) bound_->accept(star_);
  }

  // Of the change that was asked for last: the facets around, where their centre goes, and twice
  // their area vectors then.
  const Star& star() const { return star_; }
  Vec3d place() const { return place_; }
  std::span<const Vec3d> normals() const { return normals_; }
  /// Whether the bound has refused anything so far.
  bool bound_was_met() const { return bound_was_met_; }
  double proven_error(const HalfEdges& topology) const;

 private:
  bool keeps_facets(const CollapseMesh& mesh, Vec3d r);
  bool turns_little(std::span<const Vec3d> reference) const;
  bool makes_no_fold(const CollapseMesh& mesh) const;
  bool keeps_border(const CollapseMesh& mesh, std::uint32_t h, Vec3d r);

  Star star_;
  Vec3d place_;
  std::array<Vec3d, Star::capacity> normals_;
  std::optional<ErrorBound> bound_;
  std::vector<double> border_shift_;  ///< per vertex, only where there are materials
  double border_error_;
  double new_border_shift_ = 0;
  bool bound_was_met_ = false;
};

/// Collapses edges, the lowest key first.
///
/// A Placement (placement.h) says where the merged vertex goes. An Order says the rest:
///   wanted(mesh, h, squared_length): whether the edge may be collapsed now;
///   key(mesh, h, cost, squared_length): what goes first; by_cost: whether it depends on the cost;
///   merged(u, v): v went into u;
///   allows(mesh, checks), exact_key(mesh, checks) and accept(mesh, checks), if it has them:
///   whether the collapse that the checks were asked for last may be; its key, where key() is only
///   an estimate; it comes next.
///
/// Keys are cached with a count of the changes around the edge. Edges at the merged vertex get a
/// new key at once, those of its neighbours when their turn comes. What the checks refused is asked
/// again only after a change.
template <class Placement>
class CollapseEngine {
 public:
  CollapseEngine(CollapseMesh& mesh, CollapseChecks& checks, Placement placement)
      : mesh_(mesh),
        checks_(checks),
        placement_(std::move(placement)),
        changes_(mesh.r.size(), 0),
        refused_(mesh.topology.half_edge_count(), unqueued) {}

  /// Collapses until no wanted edge can be, or target vertices are left. Returns the number of
  /// collapses.
  template <class Order>
  std::uint32_t run(Order& order, std::uint32_t target) {
    const std::uint32_t before = mesh_.live_vertices;
    fill_queue(order);
    while (!queue_.empty() && mesh_.live_vertices > target) {
      const Entry entry = pop();
      if (entry.stamp != stamp_[entry.h]) continue;
      if (Order::by_cost && changes_around(entry.h) != entry.stamp) {
        push(order, entry.h);
        continue;
      }
      stamp_[entry.h] = unqueued;
      const Merge rule = merge_rule(mesh_, entry.h);
      const Vec3d r = placement_.place(mesh_, entry.h, rule).r;
      if (!checks_.keeps_surface(mesh_, entry.h, r) || !is_allowed(order)) {
        refused_[entry.h] = entry.stamp;
      } else if (!comes_later(order, entry)) {
        if (checks_.keeps_bound(mesh_)) {
          collapse(order, entry.h, r);
        } else {
          refused_[entry.h] = entry.stamp;
        }
      }
    }
    queue_.clear();
    return before - mesh_.live_vertices;
  }

 private:
  static constexpr std::uint32_t unqueued = HalfEdges::none;

  struct Entry {
    float key;
    std::uint32_t h;
    std::uint32_t stamp;
    bool is_exact = false;

    /// For the heap of the standard library, which has the greatest first.
    bool operator<(const Entry& other) const {
      return key != other.key ? key > other.key : h > other.h;
    }
  };

  /// Grows whenever one of the two ends changes, also over a merger of vertices.
  std::uint32_t changes_around(std::uint32_t h) const {
    return changes_[mesh_.topology.origin(h)] + changes_[mesh_.topology.target(h)];
  }

  template <class Order>
  std::optional<Entry> entry_of(const Order& order, std::uint32_t h) const {
    const std::uint32_t stamp = changes_around(h);
    if (refused_[h] == stamp) return std::nullopt;
    const double squared_length = mesh_.squared_length(h);
    if (!order.wanted(mesh_, h, squared_length)) return std::nullopt;
    const Merge rule = merge_rule(mesh_, h);
    if (rule == Merge::forbidden) return std::nullopt;
    const double cost = Order::by_cost ? placement_.place(mesh_, h, rule).cost : 0;
    return Entry{static_cast<float>(order.key(mesh_, h, cost, squared_length)), h, stamp};
  }

  template <class Order>
  bool is_allowed(const Order& order) const {
    if constexpr (requires { order.allows(mesh_, checks_); }) return order.allows(mesh_, checks_);
    return true;
  }

  /// Puts an estimated entry back if its exact key is not the lowest any more.
  template <class Order>
  bool comes_later(const Order& order, const Entry& entry) {
    if constexpr (requires { order.exact_key(mesh_, checks_); }) {
      if (entry.is_exact || queue_.empty()) return false;
      const auto key = static_cast<float>(order.exact_key(mesh_, checks_));
      if (key <= queue_.front().key) return false;
      stamp_[entry.h] = entry.stamp;
      queue_.push_back({key, entry.h, entry.stamp, true});
      std::push_heap(queue_.begin(), queue_.end());
      return true;
    } else {
      return false;
    }
  }

  template <class Order>
  void push(const Order& order, std::uint32_t h) {
    const std::optional<Entry> entry = entry_of(order, h);
    stamp_[h] = entry ? entry->stamp : unqueued;
    if (!entry) return;
    queue_.push_back(*entry);
    std::push_heap(queue_.begin(), queue_.end());
  }

  Entry pop() {
    std::pop_heap(queue_.begin(), queue_.end());
    const Entry entry = queue_.back();
    queue_.pop_back();
    return entry;
  }

  template <class Order>
  void fill_queue(const Order& order) {
    stamp_.assign(mesh_.topology.half_edge_count(), unqueued);
    queue_.clear();
    for (std::uint32_t h = 0; h < mesh_.topology.half_edge_count(); ++h) {
      if (!mesh_.topology.alive(HalfEdges::facet(h)) || !mesh_.topology.is_edge(h)) continue;
      const std::optional<Entry> entry = entry_of(order, h);
      if (!entry) continue;
      stamp_[h] = entry->stamp;
      queue_.push_back(*entry);
    }
    std::make_heap(queue_.begin(), queue_.end());
  }

  template <class Order>
  void collapse(Order& order, std::uint32_t h, Vec3d r) {
    const Star& star = checks_.star();
    const std::uint32_t u = star.u;
    const std::uint32_t v = star.v;
    checks_.accept(mesh_, h);
    if constexpr (requires { order.accept(mesh_, checks_); }) order.accept(mesh_, checks_);
    for (const std::uint32_t f : star.dying) {
      if (f == HalfEdges::none) continue;
      for (std::uint32_t side = 3 * f; side < 3 * f + 3; ++side) stamp_[side] = unqueued;
    }
    mesh_.topology.collapse(h);
    --mesh_.live_vertices;
    mesh_.r[u] = r;
    mesh_.sides[u] |= mesh_.sides[v];
    mesh_.kind[u] = std::max(mesh_.kind[u], mesh_.kind[v]);
    for (int i = 0; i < star.count; ++i) mesh_.normals[star.facet[i]] = checks_.normals()[i];
    placement_.collapsed(mesh_, u, v);
    order.merged(u, v);

    changes_[u] = std::max(changes_[u], changes_[v]) + 1;
    if (Order::by_cost) {
      mesh_.topology.for_each_neighbour(u, [&](std::uint32_t w) { ++changes_[w]; });
    }
    mesh_.topology.for_each_outgoing(u, [&](std::uint32_t g) {
      push_one_of_two(order, g);
      const std::uint32_t last = HalfEdges::previous(g);
      if (mesh_.topology.opposite(last) == HalfEdges::none) push_one_of_two(order, last);
    });
  }

  /// Whichever half edge stood for the edge before, from now on it is the lower one.
  template <class Order>
  void push_one_of_two(const Order& order, std::uint32_t g) {
    const std::uint32_t o = mesh_.topology.opposite(g);
    if (o != HalfEdges::none) stamp_[std::max(g, o)] = unqueued;
    push(order, mesh_.topology.edge(g));
  }

  CollapseMesh& mesh_;
  CollapseChecks& checks_;
  Placement placement_;
  std::vector<std::uint32_t> changes_;  ///< per vertex: how often its facets changed
  std::vector<std::uint32_t> stamp_;    ///< per half edge: stamp of its latest entry
  std::vector<std::uint32_t> refused_;  ///< per half edge: stamp when the checks last said no
  std::vector<Entry> queue_;
};

}  // namespace scarp

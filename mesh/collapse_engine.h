#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "mesh/blocks.h"
#include "mesh/collapse.h"

namespace scarp {

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
/// While there is much to do, the cheaper half of it is done block by block (blocks.h), each with
/// its own queue, and again with other cuts; the rest goes through one queue. An order may keep
/// numbers per vertex and per facet: a block touches only its own.
///
/// Costs are cached with a count of the changes around the edge. Edges at the merged vertex get a
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
        stamp_(mesh.topology.half_edge_count(), unknown),
        refused_(mesh.topology.half_edge_count(), unknown),
        cost_(mesh.topology.half_edge_count(), 0),
        cost_stamp_(mesh.topology.half_edge_count(), unknown),
        key_(mesh.topology.half_edge_count(), never) {}

  /// Collapses until no wanted edge can be, or target vertices are left. Returns the number of
  /// collapses.
  template <class Order>
  std::uint32_t run(Order& order, std::uint32_t target) {
    const std::uint32_t before = mesh_.live_vertices;
    if (has_exact_key<Order>) {
      exact_.assign(key_.size(), 0);
      exact_stamp_.assign(key_.size(), unknown);
    }
    while (mesh_.live_vertices > target) {
      fill_keys(order);
      const float limit = limit_of_pass(target);
      if (limit == never || !run_blocks(order, target, limit)) break;
    }
    if (mesh_.live_vertices > target) {
      fill_keys(order);
      Worker<Order> worker(*this, order, checks_);
      worker.run(never, mesh_.live_vertices - target);
      mesh_.live_vertices -= worker.removed();
    }
    return before - mesh_.live_vertices;
  }

 private:
  static constexpr std::uint32_t unknown = HalfEdges::none;
  static constexpr float never = std::numeric_limits<float>::infinity();

  // Below so many edges, or collapses to be made, one queue is as fast.
  static constexpr std::size_t few = 10000;
  /// How many of the cheapest edges a pass looks at, in collapses to be made. There are three edges
  /// to a vertex, and a pass must not reach the dear ones.
  static constexpr double share_of_pass = 1.5;

  template <class Order>
  static constexpr bool has_exact_key = requires(Order order, CollapseMesh& mesh,
                                                 CollapseChecks& checks) {
    order.exact_key(mesh, checks);
  };

  struct Entry {
    float key;
    std::uint32_t h;
    std::uint32_t stamp;

    /// For the heap of the standard library, which has the greatest first.
    bool operator<(const Entry& other) const {
      return key != other.key ? key > other.key : h > other.h;
    }
  };

  /// Grows whenever one of the two ends changes, also over a merger of vertices.
  std::uint32_t changes_around(std::uint32_t h) const {
    return changes_[mesh_.topology.origin(h)] + changes_[mesh_.topology.target(h)];
  }

  /// Whether the exact key of an edge is known.
  template <class Order>
  bool is_exact(std::uint32_t h, std::uint32_t stamp) const {
    if constexpr (has_exact_key<Order>) return exact_stamp_[h] == stamp;
    return false;
  }

  /// The key of an edge as it is now; never if it may not be collapsed.
  template <class Order>
  float key_of(const Order& order, std::uint32_t h) {
    const std::uint32_t stamp = changes_around(h);
    if (refused_[h] == stamp) return never;
    const double squared_length = mesh_.squared_length(h);
    if (!order.wanted(mesh_, h, squared_length)) return never;
    if (is_exact<Order>(h, stamp)) return exact_[h];
    const Merge rule = merge_rule(mesh_, h);
    if (rule == Merge::forbidden) return never;
    if (Order::by_cost && cost_stamp_[h] != stamp) {
      cost_[h] = static_cast<float>(placement_.place(mesh_, h, rule).cost);
      cost_stamp_[h] = stamp;
    }
    return static_cast<float>(order.key(mesh_, h, double{cost_[h]}, squared_length));
  }

  template <class Order>
  void fill_keys(const Order& order) {
    constexpr std::size_t grain = 4096;
    parallel_for(key_.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (auto h = static_cast<std::uint32_t>(begin); h < end; ++h) {
        const bool is_edge = mesh_.topology.alive(HalfEdges::facet(h)) && mesh_.topology.is_edge(h);
        key_[h] = is_edge ? key_of(order, h) : never;
        stamp_[h] = unknown;
      }
    });
  }

  /// The key up to which blocks work next; never if there is too little to do.
  float limit_of_pass(std::uint32_t target) const {
    std::vector<float> keys;
    keys.reserve(key_.size() / 2);
    for (const float key : key_) {
      if (key != never) keys.push_back(key);
    }
    const std::size_t wanted = mesh_.live_vertices - target;
    if (keys.size() < few || wanted < few / 4) return never;
    const std::size_t place =
        std::min(keys.size() - 1, static_cast<std::size_t>(share_of_pass * wanted));
    std::nth_element(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(place), keys.end());
    return keys[place];
  }

  /// One pass over all blocks. False if it did little.
  template <class Order>
  bool run_blocks(Order& order, std::uint32_t target, float limit) {
    const Blocks blocks(mesh_, pass_++);
    const double share = static_cast<double>(mesh_.live_vertices - target) / mesh_.live_vertices;
    std::vector<std::uint32_t> removed(blocks.count(), 0);
    std::vector<std::uint8_t> bound_was_met(blocks.count(), 0);
    parallel_for(blocks.count(), 1, [&](std::size_t begin, std::size_t end) {
      for (auto block = static_cast<std::uint32_t>(begin); block < end; ++block) {
        CollapseChecks checks = checks_.sharing();
        Worker<Order> worker(*this, order, checks, blocks, block);
        // Together no more than are to be removed.
        const auto most =
            static_cast<std::uint32_t>(share * static_cast<double>(blocks.vertices(block).size()));
        worker.run(limit, most);
        removed[block] = worker.removed();
        bound_was_met[block] = checks.bound_was_met() ? 1 : 0;
      }
    });
    std::uint32_t sum = 0;
    for (const std::uint32_t count : removed) sum += count;
    mesh_.live_vertices -= sum;
    for (const std::uint8_t met : bound_was_met) {
      if (met != 0) checks_.note_bound_was_met();
    }
    return sum > few / 10;
  }

  /// Works through one queue: of a block, or of the whole mesh.
  template <class Order>
  class Worker {
   public:
    Worker(CollapseEngine& engine, Order& order, CollapseChecks& checks)
        : engine_(engine), mesh_(engine.mesh_), order_(order), checks_(checks) {}
    Worker(CollapseEngine& engine, Order& order, CollapseChecks& checks, const Blocks& blocks,
           std::uint32_t block)
        : engine_(engine),
          mesh_(engine.mesh_),
          order_(order),
          checks_(checks),
          blocks_(&blocks),
          block_(block) {}

    /// Collapses up to `most` edges with keys up to the limit.
    void run(float limit, std::uint32_t most) {
      limit_ = limit;
      fill_queue();
      while (!queue_.empty() && removed_ < most) {
        const Entry entry = pop();
        if (entry.stamp != engine_.stamp_[entry.h]) continue;
        if (Order::by_cost && engine_.changes_around(entry.h) != entry.stamp) {
          push(entry.h);
          continue;
        }
        engine_.stamp_[entry.h] = unknown;
        try_to_collapse(entry);
      }
    }

    std::uint32_t removed() const { return removed_; }

   private:
    void fill_queue() {
      if (blocks_ == nullptr) {
        for (std::uint32_t h = 0; h < engine_.key_.size(); ++h) enqueue(h, engine_.key_[h]);
      } else {
        for (const std::uint32_t v : blocks_->vertices(block_)) {
          mesh_.topology.for_each_outgoing(v, [&](std::uint32_t h) {
            if (blocks_->holds(block_, mesh_.topology.target(h))) enqueue(h, engine_.key_[h]);
          });
        }
      }
      std::make_heap(queue_.begin(), queue_.end());
    }

    /// At the end of the queue, whatever its place.
    bool enqueue(std::uint32_t h, float key) {
      if (key == never || key > limit_) {
        engine_.stamp_[h] = unknown;
        return false;
      }
      engine_.stamp_[h] = engine_.changes_around(h);
      queue_.push_back({key, h, engine_.stamp_[h]});
      return true;
    }

    void push(std::uint32_t h, float key) {
      if (enqueue(h, key)) std::push_heap(queue_.begin(), queue_.end());
    }
    void push(std::uint32_t h) { push(h, engine_.key_of(order_, h)); }

    Entry pop() {
      std::pop_heap(queue_.begin(), queue_.end());
      const Entry entry = queue_.back();
      queue_.pop_back();
      return entry;
    }

    bool is_mine(const Star& star) const {
      return blocks_ == nullptr || blocks_->holds(block_, star);
    }

    bool is_allowed() const {
      if constexpr (requires { order_.allows(mesh_, checks_); }) {
        return order_.allows(mesh_, checks_);
      }
      return true;
    }

    void try_to_collapse(const Entry& entry) {
      const Merge rule = merge_rule(mesh_, entry.h);
      const Vec3d r = engine_.placement_.place(mesh_, entry.h, rule).r;
      const bool keeps_surface = checks_.keeps_surface(mesh_, entry.h, r);
      if (keeps_surface && !is_mine(checks_.star())) return;
      if (!keeps_surface || !is_allowed()) {
        engine_.refused_[entry.h] = entry.stamp;
      } else if (!comes_later(entry)) {
        if (checks_.keeps_bound(mesh_)) {
          collapse(entry.h, r);
        } else {
          engine_.refused_[entry.h] = entry.stamp;
        }
      }
    }

    /// Puts an estimated entry back if its exact key is not the lowest any more.
    bool comes_later(const Entry& entry) {
      if constexpr (has_exact_key<Order>) {
        if (engine_.template is_exact<Order>(entry.h, entry.stamp)) return false;
        const auto key = static_cast<float>(order_.exact_key(mesh_, checks_));
        const float next = queue_.empty() ? limit_ : std::min(limit_, queue_.front().key);
        if (key <= next) return false;
        engine_.exact_[entry.h] = key;
        engine_.exact_stamp_[entry.h] = entry.stamp;
        push(entry.h, key);
        return true;
      } else {
        return false;
      }
    }

    void collapse(std::uint32_t h, Vec3d r) {
      const Star& star = checks_.star();
      const std::uint32_t u = star.u;
      const std::uint32_t v = star.v;
      checks_.accept(mesh_, h);
      if constexpr (requires { order_.accept(mesh_, checks_); }) order_.accept(mesh_, checks_);
      for (const std::uint32_t f : star.dying) {
        if (f == HalfEdges::none) continue;
        for (std::uint32_t side = 3 * f; side < 3 * f + 3; ++side) engine_.stamp_[side] = unknown;
      }
      mesh_.topology.collapse(h);
      ++removed_;
      mesh_.r[u] = r;
      mesh_.sides[u] |= mesh_.sides[v];
      mesh_.kind[u] = std::max(mesh_.kind[u], mesh_.kind[v]);
      for (int i = 0; i < star.count; ++i) mesh_.normals[star.facet[i]] = checks_.normals()[i];
      engine_.placement_.collapsed(mesh_, u, v);
      order_.merged(u, v);

      std::vector<std::uint32_t>& changes = engine_.changes_;
      changes[u] = std::max(changes[u], changes[v]) + 1;
      if (Order::by_cost) {
        mesh_.topology.for_each_neighbour(u, [&](std::uint32_t w) { ++changes[w]; });
      }
      mesh_.topology.for_each_outgoing(u, [&](std::uint32_t g) {
        push_one_of_two(g);
        const std::uint32_t last = HalfEdges::previous(g);
        if (mesh_.topology.opposite(last) == HalfEdges::none) push_one_of_two(last);
      });
    }

    /// Whichever half edge stood for the edge before, from now on it is the lower one.
    void push_one_of_two(std::uint32_t g) {
      const std::uint32_t o = mesh_.topology.opposite(g);
      if (o != HalfEdges::none) engine_.stamp_[std::max(g, o)] = unknown;
      push(mesh_.topology.edge(g));
    }

    CollapseEngine& engine_;
    CollapseMesh& mesh_;
    Order& order_;
    CollapseChecks& checks_;
    const Blocks* blocks_ = nullptr;
    std::uint32_t block_ = 0;
    float limit_ = never;
    std::uint32_t removed_ = 0;
    std::vector<Entry> queue_;
  };

  CollapseMesh& mesh_;
  CollapseChecks& checks_;
  Placement placement_;
  std::vector<std::uint32_t> changes_;      ///< per vertex: how often its facets changed
  std::vector<std::uint32_t> stamp_;        ///< per half edge: stamp of its latest entry
  std::vector<std::uint32_t> refused_;      ///< per half edge: stamp when the checks last said no
  std::vector<float> cost_;                 ///< per half edge: of the placement
  std::vector<std::uint32_t> cost_stamp_;   ///< per half edge: stamp when that was found
  std::vector<float> exact_;                ///< per half edge, if the order has exact keys
  std::vector<std::uint32_t> exact_stamp_;  ///< per half edge: stamp when that was found
  std::vector<float> key_;                  ///< per half edge: when the queues were filled last
  int pass_ = 0;
};

}  // namespace scarp

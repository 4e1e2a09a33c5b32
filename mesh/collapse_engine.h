#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/huge_pages.h"
#include "core/parallel.h"
#include "mesh/blocks.h"
#include "mesh/collapse.h"
#include "mesh/placement.h"

namespace scarp {

/// Collapses edges, the lowest key first.
///
/// A Placement (placement.h) says where the merged vertex goes. An Order says the rest:
///   wanted(mesh, h, squared_length): whether the edge may be collapsed now;
///   key(mesh, h, placed, squared_length): what goes first; by_cost: whether it depends on where
///   the vertex is placed, and what that costs; merged(u, v): v went into u; allows(mesh, checks),
///   exact_key(mesh, checks) and accept(mesh, checks), if it has them: whether the collapse that
///   the checks were asked for last may be; its key, where key() is only an estimate; it comes
///   next.
///
/// While there is much to do, the cheaper half of it is done block by block (blocks.h), each with
/// its own queue, and again with other cuts; the rest goes through one queue. An order may keep
/// numbers per vertex and per facet: a block touches only its own.
///
/// An edge of a periodic side and its twin edge (collapse_mesh.h) are one: the lower half edge
/// stands for both, they are checked, ranked and collapsed together.
///
/// Keys are kept with a count of the changes around the edge. After a change an edge gets a new key
/// when its turn comes by the old one. Those at the merged vertex get it at once, unless keys are
/// estimates: then only what had none, or was refused, does.
template <class Placement>
class CollapseEngine {
 public:
  CollapseEngine(CollapseMesh& mesh, CollapseChecks& checks, Placement placement)
      : mesh_(mesh),
        checks_(checks),
        placement_(std::move(placement)),
        changes_(mesh.r.size(), 0),
        keys_(mesh.topology.half_edge_count()) {}

  /// Collapses until no wanted edge can be, or target vertices are left. Returns the number of
  /// collapses.
  template <class Order>
  std::uint32_t run(Order& order, std::uint32_t target) {
    const std::uint32_t before = mesh_.live_vertices;
    while (mesh_.live_vertices > target) {
      const std::size_t wanted = mesh_.live_vertices - target;
      KeySample sample = sample_keys(order);
      if (sample.count() < few || wanted < few / 4) break;
      if (!run_blocks(order, target, sample.limit(share_of_pass() * static_cast<double>(wanted)))) {
        break;
      }
    }
    finish(order, target);
    return before - mesh_.live_vertices;
  }

 private:
  static constexpr std::uint32_t unknown = HalfEdges::none;
  static constexpr float never = std::numeric_limits<float>::infinity();

  // Below so many edges, or collapses to be made, one queue is as fast.
  static constexpr std::size_t few = 2000;
  /// How many of the cheapest edges a pass looks at, in collapses to be made. There are three edges
  /// to a vertex, and a pass must not reach the dear ones; once most is done, too few of those that
  /// it looks at are left.
  double share_of_pass() const { return pass_ < 3 ? 1 : 2; }
  /// The same for the last queue, which goes on with all edges where that is not enough.
  static constexpr double share_of_last = 8;
  /// Half edges whose keys stand for all.
  static constexpr std::size_t sample_size = 1 << 14;

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

  /// The key of an edge as it was found last; `never` if it may not be collapsed.
  struct Key {
    static constexpr std::uint32_t exact = 0x80000000U;

    float value = never;
    std::uint32_t stamp = unknown;  ///< changes around the edge then; with the bit if it is exact

    bool is_of(std::uint32_t changes) const { return (stamp & ~exact) == changes; }
    bool is_exact() const { return stamp != unknown && (stamp & exact) != 0; }
  };

  /// Keys of a part of the edges, for how they are spread.
  struct KeySample {
    std::size_t stride = 1;
    std::vector<float> keys;

    std::size_t count() const { return keys.size() * stride; }
    /// The key that so many edges lie below.
    float limit(double edges) {
      const auto place = static_cast<std::size_t>(edges / static_cast<double>(stride));
      if (place >= keys.size()) return std::numeric_limits<float>::max();
      std::nth_element(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(place), keys.end());
      return keys[place];
    }
  };

  /// Grows whenever one of the two ends changes, also over a merger of vertices; but not where the
  /// edge loses its twin edge, whose changes counted too.
  std::uint32_t changes_around(std::uint32_t h) const {
    const auto ends = [this](std::uint32_t g) {
      return changes_[mesh_.topology.origin(g)] + changes_[mesh_.topology.target(g)];
    };
    const std::uint32_t t = mesh_.twin_edge(h);
    return t == HalfEdges::none ? ends(h) : ends(h) + ends(t);
  }

  /// The key of an edge as it is now.
  template <class Order>
  Key key_of(const Order& order, std::uint32_t h) {
    const double squared_length = mesh_.squared_length(h);
    if (!order.wanted(mesh_, h, squared_length)) return {};
    const std::uint32_t t = mesh_.twin_edge(h);
    if (t != HalfEdges::none && !order.wanted(mesh_, t, squared_length)) return {};
    const std::uint32_t changes = changes_around(h);
    Key& key = keys_[h];
    if (!key.is_of(changes)) key = {new_key(order, h, squared_length), changes};
    return key;
  }

  template <class Order>
  float new_key(const Order& order, std::uint32_t h, double squared_length) const {
    const Merge rule = merge_rule(mesh_, h);
    if (rule == Merge::forbidden) return never;
    const Placed placed = Order::by_cost ? placement_.place(mesh_, h, rule) : Placed{};
    return static_cast<float>(order.key(mesh_, h, placed, squared_length));
  }

  template <class Order>
  KeySample sample_keys(const Order& order) {
    KeySample sample;
    // Prime to 6, so that no corner of the facets is preferred.
    sample.stride = std::max<std::size_t>(keys_.size() / sample_size, 1) | 1;
    if (sample.stride % 3 == 0) sample.stride += 2;
    sample.keys.assign((keys_.size() + sample.stride - 1) / sample.stride, never);
    constexpr std::size_t grain = 2048;
    parallel_for(sample.keys.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto h = static_cast<std::uint32_t>(i * sample.stride);
        const bool is_edge = mesh_.topology.alive(HalfEdges::facet(h)) && mesh_.edge(h) == h;
        if (is_edge) sample.keys[i] = key_of(order, h).value;
      }
    });
    std::erase(sample.keys, never);
    return sample;
  }

  /// What the blocks have left, through one queue: first what is likely to be all of it.
  template <class Order>
  void finish(Order& order, std::uint32_t target) {
    if (mesh_.live_vertices <= target) return;
    const double wanted = mesh_.live_vertices - target;
    for (const float limit :
         {sample_keys(order).limit(share_of_last * wanted), std::numeric_limits<float>::max()}) {
      Worker<Order> worker(*this, order, checks_);
      worker.run(limit, mesh_.live_vertices - target);
      mesh_.live_vertices -= worker.removed();
      if (mesh_.live_vertices == target) return;
    }
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
        : engine_(engine), mesh_(engine.mesh_), order_(order), checks_(checks) {
      if (mesh_.has_twins()) twin_checks_.emplace(checks_.sharing());
    }
    Worker(CollapseEngine& engine, Order& order, CollapseChecks& checks, const Blocks& blocks,
           std::uint32_t block)
        : Worker(engine, order, checks) {
      blocks_ = &blocks;
      block_ = block;
    }

    /// Collapses up to `most` edges with keys up to the limit.
    void run(float limit, std::uint32_t most) {
      limit_ = limit;
      most_ = most;
      fill_queue();
      while (!queue_.empty() && removed_ < most_) {
        const Entry entry = pop();
        const Key key = engine_.keys_[entry.h];
        if (key.stamp != entry.stamp || key.value != entry.key) continue;
        if (key.is_of(engine_.changes_around(entry.h))) {
          try_to_collapse(entry);
        } else {
          push(entry.h);
        }
      }
    }

    std::uint32_t removed() const { return removed_; }

   private:
    void fill_queue() {
      const HalfEdges& topology = mesh_.topology;
      if (blocks_ == nullptr) {
        for (std::uint32_t h = 0; h < topology.half_edge_count(); ++h) {
          if (topology.alive(HalfEdges::facet(h)) && mesh_.edge(h) == h) enqueue_known(h);
        }
      } else {
        for (const std::uint32_t v : blocks_->vertices(block_)) {
          topology.for_each_outgoing(v, [&](std::uint32_t h) {
            if (blocks_->holds_edge(block_, mesh_, h) && mesh_.edge(h) == h) enqueue_known(h);
          });
        }
      }
      std::make_heap(queue_.begin(), queue_.end());
    }

    /// By the key that was found last, if there is one; what has changed since is looked at when
    /// its turn comes.
    void enqueue_known(std::uint32_t h) {
      enqueue(h, is_known(h) ? engine_.keys_[h] : engine_.key_of(order_, h));
    }

    /// Whether there is a key, of whatever time, by which the edge waits for its turn.
    bool is_known(std::uint32_t h) const {
      const Key& key = engine_.keys_[h];
      return key.stamp != unknown && key.value != never;
    }

    /// At the end of the queue, whatever its place.
    bool enqueue(std::uint32_t h, const Key& key) {
      if (!(key.value <= limit_)) return false;
      queue_.push_back({key.value, h, key.stamp});
      return true;
    }

    void push(std::uint32_t h, const Key& key) {
      if (enqueue(h, key)) std::push_heap(queue_.begin(), queue_.end());
    }
    void push(std::uint32_t h) { push(h, engine_.key_of(order_, h)); }

    Entry pop() {
      std::pop_heap(queue_.begin(), queue_.end());
      const Entry entry = queue_.back();
      queue_.pop_back();
      return entry;
    }

    /// An edge, and its twin edge if it has one.
    struct Edges {
      std::uint32_t h;
      std::uint32_t twin;

      bool is_pair() const { return twin != HalfEdges::none; }
    };

    bool is_mine(const Edges& edges) const {
      return blocks_ == nullptr ||
             (blocks_->holds(block_, checks_.star()) &&
              (!edges.is_pair() || blocks_->holds(block_, twin_checks_->star())));
    }

    bool gather(const Edges& edges, Vec3d r) {
      return checks_.gather(mesh_, edges.h, r) &&
             (!edges.is_pair() ||
              twin_checks_->gather(mesh_, edges.twin, mesh_.twin_place(edges.h, r)));
    }

    bool keeps_surface(const Edges& edges) {
      if (!checks_.keeps_surface(mesh_, edges.h)) return false;
      return !edges.is_pair() || (twin_checks_->keeps_surface(mesh_, edges.twin) &&
                                  checks_.star().is_apart_from(twin_checks_->star()));
    }

    bool keeps_bound(const Edges& edges) {
      if (!checks_.keeps_bound(mesh_)) return false;
      if (!edges.is_pair() || twin_checks_->keeps_bound(mesh_)) return true;
      checks_.note_bound_was_met();
      return false;
    }

    bool is_allowed(const Edges& edges) const {
      if constexpr (requires { order_.allows(mesh_, checks_); }) {
        return order_.allows(mesh_, checks_) &&
               (!edges.is_pair() || order_.allows(mesh_, *twin_checks_));
      }
      return true;
    }

    void try_to_collapse(const Entry& entry) {
      const Edges edges{mesh_.from_twin(entry.h), mesh_.twin_edge(entry.h)};
      // Two vertices go; one of them may be too many.
      if (edges.is_pair() && removed_ + 2 > most_) return;
      const Merge rule = merge_rule(mesh_, edges.h);
      // Its key may be of a time when it still had a twin edge: see changes_around().
      if (rule == Merge::forbidden) {
        engine_.keys_[entry.h].value = never;
        return;
      }
      const Vec3d r = engine_.placement_.place(mesh_, edges.h, rule).r;
      const bool fits = gather(edges, r);
      // What surrounds it may be changing.
      if (fits && !is_mine(edges)) return;
      if (fits && comes_later(entry.h, edges)) return;
      if (fits && keeps_surface(edges) && is_allowed(edges) && keeps_bound(edges)) {
        collapse(edges, r);
      } else {
        engine_.keys_[entry.h].value = never;
      }
    }

    /// Puts an estimated entry back if its exact key is not the lowest any more.
    bool comes_later(std::uint32_t h, const Edges& edges) {
      if constexpr (has_exact_key<Order>) {
        Key& key = engine_.keys_[h];
        if (key.is_exact()) return false;
        double sum = order_.exact_key(mesh_, checks_);
        if (edges.is_pair()) sum += order_.exact_key(mesh_, *twin_checks_);
        const auto exact = static_cast<float>(sum);
        const float next = queue_.empty() ? limit_ : std::min(limit_, queue_.front().key);
        if (exact <= next) return false;
        key = {exact, key.stamp | Key::exact};
        push(h, key);
        return true;
      } else {
        return false;
      }
    }

    void collapse(const Edges& edges, Vec3d r) {
      give_up(checks_, edges.h);
      if (edges.is_pair()) give_up(*twin_checks_, edges.twin);
      mesh_.collapse(edges.h, r);
      note_merger(checks_);
      if (edges.is_pair()) note_merger(*twin_checks_);
      push_edges_of(checks_.star().u);
      if (edges.is_pair()) push_edges_of(twin_checks_->star().u);
    }

    /// What is known of the facets of a star, right before its edge is collapsed.
    void give_up(CollapseChecks& checks, std::uint32_t h) {
      checks.accept(mesh_, h);
      if constexpr (requires { order_.accept(mesh_, checks); }) order_.accept(mesh_, checks);
      for (const std::uint32_t f : checks.star().dying) {
        if (f == HalfEdges::none) continue;
        for (std::uint32_t side = 3 * f; side < 3 * f + 3; ++side) engine_.keys_[side] = {};
      }
    }

    void note_merger(const CollapseChecks& checks) {
      const Star& star = checks.star();
      ++removed_;
      for (int i = 0; i < star.count; ++i) mesh_.normals[star.facet[i]] = checks.normals()[i];
      engine_.placement_.collapsed(mesh_, star.u, star.v);
      order_.merged(star.u, star.v);
      std::vector<std::uint32_t>& changes = engine_.changes_;
      changes[star.u] = std::max(changes[star.u], changes[star.v]) + 1;
      if (Order::by_cost) {
        mesh_.topology.for_each_neighbour(star.u, [&](std::uint32_t w) { ++changes[w]; });
      }
    }

    void push_edges_of(std::uint32_t u) {
      mesh_.topology.for_each_outgoing(u, [&](std::uint32_t g) {
        push_one_of_two(g);
        const std::uint32_t last = HalfEdges::previous(g);
        if (mesh_.topology.opposite(last) == HalfEdges::none) push_one_of_two(last);
      });
    }

    /// Whichever half edge stood for the edge before, from now on it is the lower one. An edge with
    /// an estimate waits in the queue already, or has none low enough.
    void push_one_of_two(std::uint32_t g) {
      // The twin edge may be another block's, which then has to ask for the key itself.
      const bool is_shared = mesh_.has_twins() && blocks_ != nullptr;
      if (is_shared && !blocks_->holds_edge(block_, mesh_, g)) return;
      const std::uint32_t twin = mesh_.twin_edge(g);
      const std::uint32_t o = twin != HalfEdges::none ? twin : mesh_.topology.opposite(g);
      if (o != HalfEdges::none) engine_.keys_[std::max(g, o)] = {};
      const std::uint32_t e = mesh_.edge(g);
      if (!has_exact_key<Order> || !is_known(e)) push(e);
    }

    CollapseEngine& engine_;
    CollapseMesh& mesh_;
    Order& order_;
    CollapseChecks& checks_;
    std::optional<CollapseChecks> twin_checks_;  ///< only where there are twins
    const Blocks* blocks_ = nullptr;
    std::uint32_t block_ = 0;
    float limit_ = never;
    std::uint32_t most_ = 0;
    std::uint32_t removed_ = 0;
    std::vector<Entry> queue_;
  };

  CollapseMesh& mesh_;
  CollapseChecks& checks_;
  Placement placement_;
  std::vector<std::uint32_t> changes_;  ///< per vertex: how often its facets changed
  LargeVector<Key> keys_;               ///< per half edge
  int pass_ = 0;
};

}  // namespace scarp

#include "levelset/motion/overgrowth.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "levelset/grid/band.h"
#include "levelset/grid/stencil.h"

namespace scarp {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

/// Gas next to a surface is not further from it than this, in spacings.
constexpr float next_to_surface = 1.01F;

/// How many nodes from the film distances are looked for: what it may reach in a time step, from
/// where its own distance is known.
constexpr int pass_count = 3;

/// A film near a node: its distance along the gas, in spacings, and its speed there.
struct Film {
  float distance = infinity;
  float speed = 0;

  void take_nearer(const Film& other) {
    if (other.distance < distance || (other.distance == distance && other.speed > speed)) {
      *this = other;
    }
  }
};

/// The distance at a node whose nearest neighbours along the axes have the given ones: |grad| = 1.
float eikonal(std::array<Film, 3> axes) {
  std::sort(axes.begin(), axes.end(),
            [](const Film& a, const Film& b) { return a.distance < b.distance; });
  double result = axes[0].distance + 1;
  double sum = 0;
  double squares = 0;
  for (int n = 0; n < 3 && axes[n].distance < result; ++n) {
    const double a = axes[n].distance;
    sum += a;
    squares += a * a;
    const int count = n + 1;
    const double under_root = sum * sum - count * (squares - 1);
    if (under_root < 0) break;
    result = (sum + std::sqrt(under_root)) / count;
  }
  return static_cast<float>(result);
}

/// Nodes of a band with numbers in the order in which they are added: by leaf, then by node.
class NumberedNodes {
 public:
  explicit NumberedNodes(std::size_t leaf_count) : leaves_(leaf_count) {}

  void add(std::size_t leaf, int node) {
    if (leaves_[leaf].nodes == LeafMask{}) leaves_[leaf].first = count_;
    leaves_[leaf].nodes[node >> 6] |= bit_of(node);
    ++count_;
  }

  bool holds(std::size_t leaf, int node) const {
    return (leaves_[leaf].nodes[node >> 6] & bit_of(node)) != 0;
  }

  std::size_t number(std::size_t leaf, int node) const {
    const LeafMask& nodes = leaves_[leaf].nodes;
    std::size_t number = leaves_[leaf].first;
    for (int i = 0; i < node >> 6; ++i) number += static_cast<std::size_t>(std::popcount(nodes[i]));
    const std::uint64_t before = nodes[node >> 6] & (bit_of(node) - 1);
    return number + static_cast<std::size_t>(std::popcount(before));
  }

 private:
  struct OfLeaf {
    LeafMask nodes{};
    std::size_t first = 0;
  };

  static std::uint64_t bit_of(int node) { return std::uint64_t{1} << (node & 63); }

  std::vector<OfLeaf> leaves_;
  std::size_t count_ = 0;
};

class Overgrowth {
 public:
  Overgrowth(const Layers& layers, const std::vector<bool>& is_inert, float dt,
             std::vector<float>& speed)
      : layers_(layers),
        band_(layers.top().band()),
        is_inert_(is_inert),
        dt_(dt),
        speed_(speed),
        numbers_(band_.leaves().size()) {}

  void run() {
    find_nodes();
    std::vector<Film> before(nodes_.size());
    for (int pass = 0; pass < pass_count; ++pass) {
      film_.swap(before);
      for (std::size_t n = 0; n < nodes_.size(); ++n) film_[n] = film_at(nodes_[n], before);
    }
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      const Film& film = film_[n];
      const std::size_t at = place(nodes_[n]);
      const float gap = std::max(film.distance - phi(nodes_[n]), 0.0F);
      if (film.speed * dt_ > gap) speed_[at] = film.speed - gap / dt_;
    }
  }

 private:
  /// Gas that only sees what does not move.
  void find_nodes() {
    const std::vector<bool> in_reach = leaves_in_reach();
    for (std::size_t at = 0; at < speed_.size(); ++at) {
      if (!in_reach[at / leaf_size]) continue;
      const Leaf& leaf = band_.leaves()[at / leaf_size];
      const auto offset = static_cast<int>(at % leaf_size);
      const float here = leaf.phi[offset];
      if (here < 0 || here > next_to_surface || speed_[at] != 0) continue;
      const Node node = node_at(leaf, offset);
      if (!is_stored(node) || !touches_standing(node)) continue;
      numbers_.add(at / leaf_size, offset);
      nodes_.push_back(node);
    }
    film_.resize(nodes_.size());
  }

  /// Leaves in which something grows and all around them.
  std::vector<bool> leaves_in_reach() const {
    std::vector<bool> in_reach(band_.leaves().size(), false);
    for (std::size_t n = 0; n < in_reach.size(); ++n) {
      const float* speed = &speed_[n * leaf_size];
      if (std::none_of(speed, speed + leaf_size, [](float v) { return v > 0; })) continue;
      const Leaf& leaf = band_.leaves()[n];
      const Node beyond{stored_nodes(band_, leaf, 0), stored_nodes(band_, leaf, 1), leaf_edge};
      for (int side = 0; side < 27; ++side) {
        Node node = leaf.origin;
        for (int axis = 0, rest = side; axis < 3; ++axis, rest /= 3) {
          node[axis] += rest % 3 == 0 ? -1 : rest % 3 == 1 ? 0 : beyond[axis];
        }
        const std::size_t at = place(node);
        if (at < speed_.size()) in_reach[at / leaf_size] = true;
      }
    }
    return in_reach;
  }

  bool is_stored(const Node& node) const {
    return node[0] < band_.node_count(0) && node[1] < band_.node_count(1);
  }

  float phi(const Node& node) const { return band_.node(node[0], node[1], node[2]); }

  /// Where the values of a node are; beyond them if its leaf is missing.
  std::size_t place(const Node& node) const {
    const NodePlace at = band_.place(node);
    return at.is_there() ? at.index() : speed_.size();
  }

  static Node neighbour(Node node, int face) {
    node[face / 2] += face % 2 == 0 ? -1 : 1;
    return node;
  }

  /// Whether a node lies in solid that does not move.
  bool stands(const Node& node) const {
    if (!(phi(node) < 0)) return false;
    for (std::size_t layer = 0; layer < layers_.stack.size(); ++layer) {
      if (layers_.stack[layer].phi.node(node[0], node[1], node[2]) < 0) return is_inert_[layer];
    }
    return false;
  }

  bool touches_standing(const Node& node) const {
    for (int face = 0; face < 6; ++face) {
      if (stands(neighbour(node, face))) return true;
    }
    return false;
  }

  bool touches_gas(const Node& node) const {
    for (int face = 0; face < 6; ++face) {
      if (phi(neighbour(node, face)) >= 0) return true;
    }
    return false;
  }

  /// What is known of a film at a node that moves; in solid only at its surface:
  /// what lies buried below a mask is not on its way.
  Film known(const Node& node, const std::vector<Film>& found) const {
    const std::size_t at = place(node);
    if (at == speed_.size()) return {};
    const std::size_t leaf = at / leaf_size;
    const auto offset = static_cast<int>(at % leaf_size);
    if (numbers_.holds(leaf, offset)) return found[numbers_.number(leaf, offset)];
    const float here = phi(node);
    return speed_[at] > 0 && (here >= 0 || touches_gas(node)) ? Film{here, speed_[at]} : Film{};
  }

  /// The same at a neighbour; what does not move takes part as if the film went on in it.
  Film seen_at(const Node& other, const Node& from, const std::vector<Film>& found) const {
    if (!stands(other)) return known(other, found);
    Film nearest;
    for (int face = 0; face < 6; ++face) {
      const Node beside = neighbour(other, face);
      if (beside != from && !stands(beside)) nearest.take_nearer(known(beside, found));
    }
    return nearest;
  }

  Film film_at(const Node& node, const std::vector<Film>& found) const {
    std::array<Film, 3> axes;
    Film nearest;
    for (int face = 0; face < 6; ++face) {
      const Film seen = seen_at(neighbour(node, face), node, found);
      axes[face / 2].take_nearer(seen);
      nearest.take_nearer(seen);
    }
    if (nearest.distance == infinity) return {};
    return {eikonal(axes), nearest.speed};
  }

  const Layers& layers_;
  const Band& band_;
  const std::vector<bool>& is_inert_;
  float dt_;
  std::vector<float>& speed_;
  std::vector<Node> nodes_;
  std::vector<Film> film_;  ///< at each of them
  NumberedNodes numbers_;   ///< of them
};

}  // namespace

void overgrow(const Layers& layers, const std::vector<bool>& is_inert, double dt,
              std::vector<float>& speed) {
  const auto scaled_dt = static_cast<float>(dt / layers.frame.spacing);
  Overgrowth(layers, is_inert, scaled_dt, speed).run();
}

}  // namespace scarp

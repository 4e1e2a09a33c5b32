#include "levelset/bath/diffusion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/bath/conduction.h"
#include "levelset/grid/band.h"

namespace scarp {

namespace {

constexpr std::uint32_t no_node = ConductionNetwork::no_node;
constexpr int most_turns = 100;

/// phi in the box around the surface, up to where the grid of the bath ends.
class BathBox {
 public:
  BathBox(const Layers& layers, const Box& extent, double layer)
      : frame_(layers.frame), lowest_(node_below(extent.lower.z) - 1) {
    double wide = 0;
    for (int axis = 0; axis < frame_.lateral_axes(); ++axis)
      wide = std::max(wide, frame_.sides().width(axis));
    // Half a spacing of the layer at least remains above the box, if the layer is no thinner.
    const double h = frame_.spacing;
    const int top = std::max(node_below(extent.upper.z) + 1,
                             node_below(extent.upper.z + std::min(wide + 2 * h, layer - 0.5 * h)));
    for (int axis = 0; axis < 2; ++axis) count_[axis] = frame_.own_nodes(axis);
    count_[2] = top - lowest_ + 1;
    rest_of_layer_ = std::max(layer - (height(count_[2] - 1) - extent.upper.z), 0.0);
    phi_.resize(static_cast<std::size_t>(count_[0]) * count_[1] * count_[2]);
    const Band& band = layers.top().band();
    parallel_for(phi_.size(), std::size_t{1} << 14, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        const Node node = node_of(n);
        phi_[n] = band.node(node[0], node[1], node[2] + lowest_);
      }
    });
  }

  std::size_t size() const { return phi_.size(); }
  const std::array<int, 3>& count() const { return count_; }
  const Frame& frame() const { return frame_; }
  /// What the layer is thick above the box. Units: nm.
  double rest_of_layer() const { return rest_of_layer_; }

  std::size_t index(const Node& node) const {
    return (static_cast<std::size_t>(node[0]) * count_[1] + node[1]) * count_[2] + node[2];
  }
  Node node_of(std::size_t index) const {
    const auto z = static_cast<int>(index % count_[2]);
    const std::size_t column = index / count_[2];
    return {static_cast<int>(column / count_[1]), static_cast<int>(column % count_[1]), z};
  }

  bool is_bath(std::size_t index) const { return phi_[index] > 0; }
  bool is_top(std::size_t index) const {
    return index % count_[2] == static_cast<std::size_t>(count_[2]) - 1;
  }

  /// The node next to one, mirrored or wrapped; nothing above and below the box, or where a
  /// cross-section has no sides.
  std::optional<Node> beside(Node node, std::size_t axis, int step) const {
    if (!varies_along(axis)) return std::nullopt;
    node[axis] += step;
    if (axis < 2) {
      node[axis] = folded(axis, node[axis]);
    } else if (node[2] < 0 || node[2] >= count_[2]) {
      return std::nullopt;
    }
    return node;
  }

  /// The domain, or the box, ends here.
  bool is_side(const Node& node, std::size_t axis, int step) const {
    if (axis == 2) return step > 0 && node[2] == count_[2] - 1;
    if (!varies_along(axis)) return step < 0;
    return !is_periodic(axis) && node[axis] == (step < 0 ? 0 : count_[axis] - 1);
  }

  /// How far the bath reaches from the middle of a link of two of its nodes to one side, in
  /// spacings: half-way to the next link, or to the surface before that.
  double reach(const Node& a, const Node& b, std::size_t axis, int step) const {
    if (is_side(a, axis, step)) return 0;
    if (!varies_along(axis)) return 1;
    const std::optional<Node> a_beside = beside(a, axis, step);
    const std::optional<Node> b_beside = beside(b, axis, step);
    if (!a_beside || !b_beside) return 0.5;  // below the box, where there is no bath
    const double here = 0.5 * (static_cast<double>(phi_[index(a)]) + phi_[index(b)]);
    const double there =
        0.5 * (static_cast<double>(phi_[index(*a_beside)]) + phi_[index(*b_beside)]);
    return there > 0 ? 0.5 : here / (here - there);
  }

  /// What a link is wide along an axis across it.
  double width(const Node& a, const Node& b, std::size_t axis) const {
    return reach(a, b, axis, -1) + reach(a, b, axis, 1);
  }

  /// The node next to a point.
  Node nearest(Vec3d r) const {
    Node node{};
    for (std::size_t a = 0; a < 2; ++a) {
      const double steps =
          (r[static_cast<int>(a)] - frame_.node_position(static_cast<int>(a), 0)) / frame_.spacing;
      node[a] = count_[a] == 1 ? 0 : folded(a, static_cast<int>(std::lround(steps)));
    }
    const auto k = static_cast<int>(std::lround(r.z / frame_.spacing)) - lowest_;
    node[2] = std::clamp(k, 0, count_[2] - 1);
    return node;
  }

 private:
  int node_below(double z) const { return static_cast<int>(std::floor(z / frame_.spacing)); }
  double height(int k) const { return frame_.node_position(2, k + lowest_); }
  bool varies_along(std::size_t axis) const { return frame_.varies_along(static_cast<int>(axis)); }
  bool is_periodic(std::size_t axis) const { return frame_.boundary[axis] == Boundary::periodic; }

  int folded(std::size_t axis, int index) const {
    const int cells = frame_.cells[axis];
    if (is_periodic(axis)) return (index % cells + cells) % cells;
    index = std::abs(index) % (2 * cells);
    return std::min(index, 2 * cells - index);
  }

  Frame frame_;
  int lowest_;  // node of the grid along z
  std::array<int, 3> count_{};
  double rest_of_layer_ = 0;
  std::vector<float> phi_;
};

/// The nodes of the box that are joined to the bath above, by their number in the network.
std::vector<std::uint32_t> joined_nodes(const BathBox& box) {
  std::vector<std::uint32_t> number(box.size(), no_node);
  std::vector<std::size_t> open;
  const auto enter = [&](std::size_t index) {
    if (!box.is_bath(index) || number[index] != no_node) return;
    number[index] = 0;
    open.push_back(index);
  };
  for (std::size_t index = 0; index < box.size(); ++index)
    if (box.is_top(index)) enter(index);
  while (!open.empty()) {
    const Node node = box.node_of(open.back());
    open.pop_back();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1})
        if (const auto next = box.beside(node, axis, step)) enter(box.index(*next));
    }
  }
  std::uint32_t count = 0;
  for (std::uint32_t& each : number)
    if (each != no_node) each = count++;
  return number;
}

// A face of the network is as wide and as high as the bath there; nm^2/s times nm.
ConductionNetwork network_of(const BathBox& box, const std::vector<std::uint32_t>& number,
                             const Solute& solute) {
  const double h = box.frame().spacing;
  const double to_bath = solute.diffusivity * h * h / std::max(box.rest_of_layer(), 0.5 * h);
  ConductionNetwork network;
  std::array<std::uint32_t, 6> none{};
  none.fill(no_node);
  for (std::size_t index = 0; index < number.size(); ++index) {
    if (number[index] == no_node) continue;
    const Node node = box.node_of(index);
    network.place.push_back(node);
    network.neighbour.push_back(none);
    network.conductance.push_back({});
    network.ground.push_back(
        box.is_top(index) ? to_bath * box.width(node, node, 0) * box.width(node, node, 1) : 0);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        if (box.is_side(node, axis, step)) continue;
        const auto next = box.beside(node, axis, step);
        if (!next || number[box.index(*next)] == no_node) continue;
        const std::size_t d = 2 * axis + (step > 0 ? 1 : 0);
        network.neighbour.back()[d] = number[box.index(*next)];
        // In the order of the lattice, so that it is the same from both sides to the last bit.
        const Node& a = step > 0 ? node : *next;
        const Node& b = step > 0 ? *next : node;
        network.conductance.back()[d] = solute.diffusivity * h * box.width(a, b, (axis + 1) % 3) *
                                        box.width(a, b, (axis + 2) % 3);
      }
    }
  }
  return network;
}

/// A piece of a facet, and the node that it gives to. Units: nm^2.
struct WallPiece {
  std::uint32_t facet = 0;
  std::uint32_t node = 0;
  double area = 0;
};

// Steps away from a node, the shortest first.
std::vector<Vec3d> steps_around() {
  constexpr int reach = 2;
  std::vector<Vec3d> steps;
  for (int i = -reach; i <= reach; ++i)
    for (int j = -reach; j <= reach; ++j)
      for (int k = -reach; k <= reach; ++k)
        steps.push_back({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
  std::ranges::stable_sort(steps, {}, [](Vec3d step) { return dot(step, step); });
  return steps;
}

// Every facet in pieces of a spacing at most, each with the node of the bath next to its middle.
std::vector<WallPiece> pieces_of(const TriMesh& facets, const BathBox& box,
                                 const std::vector<std::uint32_t>& number) {
  const double h = box.frame().spacing;
  const std::vector<Vec3d> steps = steps_around();
  std::vector<WallPiece> pieces;
  for (std::size_t f = 0; f < facets.triangles.size(); ++f) {
    const std::array<Vec3d, 3> r = corners(facets, f);
    const Vec3d area = area_vector(facets, f);
    const Vec3d along = r[1] - r[0];
    const Vec3d across = r[2] - r[0];
    const double longest = std::max({length(along), length(across), length(across - along)});
    if (length(area) == 0) continue;
    const Vec3d outward = (0.5 * h / length(area)) * area;
    const int parts = std::max(1, static_cast<int>(std::ceil(longest / h)));
    const auto add = [&](double u, double v) {
      const Vec3d middle = r[0] + u / parts * along + v / parts * across + outward;
      for (const Vec3d& step : steps) {
        const std::uint32_t node = number[box.index(box.nearest(middle + h * step))];
        if (node == no_node) continue;
        pieces.push_back({static_cast<std::uint32_t>(f), node, length(area) / (parts * parts)});
        return;
      }
    };
    for (int i = 0; i < parts; ++i) {
      for (int j = 0; j < parts - i; ++j) {
        add(i + 1.0 / 3, j + 1.0 / 3);
        if (j + 1 < parts - i) add(i + 2.0 / 3, j + 2.0 / 3);
      }
    }
  }
  return pieces;
}

/// What all facets next to each node give to it: release - uptake max(0, c - 1). nm^3/s.
struct NodeExchange {
  std::vector<double> release;
  std::vector<double> uptake;
};

NodeExchange exchange_of(std::span<const WallPiece> pieces, std::span<const Exchange> exchange,
                         std::size_t node_count) {
  NodeExchange at{std::vector<double>(node_count), std::vector<double>(node_count)};
  for (const WallPiece& piece : pieces) {
    at.release[piece.node] += piece.area * exchange[piece.facet].release;
    at.uptake[piece.node] += piece.area * exchange[piece.facet].uptake;
  }
  return at;
}

// By how much the bath's concentration is exceeded: where silica leaves easily that is next to
// nothing, and what flows follows from it alone.
//
// Where c lies above saturation the surface draws on it; where that is shows only in c. From the
// turn on that takes it to be so everywhere c rises, and no node changes twice.
std::vector<double> excess(const ConductionNetwork& walls, const NodeExchange& exchange,
                           const Solute& solute) {
  const std::size_t count = walls.size();
  std::vector<double> above_bath(count);
  std::vector<char> draws(count, 1);
  for (int turn = 0; turn < most_turns; ++turn) {
    ConductionNetwork network = walls;
    std::vector<double> source(count);
    for (std::size_t n = 0; n < count; ++n) {
      const double drawn = draws[n] ? exchange.uptake[n] : 0;
      source[n] = exchange.release[n] + drawn * (1 - solute.bath);
      network.ground[n] += drawn;
    }
    solve_conduction(network, source, above_bath);
    bool has_changed = false;
    for (std::size_t n = 0; n < count; ++n) {
      const char is_above = solute.bath + above_bath[n] > 1 ? 1 : 0;
      has_changed = has_changed || (is_above != draws[n] && exchange.uptake[n] > 0);
      draws[n] = is_above;
    }
    if (!has_changed) return above_bath;
  }
  throw NumericalError(
      "where the bath is saturated could not be found; use other rates, or report it with the "
      "recipe");
}

}  // namespace

Concentration diffuse(const Layers& layers, const TriMesh& facets,
                      std::span<const Exchange> exchange, const Solute& solute) {
  const BathBox box(layers, bounding_box(facets), solute.layer);
  const std::vector<std::uint32_t> number = joined_nodes(box);
  const ConductionNetwork network = network_of(box, number, solute);
  const std::vector<WallPiece> pieces = pieces_of(facets, box, number);
  const std::vector<double> above_bath =
      excess(network, exchange_of(pieces, exchange, network.size()), solute);

  Concentration result;
  std::vector<double> sum(facets.triangles.size());
  std::vector<double> area(facets.triangles.size());
  for (const WallPiece& piece : pieces) {
    const double here = solute.bath + above_bath[piece.node];
    sum[piece.facet] += piece.area * here;
    area[piece.facet] += piece.area;
    result.released += piece.area * exchange[piece.facet].release;
    result.settled += piece.area * exchange[piece.facet].uptake * std::max(0.0, here - 1);
  }
  for (std::size_t f = 0; f < sum.size(); ++f)
    result.at_facets.push_back(static_cast<float>(area[f] > 0 ? sum[f] / area[f] : 0));
  for (std::size_t n = 0; n < above_bath.size(); ++n)
    result.escaped += network.ground[n] * above_bath[n];
  return result;
}

}  // namespace scarp

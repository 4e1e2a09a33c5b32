#include "levelset/operations/coat_on.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <queue>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/triangle_tree.h"
#include "levelset/grid/band.h"
#include "levelset/grid/images.h"
#include "levelset/grid/redistance.h"
#include "levelset/operations/chosen_surface.h"
#include "levelset/operations/closed_voids.h"
#include "levelset/operations/layer_sets.h"
#include "levelset/surface/connectivity.h"

namespace scarp {

namespace {

/// The straight way to the chosen surface.
struct StraightWay {
  double distance = 0;
  Vec3d step{};  ///< to its nearest point
};

class ChosenDistance {
 public:
  ChosenDistance(const Frame& frame, const TriMesh& chosen, double limit)
      : frame_(frame), limit_(limit), tree_(chosen) {}

  /// No longer than the limit; that where nothing is as near.
  StraightWay operator()(Vec3d r) const {
    r = frame_.in_section(r);
    // Triangles are no mirror images: what lies beyond the diagonal asks where its image lies.
    const bool is_beyond = frame_.diagonal && r.y > r.x;
    if (is_beyond) std::swap(r.x, r.y);
    StraightWay way{.distance = limit_};
    look_from(r, way);
    for (const Image& image : images_of(frame_, r, limit_)) look_from(image.r, way);
    if (is_beyond) std::swap(way.step.x, way.step.y);
    return way;
  }

 private:
  void look_from(Vec3d from, StraightWay& way) const {
    const ClosestPoint found = tree_.closest(from, way.distance);
    if (found.found() && found.distance < way.distance)
      way = {.distance = found.distance, .step = found.point - from};
  }

  const Frame& frame_;
  double limit_;
  TriangleTree tree_;
};

/// Whether a straight way runs through the gas; along walls, too, and over edges, which the grid
/// rounds.
bool is_clear(const LevelSet& top, Vec3d from, Vec3d to) {
  const double room = 0.1 * top.frame().spacing;
  const double shortest = 0.25 * top.frame().spacing;
  const double end = length(to - from);
  const Vec3d along = normalized(to - from);
  for (double gone = 0; gone < end;) {
    const double distance = top.distance(from + gone * along);
    if (distance < -room) return false;
    gone += std::max(distance, shortest);
  }
  return true;
}

bool is_solid(const Band& band, const Node& node) {
  return band.node(node[0], node[1], node[2]) < 0;
}

/// Calls visit(node, step there) for the nodes around one, along diagonals, too; none lies beyond a
/// reflective side, where no way is shorter. Units of the step: nm.
template <class Visit>
void for_each_neighbour(const Band& band, const Node& node, const Visit& visit) {
  const Frame& frame = band.frame();
  const int rows = frame.varies_along(1) ? 1 : 0;
  for (int x = -1; x <= 1; ++x)
    for (int y = -rows; y <= rows; ++y)
      for (int z = -1; z <= 1; ++z) {
        const Node raw{node[0] + x, node[1] + y, node[2] + z};
        const Node other{band.fold(0, raw[0]), band.fold(1, raw[1]), raw[2]};
        const bool is_image = (frame.boundary[0] == Boundary::reflective && raw[0] != other[0]) ||
                              (frame.boundary[1] == Boundary::reflective && raw[1] != other[1]);
        if (is_image || (x == 0 && y == 0 && z == 0)) continue;
        visit(other, frame.spacing * Vec3d(Vec3<int>{x, y, z}));
      }
}

/// Nodes of gas that the straight way from the nearest point of the chosen surface does not reach,
/// and how long the shortest way through the gas is.
///
/// Ways go from node to node, the nearest first, and each is pulled straight: so they bend at edges
/// of the solid, not at nodes.
class Shadow {
 public:
  /// film: by straight ways.
  Shadow(const Layers& layers, const ChosenDistance& straight, const LevelSet& film,
         double thickness)
      : frame_(layers.frame),
        top_(layers.top()),
        straight_(straight),
        film_(film),
        farthest_(thickness + LevelSet::half_width * frame_.spacing) {
    find_nodes();
    find_ways();
  }

  /// Calls visit(node, length in nm); infinite where no way leads.
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (const auto& [node, way] : ways_) visit(node, way.length);
  }

 private:
  struct Way {
    double length = std::numeric_limits<double>::infinity();
    double before = 0;  ///< of its length what lies before its last bend
    Vec3d to_bend{};    ///< from the node
  };

  Vec3d position(const Node& node) const { return frame_.in_section(frame_.node_position(node)); }

  void find_nodes() {
    const Band& band = top_.band();
    const int lowest = static_cast<int>(std::floor(top_.lower() / frame_.spacing));
    const int highest = static_cast<int>(std::ceil((top_.upper() + farthest_) / frame_.spacing));
    const auto rows = static_cast<std::size_t>(band.node_count(1));
    std::vector<std::vector<Node>> found(static_cast<std::size_t>(band.node_count(0)) * rows);
    parallel_for(found.size(), 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t column = begin; column < end; ++column)
        for (int k = lowest; k <= highest; ++k) {
          const Node node{static_cast<int>(column / rows), static_cast<int>(column % rows), k};
          if (is_in_shadow(node)) found[column].push_back(node);
        }
    });
    for (const std::vector<Node>& column : found)
      for (const Node& node : column) ways_.emplace_hint(ways_.end(), node, Way{});
  }

  bool is_in_shadow(const Node& node) const {
    if (is_solid(top_.band(), node)) return false;
    // Most nodes are further away.
    if (!(film_.node(node[0], node[1], node[2]) < LevelSet::half_width)) return false;
    const Vec3d r = position(node);
    const StraightWay way = straight_(r);
    return way.distance < farthest_ && !is_clear(top_, r, r + way.step);
  }

  void find_ways() {
    const Band& band = top_.band();
    using Waiting = std::pair<double, Node>;
    std::priority_queue<Waiting, std::vector<Waiting>, std::greater<>> waiting;
    const auto offer = [&](const Node& node, const Way& way) {
      if (!(way.length < ways_.at(node).length)) return;
      ways_.at(node) = way;
      waiting.emplace(way.length, node);
    };
    for (const auto& each : ways_) {
      const Node node = each.first;
      for_each_neighbour(band, node, [&](const Node& from, Vec3d step) {
        if (ways_.count(from) > 0 || is_solid(band, from)) return;
        const StraightWay way = straight_(position(from));
        if (way.distance >= farthest_) return;  // whether it is clear has not been looked at
        offer(node, prolonged({way.distance, 0, way.step}, position(node) + step, position(node)));
      });
    }
    while (!waiting.empty()) {
      const auto [length, node] = waiting.top();
      waiting.pop();
      const Way way = ways_.at(node);
      if (length > way.length) continue;
      for_each_neighbour(band, node, [&](const Node& to, Vec3d step) {
        if (ways_.count(to) > 0) offer(to, prolonged(way, position(to) - step, position(to)));
      });
    }
  }

  /// The way to a node through the next one.
  Way prolonged(const Way& way, Vec3d from, Vec3d to) const {
    const Vec3d bend = from + way.to_bend;
    if (is_clear(top_, to, bend)) return {way.before + length(to - bend), way.before, bend - to};
    if (!is_clear(top_, to, from)) return {};
    // The last place on the way from which the node is seen.
    double seen = 1;
    double unseen = 0;
    for (int halves = 0; halves < 6; ++halves) {
      const double part = 0.5 * (seen + unseen);
      (is_clear(top_, to, bend + part * (from - bend)) ? seen : unseen) = part;
    }
    const Vec3d next = bend + seen * (from - bend);
    const double before = way.before + length(next - bend);
    return {before + length(to - next), before, next - to};
  }

  const Frame& frame_;
  const LevelSet& top_;
  const ChosenDistance& straight_;
  const LevelSet& film_;
  double farthest_;  ///< that matters; nm
  std::map<Node, Way> ways_;
};

/// phi where a film does not reach what lies in the shadow; there the surface stays bare.
std::map<Node, float> bare_values(const Band& before, const Shadow& shadow, double thickness) {
  std::map<Node, float> values;
  const double spacing = before.frame().spacing;
  shadow.for_each([&](const Node& node, double length) {
    const auto film = static_cast<float>((length - thickness) / spacing);
    const float phi = off_surface(std::min(before.node(node[0], node[1], node[2]), film));
    values[node] = phi;
    if (phi < 0) return;
    for (int face = 0; face < 6; ++face) {
      Node other = node;
      other[static_cast<std::size_t>(face / 2)] += face % 2 == 0 ? -1 : 1;
      other = {before.fold(0, other[0]), before.fold(1, other[1]), other[2]};
      if (is_solid(before, other)) values[other] = before.node(other[0], other[1], other[2]);
    }
  });
  return values;
}

/// Takes a film away where it has gone through walls.
void set_values(const std::map<Node, float>& values, Band& band) {
  std::vector<NewLeaf> added;
  for (const auto& each : values) {
    const auto [i, j, k] = each.first;
    if (band.find(i >> 3, j >> 3, k >> 3) == Band::missing_solid)
      added.push_back({.origin = {i & ~7, j & ~7, k & ~7}, .solid = true});
  }
  std::sort(added.begin(), added.end());
  added.erase(std::unique(added.begin(), added.end()), added.end());
  band.change_leaves(added, {});
  for (const auto& [node, phi] : values) {
    const NodePlace at = band.place(node);
    if (at.is_there()) band.leaves()[static_cast<std::size_t>(at.leaf)].phi[at.offset] = phi;
  }
  band.trim();
  redistance_fully(band);
}

}  // namespace

void coat_on(Layers& layers, double thickness, std::span<const MaterialId> materials) {
  SCARP_ASSERT(thickness, >, 0.0);
  const TriMesh chosen = chosen_surface(layers, open_gas(layers), materials);
  if (chosen.triangles.empty()) return;
  const Frame& frame = layers.frame;
  const double margin = LevelSet::half_width * frame.spacing;
  // The band, and the middle of a leaf that may be in it.
  const ChosenDistance straight(frame, chosen, thickness + margin + 8 * frame.spacing);
  const LevelSet film(
      frame, [&](Vec3d r) { return straight(r).distance - thickness; },
      layers.top().lower() - margin, layers.top().upper() + thickness + margin);
  const Shadow shadow(layers, straight, film, thickness);
  const auto bare = bare_values(layers.top().band(), shadow, thickness);
  fill_gas(layers, film);
  if (!bare.empty()) set_values(bare, layers.top().band());
}

}  // namespace scarp

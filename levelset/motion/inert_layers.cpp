#include "levelset/motion/inert_layers.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/parallel.h"
#include "levelset/grid/exposure.h"
#include "levelset/grid/stencil.h"

namespace scarp {

namespace {

/// Only nodes this near to the surface, in spacings, can be next to it after a time step.
constexpr float near_surface = 2;

/// What is left of a film where the layer below it does not move and is seen next to it goes with
/// the film once it is thinner than this, in spacings: there both ends of an edge hold it.
constexpr float residue_thickness = 0.05F;

/// New phi of a node.
struct NewPhi {
  float value;
  float residue = 0;  ///< thickness of the film that goes besides what its speed takes, in spacings

  NewPhi(float phi, float thickness = 0) : value(phi), residue(thickness) {}
};

float steepest(const float* phi) {
  float slope = 0.5F;  // at least, where two surfaces meet
  for (const std::ptrdiff_t stride : axis_strides)
    slope = std::max(slope, 0.5F * std::abs(phi[stride] - phi[-stride]));
  return slope;
}

/// The part of a node's cell that lies in the domain.
double share(const Frame& frame, const Node& at) {
  double part = 1;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const bool is_side = at[axis] == 0 || at[axis] == frame.cells[axis];
    if (is_side && frame.boundary[axis] == Boundary::reflective) part *= 0.5;
  }
  return part;
}

/// Takes new phi over from one array to another and lets keep(node, old phi, new phi) change it
/// at nodes near the surface; the volume of residues.
template <class Keep>
double for_each_near_node(const Layers& layers, const LeafValues& from, LeafValues& to,
                          const Keep& keep) {
  const Band& band = layers.top().band();
  return parallel_reduce(
      band.leaves().size(), 8, 0.0,
      [&](std::size_t begin, std::size_t end) {
        Block block;
        double volume = 0;
        for (std::size_t n = begin; n < end; ++n) {
          const Leaf& leaf = band.leaves()[n];
          gather(
              band, n, [&](std::size_t m) -> const float* { return band.leaves()[m].phi; }, block);
          for (int node = 0; node < leaf_size; ++node) {
            const float old = leaf.phi[node];
            to[n][node] = from[n][node];
            if (!(std::abs(old) < near_surface)) continue;
            const Node at = node_at(leaf, node);
            const float* around = block.row(node >> 6, (node >> 3) & 7) + (node & 7);
            const NewPhi next = keep(at, around, from[n][node]);
            to[n][node] = next.value;
            if (next.residue == 0) continue;
            // Of each row of nodes along the axis that the surface faces most, one is nearest.
            const float slope = steepest(around);
            if (std::abs(old + next.value) < slope)
              volume += share(layers.frame, at) * next.residue / slope;
          }
        }
        return volume;
      },
      [](double sum, double part) { return sum + part; });
}

/// The layers that do not move, as nodes of the band see them.
class InertLayers {
 public:
  static constexpr int none = -1;

  /// way: of what recedes fastest in the time step, in spacings.
  InertLayers(const Layers& layers, const std::vector<bool>& is_inert, float way)
      : layers_(layers), is_inert_(is_inert), way_(way) {}

  float phi(int layer, std::array<int, 3> node) const {
    return layers_.stack[static_cast<std::size_t>(layer)].phi.node(node[0], node[1], node[2]);
  }

  /// The standing layer whose material a node lies in.
  int standing_layer_at(std::array<int, 3> node) const {
    for (int layer = 0; layer < static_cast<int>(layers_.stack.size()); ++layer) {
      if (phi(layer, node) < 0) {
        return is_inert_[static_cast<std::size_t>(layer)] ? layer : none;
      }
    }
    return none;
  }

  bool touches_standing(std::array<int, 3> node) const {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        std::array<int, 3> other = node;
        other[axis] += step;
        if (standing_layer_at(other) != none) {
          return true;
        }
      }
    }
    return false;
  }

  /// From a node that is, or may become, gas to the interface with a standing layer one node
  /// further.
  float distance_to_buried(std::array<int, 3> node, int axis, int step, float old) const {
    std::array<int, 3> other = node;
    other[axis] += step;
    const int layer = standing_layer_at(other);
    if (layer == none) {
      return LevelSet::half_width;
    }
    // Above the standing layer its own phi tells the distance.
    const float above = phi(layer, node);
    if (!(above < 0)) {
      return std::clamp(above, smallest_phi, 1.0F);
    }
    if (layer == 0) {
      return LevelSet::half_width;
    }
    // Below the interface phi of the lower layer tells the distance, unless the surface is nearer.
    const float lower = phi(layer - 1, node);
    const float distance = lower > old + same_phi ? -lower : 1 - phi(layer - 1, other);
    return std::clamp(distance, smallest_phi, 1.0F);
  }

  /// What a node keeps because a standing layer's surface is seen on one of its edges: phi as it
  /// is. If nothing else is seen there, or a residue, phi of the layer: what was left of a film
  /// above is gone.
  std::optional<NewPhi> phi_at_standing(std::array<int, 3> node, const float* old,
                                        float wanted) const {
    bool any = false;
    bool nothing_else = true;
    float of_layer = LevelSet::half_width;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        const float there = old[step * axis_strides[axis]];
        if ((*old < 0) == (there < 0)) continue;
        const int layer = standing_layer_seen(node, axis, step, *old);
        any = any || layer != none;
        nothing_else = nothing_else && layer != none;
        if (layer != none) of_layer = std::min(of_layer, bare_phi(layer, node, axis, step, *old));
      }
    }
    if (!any) return std::nullopt;
    const float film = of_layer - *old;
    if (!(film > same_phi)) return *old;
    if (!nothing_else && film >= residue_thickness) return std::clamp(wanted, *old, of_layer);
    return NewPhi(of_layer, std::min(film, std::max(0.0F, of_layer - wanted)));
  }

  /// How far the wall of a standing layer is from a gas node beside it, if the node knows the
  /// distance to what lies below that layer instead, or did until that went: nothing tells but how
  /// phi goes on within the layer.
  std::optional<float> hidden_wall(std::array<int, 3> node, const float* old) const {
    const auto hides = [&](int layer) { return phi(layer - 1, node) <= *old + same_phi; };
    bool may_be_hidden = false;  // cheaper to tell than what is seen
    for (int layer = 1; layer < static_cast<int>(is_inert_.size()); ++layer)
      may_be_hidden = may_be_hidden || (is_inert_[static_cast<std::size_t>(layer)] && hides(layer));
    if (!may_be_hidden) return std::nullopt;
    float distance = LevelSet::half_width;
    bool is_hidden = false;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        if (!(old[step * axis_strides[axis]] < 0)) continue;
        const int layer = standing_layer_seen(node, axis, step, *old);
        if (layer == none) continue;
        is_hidden = is_hidden || (layer > 0 && hides(layer));
        std::array<int, 3> solid = node;
        solid[axis] += step;
        std::array<int, 3> within = solid;
        within[axis] += step;
        if (const auto depth = depth_of_interface(layer, solid, axis, step)) {
          distance = std::min(distance, 1 - *depth);
          continue;
        }
        const float phi_solid = phi(layer, solid);
        distance = std::min({distance, 2 * phi_solid - phi(layer, within), phi_solid + 1});
      }
    }
    return is_hidden && distance > *old + same_phi ? std::optional(distance) : std::nullopt;
  }

  /// Whether a wall of a standing layer that stands on what is below it is beside a node.
  bool stands_against_wall(std::array<int, 3> node) const {
    for (int axis = 0; axis < 2; ++axis) {
      for (const int step : {-1, 1}) {
        std::array<int, 3> other = node;
        other[axis] += step;
        const int layer = standing_layer_at(other);
        if (layer != none && depth_of_interface(layer, other, axis, step)) return true;
      }
    }
    return false;
  }

  /// Of a node in a standing layer at which a wall of that is laid bare from the side, how far that
  /// is: as the wall goes on that is seen on an edge beside. Not where what went stood against the
  /// wall, whose place is known.
  std::optional<float> wall_laid_bare(int layer, std::array<int, 3> node, int axis,
                                      int step) const {
    if (depth_of_interface(layer, node, axis, -step)) return std::nullopt;
    std::optional<float> nearest;
    for (int across = 0; across < 3; ++across) {
      if (across == axis) continue;
      for (const int aside : {-1, 1}) {
        std::array<int, 3> beside = node;
        beside[across] += aside;
        std::array<int, 3> gas = beside;
        gas[axis] += step;
        const float here = layers_.top().node(beside[0], beside[1], beside[2]);
        if (!(here < 0) || layers_.top().node(gas[0], gas[1], gas[2]) < 0) continue;
        if (standing_layer_seen(beside, axis, step, here) != layer) continue;
        std::array<int, 3> next = beside;
        next[across] += aside;
        const float on = 2 * phi(layer, beside) - phi(layer, next);
        nearest = std::max(nearest.value_or(on), on);
      }
    }
    return nearest;
  }

 private:
  /// How far a node in a standing layer is from the interface with what is below that, where this
  /// lies across the edge to the node before it. step: from there to the node.
  std::optional<float> depth_of_interface(int layer, std::array<int, 3> node, int axis,
                                          int step) const {
    if (layer == 0) return std::nullopt;
    std::array<int, 3> beyond = node;
    beyond[axis] += step;
    const float depth = phi(layer - 1, node);
    const float least_slope = axis == 2 ? 0.7F : 0.85F;  // of an underside; of a wall
    const bool is_across = depth > 0 && depth < 1 && phi(layer - 1, beyond) - depth > least_slope;
    return is_across ? std::optional(depth) : std::nullopt;
  }

  /// phi of a node once nothing is left between it and a standing layer that is seen on an edge:
  /// that of the layer, or, at its underside and at a wall that stood against what is below it, the
  /// distance to that, as far as what was there is etched in this time step.
  float bare_phi(int layer, std::array<int, 3> node, int axis, int step, float old) const {
    const float bare = phi(layer, node);
    std::array<int, 3> solid = node;
    if (!(old < 0)) solid[axis] += step;
    const auto depth = depth_of_interface(layer, solid, axis, old < 0 ? -step : step);
    if (!depth) return bare;
    return std::max(bare, std::min(old < 0 ? -*depth : 1 - *depth, old + way_));
  }

  /// The standing layer that is seen on a cut edge, or none.
  int standing_layer_seen(std::array<int, 3> node, int axis, int step, float here) const {
    std::array<int, 3> other = node;
    other[axis] += step;
    if (standing_layer_at(here < 0 ? node : other) == none) {
      return none;
    }
    const std::uint16_t seen = exposed_layer(layers_, step > 0 ? node : other, axis);
    return is_inert_[seen] ? seen : none;
  }

  const Layers& layers_;
  const std::vector<bool>& is_inert_;
  float way_;
};

class Keeper {
 public:
  Keeper(const Layers& layers, const SpeedField& field, float dt)
      : layers_(layers),
        field_(field),
        dt_(dt),
        etches_crystal_(etches_crystal(field)),
        band_(layers.top().band()),
        standing_(layers, field.is_inert, dt * *std::ranges::max_element(field.fastest_etch)) {}

  /// The volume of residues, in spacings cubed.
  double run(LeafValues& moved, LeafValues& limited) const {
    const double outside =
        for_each_near_node(layers_, moved, limited,
                           [&](std::array<int, 3> at, const float* old, float wanted) -> NewPhi {
                             if (standing_.standing_layer_at(at) != InertLayers::none)
                               return wanted;
                             return limit_outside(at, old, not_held_back(at, old, wanted), moved);
                           });
    const double inside =
        for_each_near_node(layers_, limited, moved,
                           [&](std::array<int, 3> at, const float* old, float wanted) -> NewPhi {
                             const int layer = standing_.standing_layer_at(at);
                             if (layer == InertLayers::none) return wanted;
                             return limit_inside(layer, at, old, wanted, limited);
                           });
    return outside + inside;
  }

 private:
  /// Solid at the line where its surface meets a standing layer moves by speed times time at least:
  /// there the upwind slope is too small, because phi of the gas is cut off by the distance to the
  /// standing layer.
  float not_held_back(std::array<int, 3> node, const float* old, float wanted) const {
    if (field_.grows_beside_inert) return wanted;
    if (!etches_crystal_ && standing_.stands_against_wall(node))
      wanted = std::max(wanted, along_wall(node, old));
    if (!(*old < 0)) {
      return wanted;
    }
    const float free = *old - dt_ * speed(node);
    if (free <= wanted) {
      return wanted;
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        std::array<int, 3> gas = node;
        gas[axis] += step;
        if (!(old[step * axis_strides[axis]] < 0) && standing_.touches_standing(gas)) {
          return free;
        }
      }
    }
    return wanted;
  }

  /// Where what recedes goes down along the wall of a standing layer above it: there phi beyond the
  /// wall is the distance to the surface of that layer, and tells neither slope nor normal of what
  /// goes. From a node to the next one along the wall, gas to solid or back.
  float along_wall(std::array<int, 3> node, const float* old) const {
    float fastest = 0;
    const Vec3f normal = normal_beside_wall(node, old);
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        if ((old[step * axis_strides[axis]] < 0) == (*old < 0)) continue;
        std::array<int, 3> other = node;
        other[axis] += step;
        const std::array<int, 3>& solid = *old < 0 ? node : other;
        if (standing_.standing_layer_at(solid) != InertLayers::none) continue;
        if (*old < 0 && !standing_.stands_against_wall(other)) continue;
        fastest = std::min(fastest, speed_along(field_, band_.place(solid).index(), normal));
      }
    }
    return *old - dt_ * fastest;
  }

  /// By differences to nodes outside of standing layers.
  Vec3f normal_beside_wall(std::array<int, 3> node, const float* old) const {
    Vec3f gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const std::ptrdiff_t stride = axis_strides[axis];
      std::array<int, 3> lower = node;
      std::array<int, 3> upper = node;
      lower[axis] -= 1;
      upper[axis] += 1;
      const bool has_lower = standing_.standing_layer_at(lower) == InertLayers::none;
      const bool has_upper = standing_.standing_layer_at(upper) == InertLayers::none;
      if (!has_lower && !has_upper) continue;
      const float high = has_upper ? old[stride] : *old;
      const float low = has_lower ? old[-stride] : *old;
      gradient[axis] = (high - low) * (has_lower && has_upper ? 0.5F : 1.0F);
    }
    return gradient / std::max(length(gradient), 1e-6F);
  }

  float speed(std::array<int, 3> node) const { return field_.speed[band_.place(node).index()]; }

  /// Gas next to a standing layer's surface keeps phi or loses what grows; what else is next to a
  /// buried interface gets at most its distance to that.
  NewPhi limit_outside(std::array<int, 3> node, const float* old, float wanted,
                       const LeafValues& moved) const {
    if (wanted < *old) {
      // What grows over a standing layer does so with |grad phi| = 1, though that is near as well.
      return *old >= 0 && !field_.grows_beside_inert && standing_.touches_standing(node)
                 ? *old - dt_ * speed(node)
                 : wanted;
    }
    if (*old >= 0) {
      if (const auto kept = standing_.phi_at_standing(node, old, wanted)) {
        return kept->value > *old ? *kept : beside_wall(node, old, wanted, moved);
      }
    }
    float limit = wanted;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        const float there = old[step * axis_strides[axis]];
        if (*old >= 0 && !(there < 0)) continue;
        limit = std::min(limit, standing_.distance_to_buried(node, axis, step, *old));
      }
    }
    return limit;
  }

  /// Gas in the corner between a standing layer's wall and what recedes from it: phi was the
  /// distance to the latter, and becomes that to the wall.
  float beside_wall(std::array<int, 3> node, const float* old, float wanted,
                    const LeafValues& moved) const {
    const auto wall = standing_.hidden_wall(node, old);
    if (!wall) return *old;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        std::array<int, 3> other = node;
        other[axis] += step;
        const bool is_still_beside = old[step * axis_strides[axis]] < 0 &&
                                     new_phi(other, moved) < 0 &&
                                     standing_.standing_layer_at(other) == InertLayers::none;
        if (is_still_beside) return std::min(wanted, *wall);
      }
    }
    return *wall;
  }

  /// Inside a standing layer: where its surface was seen phi stays; where it becomes exposed the
  /// buried interface becomes the surface; elsewhere phi stays behind both.
  NewPhi limit_inside(int layer, std::array<int, 3> node, const float* old, float wanted,
                      const LeafValues& moved) const {
    if (const auto seen = standing_.phi_at_standing(node, old, wanted)) {
      return wanted < *old ? wanted : *seen;
    }
    bool becomes_exposed = false;
    std::optional<float> wall;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        const float there = old[step * axis_strides[axis]];
        std::array<int, 3> other = node;
        other[axis] += step;
        becomes_exposed =
            becomes_exposed || (there < 0 && is_bared_from(other, axis, -step, moved));
        const bool is_beside = axis < 2 && there < 0 && !(new_phi(other, moved) < 0) &&
                               standing_.phi(layer, other) < 0;
        if (!is_beside) continue;
        const auto on = standing_.wall_laid_bare(layer, node, axis, step);
        if (on) wall = std::max(wall.value_or(*on), *on);
      }
    }
    if (wall) return std::min(*wall, -smallest_phi);
    const float inside = standing_.phi(layer, node);
    const float kept = std::min(
        layer == 0 ? inside : std::max(inside, -standing_.phi(layer - 1, node)), -smallest_phi);
    return becomes_exposed ? kept : std::min(wanted, kept);
  }

  /// Whether a node that was solid is gas now, and nothing is left between it and the interface
  /// with the standing layer one node further.
  bool is_bared_from(std::array<int, 3> node, int axis, int step, const LeafValues& moved) const {
    const float now = new_phi(node, moved);
    return !(now < 0) && now >= standing_.distance_to_buried(node, axis, step, -1) - same_phi;
  }

  float new_phi(std::array<int, 3> node, const LeafValues& moved) const {
    return value_at(band_, moved, node);
  }

  const Layers& layers_;
  const SpeedField& field_;
  float dt_;
  bool etches_crystal_;  ///< whose walls have rules of their own (free_foot.h)
  const Band& band_;
  InertLayers standing_;
};

}  // namespace

bool has_standing_layers(const SpeedField& field) {
  const auto& still = field.is_inert;
  return std::find(still.begin(), still.end(), true) != still.end() &&
         std::find(still.begin(), still.end(), false) != still.end();
}

double keep_inert_layers(const Layers& layers, const SpeedField& field, float dt, LeafValues& moved,
                         LeafValues& room) {
  return has_standing_layers(field) ? Keeper(layers, field, dt).run(moved, room) : 0;
}

}  // namespace scarp

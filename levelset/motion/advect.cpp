#include "levelset/motion/advect.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/recipe/quantity.h"
#include "levelset/grid/band.h"
#include "levelset/grid/differences.h"
#include "levelset/grid/leaf_stage.h"
#include "levelset/grid/redistance.h"
#include "levelset/grid/stencil.h"
#include "levelset/grid/symmetry.h"
#include "levelset/motion/edge_facets.h"
#include "levelset/motion/free_foot.h"
#include "levelset/motion/inert_layers.h"
#include "levelset/motion/lax_friedrichs.h"
#include "levelset/motion/recession.h"
#include "levelset/motion/slivers.h"
#include "levelset/surface/cell_words.h"

namespace scarp {

namespace {

constexpr float half_width = LevelSet::half_width;
constexpr std::size_t grain = 16;

/// A node of less than this part of the speed of another one is of another material, or in shade.
constexpr float slower = 0.5F;

using Row = std::array<float, leaf_edge>;

/// Of every node of a row of speeds the least size of those of the band within reach of the
/// differences, along the axes.
template <Scheme scheme>
SCARP_KERNEL_PART Row least_around(const float* speed, const float* phi) {
  constexpr int reach = scheme == Scheme::weno5 ? 3 : 2;
  Row least{};
  for (int k = 0; k < leaf_edge; ++k) least[k] = std::abs(speed[k]);
  for (const std::ptrdiff_t stride : axis_strides) {
    for (std::ptrdiff_t n = -reach * stride; n <= reach * stride; n += stride) {
      for (int k = 0; k < leaf_edge; ++k) {
        const bool is_in_band = std::abs(phi[n + k]) < half_width;
        least[k] = std::min(least[k], is_in_band ? std::abs(speed[n + k]) : least[k]);
      }
    }
  }
  return least;
}

/// An Euler step of phi_t = -V |grad phi|, for speeds that do not depend on the normal.
///
/// At the foot of what moves beside what is slower phi has an edge that is no edge of the surface
/// that moves, and the foot is left behind by upwind differences and gets ahead by those of WENO5.
/// There all schemes take the differences of ENO2 with their edges, which keep it in place; around
/// has the speeds with their halo, to tell where, and is null for ENO2 itself.
template <Scheme scheme>
SCARP_KERNEL_PART void move_rows(const LeafStage& leaf, const float* speed,
                                 [[maybe_unused]] const Block* around) {
  for (int i = 0; i < leaf.node_count[0]; ++i) {
    for (int j = 0; j < leaf.node_count[1]; ++j) {
      if (!leaf.moves(i, j)) {
        leaf.keep_row(i, j);
        continue;
      }
      const float* row = leaf.before.row(i, j);
      const int node = leaf_offset(i, j, 0);
      [[maybe_unused]] Row least{};
      if constexpr (scheme != Scheme::eno2) least = least_around<scheme>(around->row(i, j), row);
      for (int k = 0; k < leaf_edge; ++k) {
        const float* p = row + k;
        const float v = speed[node + k];
        const float side = v < 0 ? -1.0F : 1.0F;
        float slope = distance_slope<scheme>(p, side);
        if constexpr (scheme != Scheme::eno2) {
          const float at_foot = distance_slope<Scheme::eno2>(p, side);
          slope = least[k] < slower * std::abs(v) ? at_foot : slope;
        }
        const float moved = *p - leaf.stage.dt * v * slope;
        leaf.set(node + k, *p, moved);
      }
    }
  }
}

SCARP_VECTOR_KERNEL void move_first_order(const LeafStage& leaf, const float* speed,
                                          const Block* around) {
  move_rows<Scheme::first_order>(leaf, speed, around);
}

SCARP_VECTOR_KERNEL void move_eno2(const LeafStage& leaf, const float* speed, const Block*) {
  move_rows<Scheme::eno2>(leaf, speed, nullptr);
}

SCARP_VECTOR_KERNEL void move_weno5(const LeafStage& leaf, const float* speed,
                                    const Block* around) {
  move_rows<Scheme::weno5>(leaf, speed, around);
}

using LeafKernel = void (*)(const LeafStage&, const float*, const Block*);

LeafKernel upwind_kernel(Scheme scheme) {
  switch (scheme) {
    case Scheme::first_order:
      return move_first_order;
    case Scheme::eno2:
      return move_eno2;
    default:
      return move_weno5;
  }
}

/// The parts of the way that the stages keep. Source: Shu and Osher 1988.
std::span<const float> stage_parts(Scheme scheme) {
  static constexpr std::array<float, 1> euler{1};
  static constexpr std::array<float, 2> second{1, 0.5F};
  static constexpr std::array<float, 3> third{1, 0.25F, 2.0F / 3.0F};
  switch (scheme) {
    case Scheme::first_order:
      return euler;
    case Scheme::eno2:
      return second;
    default:
      return third;
  }
}

/// Values of the band's nodes into the tree, none of them on the surface.
SCARP_VECTOR_KERNEL void take_over(const float* moved, float* phi) {
  for (int node = 0; node < leaf_size; ++node) {
    const float value = off_surface(moved[node]);
    phi[node] = std::abs(phi[node]) < half_width ? value : phi[node];
  }
}

void write_back(Band& band, const LeafValues& values) {
  parallel_for(band.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      take_over(values[n], band.leaves()[n].phi);
    }
  });
}

/// Moves phi for a time step; move(leaf index, stage of the leaf) is asked for one stage of one
/// leaf. Stages go from the tree to scratch and on; the last one back to the tree, unless slow
/// layers have a say in what it gives, or it is the first. The volume of residues, in spacings
/// cubed.
template <class Move>
double move_band(Layers& layers, const SpeedField& field, float dt, Scheme scheme,
                 const Move& move) {
  Band& band = layers.top().band();
  const std::span<Leaf> leaves = band.leaves();
  const std::span<const float> parts = stage_parts(scheme);
  const bool keeps_standing = has_standing_layers(field);
  const bool has_slow = has_slow_layers(field);
  const bool has_limits = keeps_standing || has_slow;
  const bool has_images = layers.frame.diagonal;
  const LeafValues* before = nullptr;
  for (std::size_t stage = 0; stage < parts.size(); ++stage) {
    const bool last = stage + 1 == parts.size();
    LeafValues* after = last && stage > 0 && !has_limits ? nullptr : &band.scratch(stage % 2);
    const auto values = [&](std::size_t n) -> const float* {
      if (before == nullptr) return leaves[n].phi;
      return (*before)[n];
    };
    const auto moved = [&](std::size_t n) -> float* {
      if (after == nullptr) return leaves[n].phi;
      return (*after)[n];
    };
    parallel_for(leaves.size(), grain, [&](std::size_t begin, std::size_t end) {
      Block block;
      for (std::size_t n = begin; n < end; ++n) {
        const Leaf& leaf = leaves[n];
        gather_for(scheme, band, n, values, block);
        move(n, {.before = block,
                 .start = leaf.phi,
                 .active = leaf.active,
                 .stage = {.dt = dt,
                           .part = parts[stage],
                           .smallest_phi = last && !has_limits ? smallest_phi : 0.0F,
                           .is_first = stage == 0,
                           .is_last = last},
                 .node_count = {stored_nodes(band, leaf, 0), stored_nodes(band, leaf, 1)},
                 .after = moved(n),
                 .most_ahead = has_images ? leaf.origin[0] - leaf.origin[1] : leaf_edge});
      }
    });
    if (has_images) mirror_across_diagonal(band, moved);
    before = after;
  }
  double residues = 0;
  const int last = static_cast<int>(parts.size() - 1) % 2;
  if (keeps_standing) {
    // What the stage before the last one left is not needed any more.
    residues = keep_inert_layers(layers, field, dt, band.scratch(last), band.scratch(1 - last));
  }
  if (has_slow) {
    limit_recession(layers, field, dt, band.scratch(last));
    clear_slivers(layers, field, band.scratch(last));
  }
  if (before != nullptr) {
    write_back(band, *before);
  }
  return residues;
}

double move_by_speed(Layers& layers, const SpeedField& field, float dt, Scheme scheme) {
  const LeafKernel kernel = upwind_kernel(scheme);
  const Band& band = layers.top().band();
  const auto speed = [&](std::size_t n) { return &field.speed[n * leaf_size]; };
  return move_band(layers, field, dt, scheme, [&](std::size_t n, const LeafStage& leaf) {
    if (scheme == Scheme::eno2) return kernel(leaf, speed(n), nullptr);
    Block around;
    gather<Block::halo>(band, n, speed, around);
    kernel(leaf, speed(n), &around);
  });
}

/// phi of every leaf of a band.
std::vector<float> values_of(const Band& band) {
  std::vector<float> values;
  values.reserve(band.leaves().size() * leaf_size);
  for (const Leaf& leaf : band.leaves())
    values.insert(values.end(), leaf.phi + 0, leaf.phi + leaf_size);
  return values;
}

double move_by_normal(Layers& layers, const SpeedField& field, float dt, Scheme scheme) {
  Band& band = layers.top().band();
  const bool has_layers = layers.stack.size() > 1;
  const std::vector<float> before = has_layers ? values_of(band) : std::vector<float>();
  const std::vector<float> mobility = mobilities(band, field);
  const auto source = [&](std::size_t n) { return &mobility[n * leaf_size]; };
  const FreeFoot foot = free_foot(layers, field, mobility, dt);
  const std::vector<HeldNode> held = edge_facets(layers, field, mobility, dt);
  std::vector<float> shifted(is_etched_by_beam(field) ? mobility.size() : 0);
  const double residues =
      move_band(layers, field, dt, scheme, [&](std::size_t n, const LeafStage& leaf) {
        Block around;
        gather<Block::halo>(band, n, source, around);
        float* const of_leaf = shifted.empty() ? nullptr : &shifted[n * leaf_size];
        if (foot.phi.empty()) {
          move_lax_friedrichs(leaf, around, scheme, field, n, {}, of_leaf);
          return;
        }
        Block free;
        gather<1>(
            band, n, [&](std::size_t m) { return &foot.phi[m * leaf_size]; }, free);
        move_lax_friedrichs(leaf, around, scheme, field, n, {&free, &foot.most[n * leaf_size]},
                            of_leaf);
      });
  for (const HeldNode& node : held) {
    float& phi = band.leaves()[node.at / leaf_size].phi[node.at % leaf_size];
    phi = off_surface(std::max(std::min(phi, node.most), node.least));
  }
  if (has_layers) book_rise(layers, field, before);
  return residues;
}

/// The solid next to closed voids, and what it is before a move.
///
/// Where the ceiling of a void is a node thick, that node belongs to the open surface as well.
/// What grows there would move the void's surface on the other side of the node. What etches may:
/// it is about to open the void.
class Ceilings {
 public:
  Ceilings(Band& band, std::span<const std::uint64_t> closed) {
    for (std::size_t word = 0; word < closed.size(); ++word) {
      const Leaf& leaf = band.leaves()[word / leaf_edge];
      for_each_bit(closed[word], [&](int bit) {
        add_next_to(band, node_at(leaf, static_cast<int>(word % leaf_edge) * 64 + bit));
      });
    }
  }

  void keep() {
    for (const auto& [phi, before] : nodes_) *phi = std::max(*phi, before);
  }

 private:
  struct Solid {
    float* phi;
    float before;
  };

  void add_next_to(Band& band, const Node& gas) {
    for (int face = 0; face < 6; ++face) {
      Node node = gas;
      node[face / 2] += face % 2 == 0 ? -1 : 1;
      for (int axis = 0; axis < 2; ++axis) node[axis] = band.fold(axis, node[axis]);
      const int leaf = band.find(node[0] >> 3, node[1] >> 3, node[2] >> 3);
      if (leaf < 0) continue;
      float* phi = band.leaves()[static_cast<std::size_t>(leaf)].phi +
                   leaf_offset(node[0], node[1], node[2]);
      if (*phi < 0) nodes_.push_back({phi, *phi});
    }
  }

  std::vector<Solid> nodes_;
};

SCARP_VECTOR_KERNEL bool all_finite(const std::vector<float>& values) {
  int bad = 0;
  for (const float value : values) {
    bad |= std::abs(value) <= std::numeric_limits<float>::max() ? 0 : 1;
  }
  return bad == 0;
}

void require_finite(const Layers& layers, const std::vector<float>& speed) {
  const auto& leaves = layers.top().band().leaves();
  SCARP_ASSERT(speed.size(), ==, leaves.size() * leaf_size);
  if (all_finite(speed)) {
    return;
  }
  for (std::size_t n = 0; n < speed.size(); ++n) {
    if (!std::isfinite(speed[n])) {
      const Vec3d r = layers.frame.node_position(
          node_at(leaves[n / leaf_size], static_cast<int>(n % leaf_size)));
      throw NumericalError("speed is not finite at " + rounded_place(Vec3d(r)) + " nm");
    }
  }
}

}  // namespace

double advect(Layers& layers, const SpeedField& field, double dt, Scheme scheme) {
  require_finite(layers, field.speed);
  for (const AngularSpeed& part : field.angular) {
    require_finite(layers, part.amplitude);
  }
  // The dissipation of the scheme for speeds that depend on the normal is the jump between
  // one-sided derivatives, which ENO2 leaves too large.
  const bool by_normal = !field.angular.empty();
  const Scheme used = by_normal && scheme == Scheme::eno2 ? Scheme::weno5 : scheme;
  const double h = layers.frame.spacing;
  const auto scaled_dt = static_cast<float>(dt / h);
  Ceilings ceilings(layers.top().band(), field.closed);
  // Crystals are etched by a scheme that is monotone, so of first order; on planes it is exact.
  const Scheme stages = etches_crystal(field) ? Scheme::first_order : used;
  const double residues = by_normal ? move_by_normal(layers, field, scaled_dt, stages)
                                    : move_by_speed(layers, field, scaled_dt, used);
  ceilings.keep();
  redistance(layers.top().band(), used, field.closed);
  cut_lower_layers(layers);
  return residues * h * h * h;
}

}  // namespace scarp

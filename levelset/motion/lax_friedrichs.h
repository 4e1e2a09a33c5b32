#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "levelset/grid/layers.h"
#include "levelset/grid/leaf_stage.h"
#include "levelset/grid/scheme.h"
#include "levelset/motion/speed_field.h"

namespace scarp {

/// FreeFoot for a leaf: phi has a halo of one node. Null where there is none.
struct FreeLeaf {
  const Block* phi = nullptr;
  const float* most = nullptr;
};

/// An Euler step of phi_t = -V(x, n) |grad phi| for the nodes of a leaf, by the local
/// Lax-Friedrichs scheme: V at the node's own normal, and along every axis a dissipation with the
/// largest |d(V |grad phi|) / d phi_axis| that is met between the differences to the neighbours.
///
/// For one beam and a linear response this is the upwind scheme, without dissipation across the
/// beam. Where V depends on the angle to the vertical alone, as under beams from straight above,
/// two slopes count, along and across the vertical, whatever the direction across. There is
/// dissipation only where V |grad phi| turns between the differences; elsewhere Godunov's scheme
/// takes the one from which information comes.
///
/// Within three nodes of what does not move the differences are of first order: there phi
/// has an edge that is no edge of the surface that moves, and a wrong normal undercuts a mask.
///
/// Planes at cusps of the rates of a crystal stay while the rounded tip of a pit or a hill between
/// them moves fast. Where the jumps between neighbours hold the tip back more than those of WENO5
/// the dissipation takes the mean of the two: with WENO5 alone a pit sinks, with the others alone
/// its tip is blunt by two spacings.
///
/// Where something grows beside what does not move, differences to nodes that do not move count as
/// those on the other side, so that a film that meets a mask knows its own normal alone. Such nodes
/// move by their speed as distances do: the film passes over them, see overgrow().
///
/// Where beams alone etch from above, by the cosine, V |grad phi| is linear: between a floor and a
/// wall there is no fan of slopes, and creases of phi are shifted down as they are. With isotropic
/// speeds, or yields that fall off or rise at a slant, they have to become round, see docs.
///
/// mobility is zero at nodes that do not move, with a halo of three nodes. scheme is first_order or
/// weno5. shifted is kept from stage to stage: 512 values where is_etched_by_beam, else null.
/// Source: Crandall and Lions 1984; Osher and Shu 1991 (local variant, and upwind where nothing
/// turns); Toifl et al. 2019 (bounds over the stencil for rates that depend on the orientation);
/// Harten 1989 (subcell resolution, for creases).
void move_lax_friedrichs(const LeafStage& leaf, const Block& mobility, Scheme scheme,
                         const SpeedField& field, std::size_t leaf_index, const FreeLeaf& free = {},
                         float* shifted = nullptr);

/// Whether all speeds that depend on the normal do so by the cosine to the vertical.
bool is_etched_by_beam(const SpeedField& field);

/// Books what the dissipation has raised as what was seen there.
///
/// The scheme fills the tips of grooves by a part of a spacing in a time step although V etches
/// them, and only the top rises. That is no film: layers that were the top at a node stay it.
///
/// Shape: before has phi of the top before the time step, 512 values per leaf of its band, whose
///        leaves are still the same.
void book_rise(Layers& layers, const SpeedField& field, std::span<const float> before);

/// Zero where V is zero whatever the normal, positive elsewhere, also outside the band. Where
/// something grows beside what does not move the part of V that does not depend on the normal does
/// not count.
///
/// Shape: 512 values per leaf.
std::vector<float> mobilities(const Band& band, const SpeedField& field);

}  // namespace scarp

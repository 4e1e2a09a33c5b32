#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace scarp {

/// Nodes of a lattice that conduct to their neighbours, and to the ground.
///
/// Shape: one entry per node. Neighbours lie along -x, +x, -y, +y, -z, +z, none where the number is
///        no_node; conductances are those to them, the same seen from either side.
struct ConductionNetwork {
  static constexpr std::uint32_t no_node = UINT32_MAX;

  std::vector<std::array<int, 3>> place;  ///< on the lattice, >= 0
  std::vector<std::array<std::uint32_t, 6>> neighbour;
  std::vector<std::array<double, 6>> conductance;
  std::vector<double> ground;

  std::size_t size() const { return place.size(); }
};

/// The potential of every node: sum over neighbours of conductance (potential - theirs) + ground
/// potential = source.
///
/// Conjugate gradients, each prepared by a cycle through coarser lattices, from the given potential
/// on, until no node by itself wants to change by more than 1e-12 of the largest potential. Every
/// node has to be joined to one with a ground. The result does not depend on the number of threads.
///
/// Throws: NumericalError when rounding errors keep it from getting there.
/// Cost:   about 20 iterations whatever the size, a microsecond per node each.
/// Source: Hestenes and Stiefel 1952; Brandt 1977.
void solve_conduction(const ConductionNetwork& network, const std::vector<double>& source,
                      std::vector<double>& potential);

}  // namespace scarp

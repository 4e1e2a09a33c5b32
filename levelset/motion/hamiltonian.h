#pragma once

#include <array>
#include <cstddef>

#include "levelset/grid/band.h"
#include "levelset/motion/speed_field.h"

namespace scarp {

/// A number at each node of a row.
using RowValues = std::array<float, leaf_edge>;

/// A vector at each node of a row, by axis.
using RowVectors = std::array<RowValues, 3>;

/// V |grad phi| at the nodes of a row, and its derivatives by grad phi.
struct Hamiltonian {
  RowValues value{};
  RowVectors slope{};
};

/// Whether V is 0 at all nodes of a row whatever the normal. first is its first node.
bool has_no_speed(const SpeedField& field, std::size_t first);

/// The sum over the isotropic part and all angular parts of a field, for the row whose first node
/// is first, at grad phi = p. Every part gives the bits of AngularFactor::rate.
Hamiltonian hamiltonian(const SpeedField& field, std::size_t first, const RowVectors& p);

}  // namespace scarp

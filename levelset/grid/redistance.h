#pragma once

#include <cstdint>
#include <span>

#include "levelset/grid/scheme.h"

namespace scarp {

class Band;

/// Makes phi a distance again after it was moved, and moves the band along.
///
/// Nodes next to the surface (a neighbour along an axis has the other sign) keep their phi, so the
/// surface does not drift: not one bit of these nodes changes. The others take a few steps of the
/// Hamilton-Jacobi equation of the distance away from them. Signs never change. Reaches one node
/// beyond the old band: the surface may have moved by a spacing at most.
///
/// held: nodes that keep their phi wherever they are, one bit each, 8 words per leaf; may be empty.
///
/// Source: Sussman, Smereka, Osher 1994, with frozen nodes instead of a smeared sign.
void redistance(Band& band, Scheme scheme = Scheme::eno2, std::span<const std::uint64_t> held = {});

/// The same, as often as it takes to find the distance in the whole band anew where it was lost:
/// the edge of the band is seven nodes away along the axes.
void redistance_fully(Band& band);

}  // namespace scarp

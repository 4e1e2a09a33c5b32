#pragma once

#include <cstdint>
#include <vector>

#include "mesh/collapse.h"
#include "mesh/edge_sizes.h"

namespace scarp {

/// Collapses all that the checks allow, in passes over all edges: those that change the surface
/// least go early, but only roughly in their order.
///
/// A pass finds what edges cost whose ends have changed (placement.h, by area), takes the cheapest
/// quarter of all, and goes through it block by block (blocks.h), within a block from cheap to
/// dear. A vertex is merged once in a pass, so the collapses spread over the mesh; an edge that was
/// refused waits until one of its ends has changed. Passes end when they do little.
///
/// Edges between free vertices go through the checks of pass_star.h first. Those at sides, borders
/// and boundaries, also in periodic pairs, go through CollapseChecks alone. Nothing goes that the
/// proven bound does not allow.
///
/// Returns for each vertex the one that it went into last, or itself.
///
/// Cost:   about 2 us of one core per vertex removed; 200 bytes per vertex.
/// Source: the placement and cost are those of Lindstrom and Turk 1998, sec. 4.
std::vector<std::uint32_t> collapse_in_passes(CollapseMesh& mesh, CollapseChecks& checks,
                                              EdgeSizes& sizes);

}  // namespace scarp

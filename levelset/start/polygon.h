#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/frame.h"
#include "levelset/start/region.h"

namespace scarp {

/// A region of the x-y plane between polygons.
///
/// Units: nm.
struct PolygonOutline {
  /// even_odd: a point is inside if an odd number of loops surround it, so a loop within a loop is
  /// a hole. any: inside if any loop surrounds it, whichever way; loops may overlap, touch and
  /// cross themselves. region: loops that neither cross nor overlap, interior on the left.
  enum class Rule { even_odd, any, region };
  std::vector<Loop> loops;
  Rule rule = Rule::even_odd;
  /// Acts on what the domain shows: loops together with their images beyond the sides.
  Sizing sizing{};
  /// Strips along y: what a line through a layout meets. Sections take no other ones.
  bool is_section = false;
};

/// The first thing that is wrong with an even-odd outline: a loop of less than three points, points
/// that coincide, edges that cross, touch or lie on each other. Names loops, points and edges by
/// their numbers from 0; edge 3 goes from point 3 to the next.
std::optional<std::string> polygon_fault(std::span<const Loop> loops);

/// Two walls in the domain that cross, touch at a point that is no common corner, or face each
/// other at less than the given length.
std::optional<std::string> thin_feature(const Frame& frame, std::span<const Loop> loops,
                                        double shortest);

/// The part of an outline in the domain together with its mirror images or copies beyond the sides,
/// as loops that neither cross nor touch except at points, interior on the left. Empty if the
/// outline leaves the domain empty.
///
/// What reaches beyond a periodic side comes back on the other one, however far. Of loops that may
/// overlap, those of a layout, only these do that are in the domain with a part: what lies wholly
/// outside belongs to another cell.
///
/// Images are kept to 24 spacings beyond the sides, and twice the given growth for loops that will
/// be moved by it.
///
/// Points are rounded to 2^-16 spacings, symmetrically about the middle of the domain; so are
/// crossings. Cost: O((n + crossings) log n) for edges that are spread out.
/// Source: Vatti 1992, as the Clipper library has it.
std::vector<Loop> domain_loops(const Frame& frame, const PolygonOutline& outline,
                               double growth = 0);

/// What the sizing of an outline leaves nothing of, in the domain.
SizingLosses sizing_losses(const Frame& frame, const PolygonOutline& outline);

/// That on which outlines are combined.
RegionGrid region_grid(const Frame& frame);

}  // namespace scarp

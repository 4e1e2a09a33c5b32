#pragma once

#include <cstddef>
#include <span>

#include "core/region_mesh.h"
#include "core/tri_mesh.h"

namespace scarp {

/// Units: nm.
struct RemeshOptions {
  double spacing = 0;  ///< of the grid from which the mesh is
  double size = 0;     ///< edges are made this long where the surface allows; at least the spacing
  /// From any place of an interface to the surface of its layer.
  double max_distance = 0;
};

/// Facets with less than this part of their target size as least altitude are thin: see SizeField.
inline constexpr double thin_part = 0.1;

/// To remove what is still thin at the end, interfaces may be this far from their surfaces, in
/// spacings.
inline constexpr double largest_repair = 0.25;

/// Makes the facets of a region mesh well shaped, without any change to what touches what.
///
/// Edges collapse and flip, and vertices move, only if afterwards no facet is turned over, crosses
/// another one or is nearer to it than a fiftieth of the spacing, none is thinner than before or
/// than a tenth of its target size, and each interface stays within max_distance of the surface of
/// its layer, or as near as it was. Vertices on sides of the domain stay on them, those of lines
/// where bodies meet on these, corners stay. Where the surface of a layer has an edge or a corner,
/// vertices move there and edges along it.
///
/// Opposite periodic sides that have the same facets keep that: what happens to a vertex there
/// happens to its image.
///
/// Shape:  surfaces has one mesh for each layer; empty ones have no interface.
/// Cost:   about 50 us per facet. One thread.
/// Source: the conditions under which a collapse leaves the topology alone: Dey, Edelsbrunner,
///         Guha and Nekhayev 1999; vertices at edges: the least squares of Garland and Heckbert
///         1997.
RegionMesh remesh(const RegionMesh& mesh, std::span<const TriMesh> surfaces,
                  const RemeshOptions& options);

/// How good a mesh is.
struct RegionQuality {
  double least_altitude = 0;           ///< in nm
  double least_relative_altitude = 0;  ///< in parts of the target size of the facet
  std::size_t thin_facets = 0;
  double max_distance = 0;  ///< from interfaces to the surfaces of their layers, in nm
  /// Likewise, of places a spacing or more away from detail: see SizeField.
  double max_plain_distance = 0;
  double reverse_max_distance = 0;  ///< from vertices of the surfaces to interfaces, in nm
};

/// Distances are measured from vertices and from places in facets and on edges, as dense as the
/// grid.
///
/// @param size of facets on flat surfaces, as for remesh()
RegionQuality quality(const RegionMesh& mesh, std::span<const TriMesh> surfaces, double spacing,
                      double size);

}  // namespace scarp

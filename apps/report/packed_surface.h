#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/tri_mesh.h"
#include "mesh/files/mesh_file.h"

namespace scarp {

// Surfaces in few bytes, for pages that carry them; apps/viewer/src/unpack.js reads them.

/// The range that 8 bits stand for: code c of 0..254 is low + c (high - low) / 254, 255 no number.
struct PackedField {
  std::string name;
  double low = 0;
  double high = 0;
};

/// A surface with a byte per facet and field.
///
/// Shape: bytes are a zlib stream of, one after the other: for x, y and z of all vertices the high
///        and then the low bytes of their steps from vertex to vertex, as 16-bit numbers within the
///        box; the corners of the triangles as varints (LEB128), the first as a step from the first
///        of the triangle before, the others from the one before them; each field. Steps are
///        written as 0, -1, 1, -2, ... -> 0, 1, 2, 3, ...
/// Units: as the mesh.
struct PackedSurface {
  std::array<float, 3> lower{};
  std::array<float, 3> upper{};
  std::size_t vertex_count = 0;
  std::size_t facet_count = 0;
  std::vector<PackedField> fields;
  std::string bytes;

  /// How far a coordinate may be from that of the mesh.
  double error() const;
};

/// The numbers of materials, whose name is that of the field; packed as they are.
inline constexpr const char* material_field = "material";

/// Values further out than those of 99 % of the facets, half a per cent on either side, are packed
/// as the last of these: a single facet does not take the colours from all others.
///
/// Shape:  one value per facet in each field; numbers of materials up to 254.
/// Throws: NumericalError if the mesh has no triangle.
PackedSurface pack(const TriMesh& mesh, const std::vector<FacetArray>& fields);

}  // namespace scarp

#pragma once

#include "mesh/files/region_file.h"

namespace scarp {

/// The regions of a mesh in space, filled with tetrahedra by tetgen, or by gmsh if tetgen is
/// missing. Both are run as programs. The facets of the mesh stay as they are.
///
/// Throws: InputError if neither program is installed, NumericalError if it fails.
NamedMesh filled_by_program(const RegionMesh& mesh);

}  // namespace scarp

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"

namespace scarp {

/// Which collapse goes first, and how fine the mesh stays where.
enum class SimplifyMethod { paper, lindstrom_turk, length };

/// Units: lengths as in the mesh.
struct SimplifyOptions {
  SimplifyMethod method = SimplifyMethod::paper;
  Sides sides;                      ///< vertices on these planes stay on them; periodic sides stay congruent
  double l0 = 0;                    ///< shortest edge wanted in feature regions
  double step_length = 0;           ///< growth of the edge length from one transition region to the next
  double l_max = 0;                 ///< longest edge wanted in flat regions; 0: no limit
  double curvature_threshold = 0;   ///< 0: from the noise of the mesh
  std::optional<double> max_error;  ///< hard bound on the distance to the input
  std::optional<double> remove;     ///< fraction of the vertices to remove, in [0, 1)
  std::optional<std::size_t> vertices;  ///< number of vertices to keep
};

struct SimplifyResult {
  TriMesh mesh;
  double max_distance = 0;          ///< from the input's vertices to the result, as tracked
  double reverse_max_distance = 0;  ///< from the result to the input
  std::string stopped_by;           ///< "vertices", "max_error", "sizes" or "nothing_left"
};

SimplifyResult simplify(const TriMesh& mesh, const SimplifyOptions& options);

}  // namespace scarp

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/simulator/recipe.h"
#include "levelset/metrology/metrology.h"

namespace scarp {

// Metrology as text: lengths in nm, angles in degrees, names as docs/metrology.md has them.

/// The names of materials and the heights at which widths were wanted.
struct MetrologyNames {
  const Materials& materials;
  const MetrologyOptions& options;
};

/// What a tolerance of a value goes by.
enum class ValueKind {
  width_or_depth,
  film,      ///< a thickness
  coverage,  ///< a ratio of thicknesses
  height,    ///< of the surface, wherever it is highest or lowest
  volume,    ///< of a material
  other
};

/// A value of metrology by a name that says what it belongs to: "trench 1 depth_nm", "hole 2 across
/// x bottom_cd_nm", "trench 1 SiO2_top_nm", "highest_nm".
struct MetrologyValue {
  std::string name;
  ValueKind kind = ValueKind::other;
  double value = 0;
  /// How much it changes with a nm of thickness: of coverages 1 by the top, of volumes the area.
  double per_nm = 1;
  double grid_error = 0;         ///< a bound, where one is known
  std::optional<int> opening{};  ///< whose it is
};

/// All values that are there.
std::vector<MetrologyValue> metrology_values(const Metrology& metrology,
                                             const MetrologyNames& names);

/// One member per quantity; null for what is not there.
nlohmann::ordered_json metrology_json(const Metrology& metrology, const MetrologyNames& names);

/// A table with a column per opening, and lists of voids and volumes; what no opening has is left
/// out.
std::string metrology_table(const Metrology& metrology, const MetrologyNames& names);

/// What the columns of metrology.csv depend on.
struct MetrologyColumns {
  const Materials& materials;
  std::vector<double> cd_heights;
  std::vector<double> angle_heights;
  std::vector<MaterialId> films;      ///< that may lie on something
  std::vector<MaterialId> occurring;  ///< in the wafer at any time
};

/// The materials that may lie on something: all but the one at the bottom, unless it is deposited.
std::vector<MaterialId> film_materials(std::span<const ProcessStep> steps,
                                       std::span<const MaterialId> occurring);

/// The first line of metrology.csv.
std::string metrology_head(const MetrologyColumns& columns);

/// The lines of one output: a line for each opening, in each direction in which it is cut, at least
/// one.
std::string metrology_rows(std::size_t output, double time, const Metrology& metrology,
                           const MetrologyColumns& columns);

}  // namespace scarp

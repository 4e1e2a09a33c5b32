#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "apps/recipe.h"
#include "levelset/metrology.h"

namespace scarp {

// Metrology as text: lengths in nm, angles in degrees, names as docs/metrology.md has them.

/// The names of materials and the heights at which widths were wanted.
struct MetrologyNames {
  const Materials& materials;
  const MetrologyOptions& options;
};

/// One member per quantity; null for what is not there.
nlohmann::ordered_json metrology_json(const Metrology& metrology, const MetrologyNames& names);

/// A table with a column per opening, and lists of voids and volumes; what no opening has is left
/// out.
std::string metrology_table(const Metrology& metrology, const MetrologyNames& names);

/// The first line of metrology.csv: it depends on the materials that occur in the recipe.
std::string metrology_head(const Recipe& recipe);

/// The lines of one output: a line for each opening, in each direction in which it is cut, at least
/// one.
std::string metrology_rows(std::size_t output, double time, const Metrology& metrology,
                           const Recipe& recipe);

}  // namespace scarp

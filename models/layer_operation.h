#pragma once

#include <optional>
#include <variant>

#include "core/material.h"

namespace scarp {

// What a step does to the layers at once, without species, speeds and time steps. Units: nm.

/// Takes away all that lies above a plane; one of the three says where the plane is.
struct Planarise {
  std::optional<double> height{};             ///< above the surface of the wafer
  std::optional<double> removal{};            ///< below the highest point
  std::optional<MaterialId> stop_material{};  ///< at the highest point of this material
};

/// A film of the same thickness everywhere, of what the step deposits.
struct ConformalFilm {
  double thickness = 0;
};

using LayerOperation = std::variant<Planarise, ConformalFilm>;

}  // namespace scarp

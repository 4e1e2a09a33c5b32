#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "core/material.h"
#include "levelset/start/shapes.h"

namespace scarp {

// What a step does to the layers at once, without species, speeds and time steps. Units: nm.

/// Takes away all that lies above a plane; one of the three says where the plane is.
struct Planarise {
  std::optional<double> height{};             ///< above the surface of the wafer
  std::optional<double> removal{};            ///< below the highest point
  std::optional<MaterialId> stop_material{};  ///< at the highest point of this material
};

/// A film of the same thickness everywhere, or where some materials are exposed, of what the step
/// deposits.
struct ConformalFilm {
  double thickness = 0;
  std::vector<MaterialId> on{};  ///< empty: all
};

/// Fills gas up to a plane with what the step deposits; one of the two says where the plane is.
struct Fill {
  std::optional<double> height{};  ///< above the surface of the wafer
  std::optional<double> above{};   ///< the highest point
  std::optional<double> narrower_than{};
  std::vector<MaterialId> on{};  ///< where one of these lies straight below; empty: all
};

/// A mask on what is there: flat on top, filling what lies below, or a film of one thickness.
struct MaskFilm {
  MaskShape shape{};
  bool planar = true;
};

/// Takes a material away: all that gas reaches, or all there is.
struct Strip {
  MaterialId material = 0;
  bool buried = false;
};

using LayerOperation = std::variant<Planarise, ConformalFilm, Fill, MaskFilm, Strip>;

}  // namespace scarp

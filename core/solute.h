#pragma once

#include <algorithm>
#include <string>

namespace scarp {

/// A substance in a bath that is at rest on the wafer and stirred beyond a layer: it spreads by
/// diffusion between the surface and the stirred bath.
///
/// Units: nm, s; concentrations relative to saturation.
struct Solute {
  std::string name{};
  double diffusivity = 1;
  double layer = 0;  ///< thickness of the layer at rest above the highest point of the surface
  double bath = 0;   ///< concentration of the stirred bath
};

/// What a surface gives to the bath: release - uptake * max(0, c - 1) at the concentration c.
///
/// Units: nm/s, times the concentration of saturation a flux.
struct Exchange {
  double release = 0;
  double uptake = 0;
};

/// The concentration at an open flat wafer, below a layer through which goes what it gives.
inline double open_wafer_concentration(const Solute& solute, const Exchange& wafer) {
  const double conductance = solute.diffusivity / solute.layer;
  const double below_saturation = solute.bath + wafer.release / conductance;
  if (below_saturation <= 1) return below_saturation;
  return (conductance * solute.bath + wafer.release + wafer.uptake) / (conductance + wafer.uptake);
}

}  // namespace scarp

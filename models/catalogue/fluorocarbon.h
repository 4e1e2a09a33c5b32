#pragma once

#include <string>
#include <utility>
#include <vector>

#include "models/model_description.h"
#include "models/plasma_ions.h"

namespace scarp {

/// Etching of oxide, nitride and silicon by ions and fluorocarbon radicals, one kind that etches
/// and one that grows a polymer where ions do not take it off.
///
/// With arrivals of radicals J F, and R the flux of ions times their yield:
///
///     phi_pe = J_e F_e s_pe / (J_e F_e s_pe + R_p)
///     phi_p  = J_p F_p s_p / (R_p phi_pe + delta)
///     phi_e  = J_e F_e s_e (1 - phi_p) / (k_ie R_ie + k_ev J_ev + J_e F_e s_e), 0 if phi_p >= 1
///
/// v = (J_p F_p s_p - R_p phi_pe) / rho_p where phi_p >= 1, and where it is negative on polymer; on
/// what is etched v = -(J_ev phi_e + R_ie phi_e + R_sp (1 - phi_e)) / rho, on others -R_sp / rho.
///
/// Parameters, limits and source are in the description: `scarp models fluorocarbon`.
class Fluorocarbon final : public SurfaceModel, public BalancedCoverages {
 public:
  /// Units: density in 1e22 cm^-3, evaporation in 1e15 cm^-2 s^-1.
  struct Surface {
    double density = 1;
    double etchant_sticking = 1;  ///< s_e; of polymer s_pe
    double polymer_sticking = 1;  ///< s_p
    double evaporation = 0;       ///< J_ev
    int enhanced_yield = -1;      ///< among the tallies of ions; -1: it is not etched
    int sputter_yield = -1;       ///< -1: not reached
  };
  /// Shape: surfaces has one entry per material; species are the etchant, the former of polymer,
  /// and ions with the same yields each, first that of removing polymer. Units: 1e15 cm^-2 s^-1.
  struct Values {
    std::vector<Species> species;
    double etchant_flux = 0;
    double polymer_flux = 0;
    PlasmaIons ions;
    MaterialId polymer = 0;
    std::vector<Surface> surfaces;
  };
  explicit Fluorocarbon(Values values)
      : SurfaceModel(values.species, {.balance = this}), values_(std::move(values)) {}

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;
  std::vector<std::string> coverage_names() const override;
  std::vector<std::vector<float>> steady_coverages(
      const SurfacePoints& points, std::span<const std::span<const float>> flux) const override;
  std::vector<std::vector<float>> covered_sticking(
      const SurfacePoints& points, std::span<const std::vector<float>> coverages) const override;

 private:
  /// What is at a point: parts of sites, and polymer that arrives and goes.
  struct Site {
    double etchant = 0;      ///< phi_e
    double polymer = 0;      ///< phi_p, which may be above 1
    double on_polymer = 0;   ///< phi_pe
    double net_polymer = 0;  ///< in 1e15 cm^-2 s^-1
  };
  Site site_at(MaterialId material, std::span<const std::span<const float>> flux,
               std::size_t point) const;

  Values values_;
};

ModelDescription fluorocarbon_description();

}  // namespace scarp

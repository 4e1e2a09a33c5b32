#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "models/model_description.h"
#include "models/plasma_ions.h"

namespace scarp {

/// Etching of silicon by ions and an etchant whose work a second gas may hinder, each of the two on
/// a part of the sites of the surface: the chemistry of SF6/O2, HBr/O2 and the etch between two
/// films of C4F8.
///
/// Coverages are those of the steady state: as much is adsorbed on bare sites as leaves.
///
///     g_E J_E F_E (1 - theta_E - theta_P) = (k + 2 R_ie) theta_E
///     g_P J_P F_P (1 - theta_E - theta_P) = (b + R_p) theta_P
///
/// On a material that is etched v = -(k theta_E / 4 + R_sp + theta_E R_ie) / rho, on others v =
/// -R_sp / rho. What does not find a bare site is re-emitted: the sticking is g (1 - theta_E -
/// theta_P).
///
/// F are arrivals relative to an open flat wafer, R arrivals of ions times their yield and flux.
/// Where nothing arrives of one gas its coverage is 0; where nothing leaves, the sites are shared
/// as the gases arrive. Without a second gas there is no theta_P.
///
/// Parameters, limits and source are in the descriptions: `scarp models sf6_o2`, `hbr_o2`,
/// `sf6_c4f8`.
class PlasmaEtch final : public SurfaceModel, public BalancedCoverages {
 public:
  /// How a material takes part. Units: density in 1e22 cm^-3.
  struct Surface {
    float etchant_sticking = 1;  ///< of a bare surface
    float passivation_sticking = 1;
    double density = 1;
    bool is_etched = false;
    int sputter_yield = -1;  ///< among the yields of ions; -1: none
  };
  /// Shape: surfaces has one entry per material; species are the etchant, the passivation if there
  /// is any, and ions with the same yields each: of ion-enhanced etching, of the removal of
  /// passivation if there is any, and of sputtering. Units: fluxes and desorption in 1e15 cm^-2
  /// s^-1.
  struct Values {
    std::vector<Species> species;
    bool has_passivation = true;
    double etchant_flux = 0;
    double passivation_flux = 0;
    PlasmaIons ions;
    double etchant_desorption = 0;      ///< k
    double passivation_desorption = 0;  ///< b
    bool sticking_in_balance = true;    ///< false: g is 1 in the balance
    std::vector<Surface> surfaces;
  };
  explicit PlasmaEtch(Values values)
      : SurfaceModel(values.species, {.balance = this}), values_(std::move(values)) {}

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;
  std::vector<std::string> coverage_names() const override;
  std::vector<std::vector<float>> steady_coverages(
      const SurfacePoints& points, std::span<const std::span<const float>> flux) const override;
  std::vector<std::vector<float>> covered_sticking(
      const SurfacePoints& points, std::span<const std::vector<float>> coverages) const override;

 private:
  struct Coverage {
    double etchant = 0;
    double passivation = 0;
  };
  std::size_t gas_count() const { return values_.has_passivation ? 2 : 1; }
  Coverage coverage_at(const Surface& surface, std::span<const std::span<const float>> flux,
                       std::size_t point) const;

  Values values_;
};

/// What models of this chemistry differ by: their names, and defaults as a recipe writes them.
/// Without a name of the passivation there is none, nor has a recipe keys for it.
struct PlasmaChemistry {
  std::string_view name;
  std::string_view summary;
  std::string_view equations_source;
  std::string_view etchant;
  std::string_view passivation{};
  std::string_view etchant_sticking;
  std::string_view passivation_sticking{};
  std::string_view sputter_amplitude;
  std::string_view sputter_threshold;
  std::string_view sputter_factor = "9.3";
  std::string_view enhanced_amplitude;
  std::string_view values_source;
};

std::vector<Parameter> plasma_etch_parameters(const PlasmaChemistry& chemistry);

StepModel read_plasma_etch(const RecipeTable& step, const StepScope& scope,
                           const PlasmaChemistry& chemistry);

/// The page of a chemistry, without its reader.
ModelDescription plasma_etch_page(const PlasmaChemistry& chemistry,
                                  std::span<const Parameter> parameters);

template <const PlasmaChemistry& chemistry>
ModelDescription plasma_etch_description() {
  static const std::vector<Parameter> parameters = plasma_etch_parameters(chemistry);
  ModelDescription description = plasma_etch_page(chemistry, parameters);
  description.read = [](const RecipeTable& step, const StepScope& scope) {
    return read_plasma_etch(step, scope, chemistry);
  };
  return description;
}

}  // namespace scarp

#pragma once

#include <array>
#include <span>
#include <utility>
#include <vector>

#include "models/model_description.h"
#include "models/plasma_ions.h"

namespace scarp {

/// Silicon and silicon-germanium in CF4/O2: fluorine etches, oxygen and carbon cover sites, and on
/// silicon-germanium fluorine takes the oxygen off, so that it is etched far faster.
///
///     J_F F_F b = (k_x + 2 R_ie) theta_F
///     J_O F_O b = (b_s + R_O + [x > 0] J_F F_F) theta_O
///     J_C F_C b = (R_C + J_O F_O) theta_C,  b = 1 - theta_F - theta_O - theta_C
///     v = -(k theta_F / 4 + R_sp + theta_F R_ie) / rho
///
/// k_x = k exp(0.4675 x) for the part x of germanium. On silicon k = k_0; on silicon-germanium k =
/// k_1 where theta_O > theta_F / 2, (theta_F - theta_O) k_x + theta_O k_1 elsewhere.
///
/// Stickings: of F g_F b + g_FO theta_O, of O g_O b + g_OC theta_C, of C g_C b + g_CO theta_O. What
/// is not etched is sputtered only.
///
/// F are arrivals relative to an open flat wafer, R arrivals of ions times their yield and flux.
/// Where nothing arrives of a gas its coverage is 0; where nothing leaves of one it covers all, of
/// several they share as they arrive.
///
/// Parameters, limits and source are in the description: `scarp models cf4_o2`.
class Cf4O2 final : public SurfaceModel, public BalancedCoverages {
 public:
  enum Gas : std::size_t { fluorine, oxygen, carbon, gas_count };  // species, tally, coverage

  /// How a material takes part. Units: density in 1e22 cm^-3. Yields are tallies of the ions, 0:
  /// none.
  struct Surface {
    std::array<double, gas_count> sticking{1, 1, 1};  ///< g_F, g_O, g_C: of a bare surface
    double germanium = 0;                             ///< x
    double density = 1;
    bool is_etched = false;
    std::size_t sputter_yield = 0;
    std::size_t enhanced_yield = 0;
  };
  /// Shape: surfaces has one entry per material; species are F, O and C, and ions. Units: fluxes in
  /// 1e15 cm^-2 s^-1.
  struct Values {
    std::vector<Species> species{};
    std::array<double, gas_count> flux{};  ///< J_F, J_O, J_C
    PlasmaIons ions{};
    std::size_t oxygen_yield = 0;  ///< the tally of R_O; 0: no ions
    std::size_t carbon_yield = 0;
    double fluorine_desorption = 0;  ///< k
    double oxygen_desorption = 0;    ///< b_s
    double oxidised_sticking = 0;    ///< g_FO: of F on O
    double passivated_sticking = 0;  ///< g_OC: of O on C
    double carbon_sticking = 0;      ///< g_CO: of C on O
    bool sticking_in_balance = false;
    std::vector<Surface> surfaces{};
  };
  explicit Cf4O2(Values values)
      : SurfaceModel(values.species, {.balance = this}), values_(std::move(values)) {}

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;
  std::vector<std::string> coverage_names() const override { return {"F", "O", "C"}; }
  std::vector<std::vector<float>> steady_coverages(
      const SurfacePoints& points, std::span<const std::span<const float>> flux) const override;
  std::vector<std::vector<float>> covered_sticking(
      const SurfacePoints& points, std::span<const std::vector<float>> coverages) const override;

 private:
  using Coverage = std::array<double, gas_count>;
  Coverage coverage_at(const Surface& surface, std::span<const std::span<const float>> flux,
                       std::size_t point) const;
  double ions_of(std::size_t yield, std::span<const std::span<const float>> flux,
                 std::size_t point) const;
  double desorption(const Surface& surface, const Coverage& theta) const;

  Values values_;
};

ModelDescription cf4_o2_description();

}  // namespace scarp

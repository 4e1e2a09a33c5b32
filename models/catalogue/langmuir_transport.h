#pragma once

#include <utility>
#include <vector>

#include "models/model_description.h"

namespace scarp {

/// Etching by a neutral that adsorbs, desorbs and reacts: transport down a contact hole to a front
/// that takes up what it can.
///
///     s J F (1 - theta) = (J_d + J_r) theta,  v = -J_r theta / (n rho)
///
/// F is what arrives relative to an open flat wafer, first arrivals, what is re-emitted and what
/// has desorbed together. In the balance as much of what adsorbs desorbs again, by the cosine law
/// as what is re-emitted, as J_d is of J_d + J_r: the sticking is that of what stays,
/// s (1 - theta) J_r / (J_d + J_r), and where nothing reacts it is 0. So no particle is lost or
/// counted twice.
///
/// Parameters, limits and source are in the description: `scarp models langmuir_transport`.
class LangmuirTransport final : public SurfaceModel, public BalancedCoverages {
 public:
  /// How a material takes part. Units: density in 1e22 cm^-3, fluxes in 1e15 cm^-2 s^-1.
  struct Surface {
    double sticking = 1;    ///< s, of a bare surface
    double desorption = 0;  ///< J_d
    double reaction = 0;    ///< J_r
    double density = 1;     ///< rho
  };
  /// Shape: surfaces has one entry per material.
  struct Values {
    SourceLobe source{};
    double flux = 0;                ///< J
    double molecules_per_atom = 1;  ///< n
    std::vector<Surface> surfaces{};
  };
  explicit LangmuirTransport(Values values);

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;
  std::vector<std::string> coverage_names() const override { return {"etchant"}; }
  std::vector<std::vector<float>> steady_coverages(
      const SurfacePoints& points, std::span<const std::span<const float>> flux) const override;
  std::vector<std::vector<float>> covered_sticking(
      const SurfacePoints& points, std::span<const std::vector<float>> coverages) const override;

 private:
  double coverage(const Surface& surface, float flux) const;

  Values values_;
};

ModelDescription langmuir_transport_description();

}  // namespace scarp

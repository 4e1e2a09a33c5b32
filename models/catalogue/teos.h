#pragma once

#include <utility>
#include <vector>

#include "models/model_description.h"

namespace scarp {

/// Growth by particles that each add a power of what arrives of them: CVD from TEOS.
///
///     v = sum over precursors of R F^m
///
/// Where the order m of a neutral is not 1 its sticking follows the part of the surface that it
/// covers, theta = min(F, 1): as growth takes up R F^m of R F that arrive, s_eff = s theta^(m - 1).
///
/// Parameters, limits and source are in the descriptions: `scarp models teos`, `pecvd_teos`.
class Teos final : public SurfaceModel, public BalancedCoverages {
 public:
  struct Precursor {
    Species species;
    double rate = 0;   ///< R, in nm/s
    double order = 1;  ///< m
  };
  explicit Teos(std::vector<Precursor> precursors);

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;
  std::vector<std::string> coverage_names() const override;
  std::vector<std::vector<float>> steady_coverages(
      const SurfacePoints& points, std::span<const std::span<const float>> flux) const override;
  std::vector<std::vector<float>> covered_sticking(
      const SurfacePoints& points, std::span<const std::vector<float>> coverages) const override;

 private:
  std::vector<Precursor> precursors_;
  std::vector<std::size_t> covering_;  // those whose sticking follows what they cover
};

/// Rows that say how much a precursor adds: "precursor.growth_rate", "precursor.order".
Parameter precursor_rate_parameter(std::string_view name, std::string_view meaning);
Parameter precursor_order_parameter(std::string_view name);

ModelDescription teos_description();

}  // namespace scarp

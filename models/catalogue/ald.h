#pragma once

#include <utility>
#include <vector>

#include "models/model_description.h"

namespace scarp {

/// Atomic layer deposition: cycles of a pulse in which a precursor covers the surface, and a purge
/// in which some of it desorbs. What is left grows a part of a layer when the second reactant turns
/// it into film, and the next cycle finds a bare surface again.
///
///     pulse:  s0 d(theta)/dt = g J (F + F_d) (1 - theta) - J_d theta
///     purge:  s0 d(theta)/dt = g J F_d (1 - theta) - J_d theta
///     v = GPC theta / (pulse + purge)
///
/// F is what arrives of the precursor relative to an open flat wafer, F_d what arrives of molecules
/// that have desorbed, relative to the same J: they leave by the cosine law with the flux J_d
/// theta. Both stick with probability g (1 - theta), or are re-emitted. While fluxes stay as they
/// are theta goes to its balance exponentially, which is taken exactly.
///
/// Parameters, limits and source are in the description: `scarp models ald`.
class Ald final : public SurfaceModel, public CycledCoverages, public Emitter {
 public:
  /// Shape: sticking has one entry per material. Units: nm, s, 1e15 cm^-2, 1e15 cm^-2 s^-1.
  struct Values {
    SourceLobe source{};
    std::vector<float> sticking{};  ///< g
    double flux = 0;                ///< J
    double desorption = 0;          ///< J_d
    double sites = 1;               ///< s0
    double growth_per_cycle = 0;    ///< GPC
    double pulse = 0;
    double purge = 0;
    double longest_time_step = 0;
  };
  explicit Ald(Values values);

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;
  std::vector<std::vector<float>> emission(
      const SurfacePoints& points, std::span<const std::span<const float>> flux) const override;
  std::vector<std::string> coverage_names() const override { return {"precursor"}; }
  std::vector<double> phases() const override;
  std::vector<std::vector<float>> coverages_after(
      double seconds, std::size_t phase, const SurfacePoints& points,
      std::span<const std::span<const float>> flux) const override;
  std::vector<std::vector<float>> covered_sticking(
      const SurfacePoints& points, std::span<const std::vector<float>> coverages) const override;
  double longest_time_step() const override { return values_.longest_time_step; }

 private:
  bool desorbs() const { return values_.desorption > 0; }

  Values values_;
};

ModelDescription ald_description();

}  // namespace scarp

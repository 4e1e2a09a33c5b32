#pragma once

#include <vector>

#include "apps/simulator/coverages.h"

namespace scarp {

/// Carries coverages and fluxes through the phases of a cycle together, on one mesh.
///
/// In each step the model takes the flux as constant and the change of coverages is its own, so
/// they stay within their bounds however long the step. The flux of a step is first foretold from
/// the steps before; solved at the coverages that it leads to, it corrects the mean of the step:
/// second order for one solution of the flux per step. What the two differ by tells the error of a
/// step, and so how long steps may be.
///
/// Whenever solve_flux asks again with more rays the cycle begins anew.
///
/// Source: Gear 1971 (predictor and corrector with steps by their difference).
class CoverageCycle {
 public:
  /// The model and the mesh have to outlive it. Of the options the tolerance is that of a step.
  CoverageCycle(const CycledCoverages& model, const TriMesh& facets,
                const CoverageOptions& options);

  /// For solve_flux; refers to this object.
  StickingFeedback feedback();

  /// Shape: as SurfaceCoverages::values.
  const std::vector<std::vector<float>>& coverages() const { return coverages_; }
  const CoverageFit& fit() const { return fit_; }

 private:
  using Tallies = std::vector<std::vector<float>>;

  bool update(std::span<const std::span<const float>> flux,
              std::vector<std::vector<float>>& sticking);
  void begin();
  void predict();
  bool correct(const Tallies& arrived);
  Tallies mean_flux(const Tallies& arrived, double part) const;
  std::vector<std::vector<float>> after_step(const Tallies& flux) const;
  double least_step() const;

  const CycledCoverages& model_;
  CoverageOptions options_;
  std::span<const MaterialId> materials_;
  std::vector<Vec3f> normals_;
  std::vector<double> phases_;

  enum class Waits { for_call, for_bare_flux, for_step } waits_ = Waits::for_call;
  std::size_t phase_ = 0;
  double left_ = 0;  // of the phase, in s
  double step_ = 0;  // in s
  double wanted_step_ = 0;
  double last_step_ = 0;                       // the one before in this phase; 0 if there is none
  Tallies known_flux_;                         // at start_
  Tallies flux_before_;                        // a step earlier
  std::vector<std::vector<float>> start_;      // of the step
  std::vector<std::vector<float>> coverages_;  // foretold for its end
  int solutions_ = 0;                          // with this number of rays
  CoverageFit fit_;
};

}  // namespace scarp

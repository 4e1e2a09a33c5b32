#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "flux/engines/element_flux.h"
#include "flux/engines/error_draws.h"
#include "flux/engines/flux_draws.h"
#include "flux/engines/half_differences.h"
#include "flux/rays/problem.h"

namespace scarp {

/// How much a bias of single facets counts: their noise is larger than that of patches.
inline constexpr double facet_bias_counts = 1.0 / 3;

/// What the rays of all elements say about one problem: the flux, its noise, what the size of
/// elements leaves uncertain, and the balance of particles.
class Gathered {
 public:
  /// All have to outlive it. number: of the problem among those of the view.
  /// tolerance: as of ElementFlux::solve.
  Gathered(const FluxProblem& problem, std::size_t number, const RayPlan& plan,
           const FacetValues& values, const View& view, double tolerance);

  /// More closely. What was told before stays as it was.
  void solve(double tolerance) { flux_.solve(tolerance); }
  std::vector<float> arrivals() const { return on_facets().of_all(); }
  /// Before the first draw. Shape: the part that every facet passes on, as of Settle::passed_on.
  void pass_on_errors_by(std::span<const float> of_facets);
  /// More draws of the error, up to a number of them.
  void draw(std::size_t count);
  /// What is compared with the target. After the first draw.
  double target_measure() const;
  /// What smaller elements would remove, by facet, as it counts in what is compared with the
  /// target. What normals change on facets does not become less with smaller elements.
  std::vector<float> biases() const;
  /// The same of all together.
  double bias_measure(std::span<const float> biases) const;
  /// By window, what each element's relative error of a single ray squared is, summed up.
  void add_variances(std::span<double> of_windows) const;
  FluxField field() const;

 private:
  std::span<const double> flux() const { return flux_.by_rank(); }
  const FacetFlux& on_facets() const { return flux_.on_facets(); }
  static constexpr std::size_t bias_count = 4;
  FluxSpread bias() const;
  FluxSpread spread() const;
  double measure(const FluxSpread& spread) const;
  double unknown_of_emission(std::size_t facet) const;
  FluxAudit audit() const;
  double balance_error() const;
  bool errors_stick_alike() const { return passed_on_.empty(); }
  // Of which elements pass on errors.
  std::span<const float> error_parts() const {
    return errors_stick_alike() ? flux_.reemitted() : passed_on_;
  }
  // What re-emits and yet has no flux has no error; without sticking, one there would have no end.
  bool is_in_void(std::size_t rank) const {
    return flux_.reemitted()[rank] > 0 && flux()[rank] == 0;
  }
  std::vector<double> weights() const;

  const FluxProblem& problem_;
  const RayPlan& plan_;
  const FacetValues& values_;
  const View& view_;
  ElementFlux flux_;
  std::vector<float> passed_on_;  // of errors; empty where as much as of the flux
  HalfDifferences halves_;
  double unseen_ = 0;
  std::optional<FluxDraws> draws_;
};

}  // namespace scarp

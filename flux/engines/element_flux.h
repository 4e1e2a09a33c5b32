#pragma once

#include <memory>
#include <span>
#include <vector>

#include "flux/engines/exchange.h"
#include "flux/engines/facet_flux.h"
#include "flux/engines/facet_values.h"
#include "flux/engines/radiosity.h"
#include "flux/engines/view.h"
#include "flux/rays/problem.h"
#include "flux/rays/ray_plan.h"

namespace scarp {

/// Means over elements, by rank.
std::vector<float> on_elements(const RayPlan& plan, std::span<const float> of_facets);

/// The flux on the elements of a problem, with the sticking and emission that it had when this was
/// made.
class ElementFlux {
 public:
  /// All have to outlive it. number: of the problem among those of the view.
  ElementFlux(const FluxProblem& problem, std::size_t number, const RayPlan& plan,
              const FacetValues& values, const View& view);

  /// Before all else is asked. As Radiosity::solve.
  void solve(double tolerance, std::span<const double> start = {});
  /// Before Radiosity::flux_of_constants is asked.
  void solve_constants() { radiosity_.solve_constants(); }

  /// By rank.
  std::span<const double> by_rank() const { return radiosity_.flux(); }
  const FacetFlux& on_facets() const { return *on_facets_; }
  const Radiosity& radiosity() const { return radiosity_; }
  const ExchangeSolver& exchange() const { return exchange_; }
  /// Parts of what arrives, by rank.
  std::span<const float> reemitted() const { return reemitted_; }
  /// Of their own, by rank.
  std::span<const double> emission() const { return emission_; }

 private:
  const FluxProblem& problem_;
  std::size_t number_;
  const RayPlan& plan_;
  const FacetValues& values_;
  const View& view_;
  std::vector<float> reemitted_;
  std::vector<double> emission_;
  ExchangeSolver exchange_;
  Radiosity radiosity_;
  std::unique_ptr<const FacetFlux> on_facets_;
};

}  // namespace scarp

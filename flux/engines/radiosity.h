#pragma once

#include <span>
#include <vector>

#include "core/vec3.h"
#include "flux/engines/exchange.h"
#include "flux/engines/facet_values.h"
#include "flux/engines/view.h"
#include "flux/rays/ray_plan.h"

namespace scarp {

/// The flux on elements, each of which sends what it does not keep along a plane: its mean, and the
/// slope that its neighbours say. What it emits of its own it sends evenly.
///
/// With constants in place of planes the flux deep down has a bias of second order in the size of
/// elements, everywhere of one sign. Planes remove it, at the cost of a few more solves from a good
/// start. Elements as fine as the grid are constants.
///
/// Shape: all by rank, as of the plan, the view and the solver.
class Radiosity {
 public:
  /// All but first have to outlive it.
  /// first: what every element sees of the source and of the means that elements emit.
  Radiosity(const RayPlan& plan, const FacetValues& values, const View& view,
            std::span<const float> reemitted, std::span<const double> emission,
            const ExchangeSolver& exchange, std::vector<double> first);

  /// start: a flux to start from, zero where nothing arrives; without one, what was found before.
  /// Throws: as ExchangeSolver::solve.
  void solve(double tolerance, std::span<const double> start = {});
  /// After solve(), which they start from. Throws: as ExchangeSolver::solve.
  void solve_constants();

  /// What hardly sees anything may come out a little below zero.
  const std::vector<double>& flux() const { return flux_; }
  /// The same with constants in place of planes, after solve_constants().
  const std::vector<double>& flux_of_constants() const { return constant_; }
  /// Units: flux per spacing.
  const std::vector<Vec3d>& slopes() const { return slopes_; }
  double leaves(std::size_t rank) const { return reemitted(rank) + emission_[rank]; }

 private:
  double reemitted(std::size_t rank) const {
    return static_cast<double>(reemitted_[rank]) * flux_[rank];
  }
  void solve_planes(double tolerance);
  void flatten(std::span<const double> before, double tolerance);
  void find_slopes();
  std::vector<double> right_side() const;
  std::vector<double> seen_of(std::span<const double> flux) const;

  const RayPlan& plan_;
  const FacetValues& values_;
  const View& view_;
  std::span<const float> reemitted_;
  std::span<const double> emission_;
  const ExchangeSolver& exchange_;
  std::vector<double> first_;
  std::vector<double> flux_;
  std::vector<double> constant_;
  std::vector<Vec3d> slopes_;
  std::vector<float> plane_;  ///< the part of an element's slope that counts: 0 makes it a constant
  bool has_planes_ = false;
};

}  // namespace scarp

#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "flux/engines/error_draws.h"
#include "flux/engines/exchange.h"
#include "flux/rays/ray_plan.h"

namespace scarp {

/// Draws of the error of the flux on all elements: what follows, by the exchange between them, from
/// draws of the errors of what each of them sees.
///
/// In a deep feature nearly all of it is one smooth error, of which eight draws tell the size
/// within a quarter. The sum of all errors, each by how it counts, has a variance that needs no
/// draws: by reciprocity, what an error on one element does to the sum is what the sum's weights,
/// sent off as if they were particles, bring there. All draws are corrected by what is known of
/// their sum.
class FluxDraws {
 public:
  /// How errors go on between elements. solver: that of the rows and of reemitted, if there is one.
  ///
  /// Shape: one reemitted part per rank.
  struct Passing {
    const ExchangeMatrix& matrix;
    const ExchangeRows& rows;
    const ExchangeSolver* solver;
    std::span<const float> reemitted;
  };

  /// Draws that are solved at once: more would fall out of the cache.
  static constexpr std::size_t at_once = 8;

  /// What passing refers to has to outlive the draws.
  /// largest: what any element sees at most, in units of the flux.
  /// Shape: one weight per rank, of its error in the sum, per area; zero where there is no error.
  FluxDraws(const RayPlan& plan, const Passing& passing, ErrorDraws of_equations,
            std::span<const double> weights, double largest);
  ~FluxDraws();

  /// More draws, up to a number of them, a multiple of at_once.
  void draw(std::size_t count);

  std::size_t count() const { return sums_.size(); }
  /// Shape: at rank * draw_count + draw; count() of a rank are drawn.
  std::span<const float> all() const { return corrected_; }
  /// The part of an error of what an element sees that is possible; see limit().
  double possible_part(std::size_t rank, double error) const;

 private:
  double area(std::size_t rank) const { return plan_.elements().area(plan_.element_at(rank)); }
  std::vector<double> effects(std::span<const double> weights) const;
  void limit(std::span<float> errors) const;

  const RayPlan& plan_;
  std::unique_ptr<const ExchangeRows> thinned_;  // if the rows are long
  const ExchangeRows& rows_;
  std::unique_ptr<const ExchangeSolver> own_;  // unless the given one will do
  const ExchangeSolver& exchange_;
  std::span<const float> reemitted_;
  ErrorDraws of_equations_;
  std::vector<float> most_;      // per rank: of an error of its equation
  std::vector<double> counts_;   // per rank: of its error in the sum
  std::vector<double> effects_;  // per rank: of an error of its equation on the sum
  std::vector<float> drawn_;     // at rank * draw_count + draw
  std::vector<float> corrected_;
  std::vector<double> sums_;       // per draw
  std::vector<double> variances_;  // of the sums of all draws, together, by block
  KnownSum known_sum_;
};

}  // namespace scarp

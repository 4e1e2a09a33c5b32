#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "flux/half_differences.h"
#include "flux/ray_plan.h"
#include "flux/solve.h"

namespace scarp {

/// Draws of the error of all elements together.
inline constexpr std::size_t draw_count = 32;

/// The standard deviation of what single rays of each element tell.
///
/// Where few of them meet what counts, that is a matter of chance: the rays of an element are taken
/// together with as many of the usual ones of its window as meet one.
///
/// Shape: by rank.
std::vector<double> usual_scatter(const RayPlan& plan, const RayScatter& scatter);

/// Errors of what the rays of elements found, as half the differences between their two sets tell:
/// each is a fair sample of the error of the mean of both.
///
/// Elements of a block share a sequence of points, so that one has too little of what another has
/// too much of: their errors belong together, while blocks are independent. A draw gives a block
/// the half differences of one nearby, shifted within it and with either sign: a single half
/// difference says little about its element, but those around it are alike. What a block has as a
/// whole stays with it. Elements that lie beside each other may see quite different things, as a
/// floor and the top beside it: half differences are passed on as multiples of what the scatter of
/// their elements' rays makes usual there.
///
/// Half differences of several quantities are drawn alike, and so keep what they have in common.
///
/// Source: Wu 1986 (wild bootstrap), Politis and Romano 1992 (circular block bootstrap).
class ErrorDraws {
 public:
  /// Elements that are left out have no error.
  /// scatter: standard deviations of single rays; none if they are alike everywhere.
  /// Shape: one half difference and one deviation per rank.
  ErrorDraws(const FluxOptions& options, const RayPlan& plan, std::span<const double> halves,
             std::vector<double> scatter, const std::function<bool(std::size_t rank)>& is_left_out);

  /// Some of the draws.
  /// Shape: at rank * count + draw - first.
  std::vector<float> draws(std::size_t first, std::size_t count) const;
  /// The variance of each draw's sum over all elements of their errors times something, over all
  /// signs that the draws may have.
  /// Shape: errors as draws() gives them; one factor per rank.
  std::vector<double> variances_of_sum(std::span<const float> errors,
                                       std::span<const double> factors) const;

 private:
  // The elements of a block together.
  struct Whole {
    double area = 0;
    double sum = 0;       // of errors times areas
    double expected = 0;  // square of that, as usual
    double times_usual() const { return expected > 0 ? sum / std::sqrt(expected) : 0; }
  };
  // What brings the squares of errors that a window passes on to those that it has: what is usual
  // for its elements may be more wrong for some than for others.
  struct Sizes {
    float of_elements = 1;
    double of_wholes = 1;
  };

  double area(std::size_t rank) const { return plan_.elements().area(plan_.element_at(rank)); }
  Sizes sizes(const RayPlan::Window& window) const;
  void draw_in(const RayPlan::Window& window, std::size_t first, std::size_t count,
               std::vector<float>& errors) const;

  const FluxOptions& options_;
  const RayPlan& plan_;
  std::vector<float> usual_;        // by rank: the size of an error; 0: it has none
  std::vector<float> times_usual_;  // by rank: half differences
  std::vector<Whole> wholes_;       // by the first rank of a block
};

/// Draws of the error of a sum, of which the variance is known better than its few draws tell it.
///
/// Takes from draws of any other error, or gives to them, what they have too much or too little of
/// by chance: the part that goes with the sum is scaled so that the sum's draws have its variance.
/// Where one smooth error is most of all errors, few draws then tell its size as well as many.
///
/// Source: linear regression on a control variate of known mean.
class KnownSum {
 public:
  KnownSum() = default;
  /// Shape: the sum's draws.
  KnownSum(std::span<const double> draws, double variance);

  /// Shape: as many draws of another error.
  template <class Number>
  void correct(std::span<Number> draws) const;

 private:
  std::vector<double> along_;  // a unit vector
  double more_ = 0;            // how many times of what goes along it is to be added
};

/// The mean over the elements of a facet, by area, of a quantity given by rank.
template <class Quantity>
double mean_on_facet(const RayPlan& plan, std::size_t facet, const Quantity& quantity) {
  return plan.elements().mean_on_facet(
      facet, [&](std::uint32_t element) { return quantity(plan.rank_of(element)); });
}

/// The same of the first draws of an error.
/// Shape: of_ranks at rank * draw_count + draw.
void mean_draws_on_facet(const RayPlan& plan, std::size_t facet, std::span<const float> of_ranks,
                         std::span<double> draws);

}  // namespace scarp

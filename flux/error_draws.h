#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "flux/ray_plan.h"
#include "flux/solve.h"

namespace scarp {

/// Draws of the error of all elements together.
inline constexpr std::size_t draw_count = 32;

/// Errors of what the rays of elements found, as half the differences between their two sets tell:
/// each is a fair sample of the error of the mean of both.
///
/// Elements of a block share a sequence of points, so that one has too little of what another has
/// too much of: their errors belong together, while blocks are independent. A draw gives a block
/// the half differences of one nearby, shifted within it and with either sign: a single half
/// difference says little about its element, but those around it are alike. What a block has as a
/// whole stays with it.
///
/// Half differences of several quantities are drawn alike, and so keep what they have in common.
///
/// Source: Wu 1986 (wild bootstrap), Politis and Romano 1992 (circular block bootstrap).
class ErrorDraws {
 public:
  /// Elements that are left out have no error.
  /// Shape: one half difference per rank.
  ErrorDraws(const FluxOptions& options, const RayPlan& plan, std::span<const double> halves,
             const std::function<bool(std::size_t rank)>& is_left_out);

  /// Some of the draws.
  /// Shape: at rank * count + draw - first.
  std::vector<float> draws(std::size_t first, std::size_t count) const;
  /// The variance of each draw's sum over all elements of their errors times something, over all
  /// signs that the draws may have.
  /// Shape: errors as draws() gives them; one factor per rank.
  std::vector<double> variances_of_sum(std::span<const float> errors,
                                       std::span<const double> factors) const;

 private:
  // The error of some elements together.
  struct Whole {
    double area = 0;
    double share = 0;  // of rays
    double sum = 0;
    void add(double of_area, double of_share, double error) {
      area += of_area;
      share += of_share;
      sum += of_area * error;
    }
    double mean() const { return sum / area; }
  };

  double area(std::size_t rank) const { return plan_.elements().area(plan_.element_at(rank)); }
  double share(std::size_t rank) const { return plan_.share_of(plan_.element_at(rank)); }
  void draw_in(const RayPlan::Window& window, std::size_t first, std::size_t count,
               std::vector<float>& errors) const;

  const FluxOptions& options_;
  const RayPlan& plan_;
  std::vector<float> scale_;       // by rank: of an error to that of a single ray; 0: left out
  std::vector<float> normalised_;  // by rank: half differences on that scale
  std::vector<Whole> wholes_;      // by the first rank of a block
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

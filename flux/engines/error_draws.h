#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "flux/engines/half_differences.h"
#include "flux/options.h"
#include "flux/rays/ray_plan.h"

namespace scarp {

/// Draws of the error of all elements together.
inline constexpr std::size_t draw_count = 32;

/// A variance, and how many independent squares it is known by.
struct Variance {
  double value = 0;
  double freedom = 0;
};

/// The variance of a sum over blocks, from what every block adds to it if its whole is as large as
/// usual, and the squares of the wholes as multiples of what is usual.
Variance variance_over_blocks(std::span<const double> usual, std::span<const double> times_usual);

/// How large errors of what the rays of elements found are: that of each element, and that of what
/// the elements of a block found together.
///
/// A half difference is one sample of an error: those of the few elements of a floor hardly tell
/// its size. Parts of sets tell more. By how they differ the variance of a whole set is known up to
/// a factor that is alike nearby, and not very different elsewhere: there half differences tell it.
/// It is likewise with the sum over the elements of a block.
///
/// What is stated for one place allows for how little its own error is known.
///
/// Without parts the half differences of a window tell all.
class UsualErrors {
 public:
  /// Keeps all but the last. Elements that are left out have no error.
  UsualErrors(const RayPlan& plan, const Differences& of,
              const std::function<bool(std::size_t rank)>& is_left_out);

  double of_element(std::size_t rank) const { return of_elements_[rank]; }
  /// Of the sum of errors times areas.
  double of_block(const RayPlan::Block& block) const { return of_blocks_[block.begin]; }
  /// Likewise of all elements.
  double of_all() const;

 private:
  double area(std::size_t rank) const { return plan_.elements().area(plan_.element_at(rank)); }
  double whole(const RayPlan::Block& block) const;
  double sum_of_squares(const RayPlan::Block& block) const;
  double rays_of_part(std::size_t rank) const;
  std::vector<double> rays_in(const RayPlan::Window& window) const;
  double variance_of_parts(std::size_t rank) const;
  double variance_by_rays(std::size_t rank) const;
  double parts_of_rays(const RayPlan::Block& block) const;
  double share_of_whole(const RayPlan::Block& block) const;
  void find_without_parts();
  void find_parts_of_rays(const RayPlan::Window& window);
  void find_by_parts();
  void find_blocks();
  void find_blocks_by_halves(std::span<const Variance> more);
  void find_elements();
  std::vector<RayPlan::Block> all_blocks() const;

  const RayPlan& plan_;
  const Differences& of_;
  std::vector<double> of_elements_;  // by rank
  std::vector<double> of_blocks_;    // by the first rank of a block
  // By rank, what parts have of the variance of as many single rays; 0 where it is not known.
  std::vector<double> parts_of_rays_;
};

/// Errors of what the rays of elements found, as half the differences between their two sets tell:
/// each is a fair sample of the error of the mean of both.
///
/// Elements of a block share a sequence of points, so that one has too little of what another has
/// too much of: their errors belong together, while blocks are independent. A draw gives a block
/// the half differences of one nearby, shifted within it and with either sign, as multiples of what
/// is usual: a single half difference says little about its element, but those around it are alike.
/// What a block has as a whole stays with it.
///
/// Half differences of several quantities are drawn alike, and so keep what they have in common.
///
/// Source: Wu 1986 (wild bootstrap), Politis and Romano 1992 (circular block bootstrap).
class ErrorDraws {
 public:
  /// Elements that are left out have no error.
  ErrorDraws(const FluxOptions& options, const RayPlan& plan, const Differences& of,
             const std::function<bool(std::size_t rank)>& is_left_out);

  /// Some of the draws.
  /// Shape: at rank * count + draw - first.
  std::vector<float> draws(std::size_t first, std::size_t count) const;
  /// Adds, of each draw's sum over all elements of their errors times something, what every block
  /// contributes to the variance over all signs that the draws may have.
  /// Shape: errors as draws() gives them; one factor per rank; one variance per block.
  void add_variances_in_sum(std::span<const float> errors, std::span<const double> factors,
                            std::vector<double>& of_blocks) const;
  /// The variance of such a sum from these, taken together.
  double variance_of_sum(std::span<const double> of_blocks) const;

 private:
  // The elements of a block together.
  struct Whole {
    double area = 0;     // of those that have an error
    double squares = 0;  // of usual errors times areas
    double usual = 0;    // error times area
    double times_usual = 0;
  };
  // What brings errors that a window passes on to their size: the inverse of what they are as
  // multiples of what is usual, root mean square.
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

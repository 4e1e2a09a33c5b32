#include "flux/error_draws.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace scarp {

namespace {

// Between shifts of one block to another; odd, so that those of a whole block all differ.
constexpr std::size_t shift_step = 5;

constexpr double square(double x) { return x * x; }

// The usual error of an element. The variance of scrambled sets falls about as n^-1.5 with the
// number n of rays on the same area; of elements with as many rays on an area it is as that of
// rays that are drawn without order, one over their number.
double usual_error(double scatter, double rays, double share) {
  return scatter * std::sqrt(std::sqrt(share / rays) / rays);
}

// What the rays of some elements tell, mean by ray.
struct Scatter {
  double rays = 0;
  double square = 0;
  double fourth = 0;
};

Scatter mean_of(std::span<const Scatter> all) {
  Scatter mean;
  for (const Scatter& each : all) {
    mean.rays += each.rays;
    mean.square += each.rays * each.square;
    mean.fourth += each.rays * each.fourth;
  }
  return {mean.rays, mean.square / mean.rays, mean.fourth / mean.rays};
}

// By how much mean squares of elements differ, without what they do by chance.
double variance_between(std::span<const Scatter> all, const Scatter& mean) {
  double apart = 0;
  double by_chance = 0;
  for (const Scatter& each : all) {
    apart += each.rays * square(each.square - mean.square);
    by_chance += each.fourth - square(each.square);
  }
  return std::max(apart - by_chance, 0.0) / mean.rays;
}

// Of the number of rays that meet something the variance is that of those that have to do with its
// border: in space and direction that has as many as the 3/4 power of those within (Bernoulli's
// mean square is their part, and so is the mean fourth power).
double usual_of(const Scatter& of_rays) {
  return std::sqrt(std::sqrt(of_rays.square * std::sqrt(of_rays.fourth)));
}

}  // namespace

// A few rays say little of their element: it counts with all others as far as chance may have made
// it differ from them.
//
// Source: Efron and Morris 1973 (empirical Bayes), with variances by moments.
std::vector<double> usual_scatter(const RayPlan& plan, const RayScatter& scatter) {
  std::vector<double> usual(plan.size());
  std::vector<Scatter> all;
  for (const RayPlan::Window& window : plan.windows()) {
    const std::uint32_t begin = window.front().begin;
    const std::uint32_t end = window.back().end;
    all.clear();
    for (std::uint32_t rank = begin; rank < end; ++rank)
      all.push_back(
          {1.0 * plan.rays(rank) * set_count, scatter.squares[rank], scatter.fourths[rank]});
    const Scatter mean = mean_of(all);
    const double between = variance_between(all, mean);
    const double of_ray = std::max(mean.fourth - square(mean.square), 0.0);
    for (std::uint32_t rank = begin; rank < end; ++rank) {
      const Scatter& own = all[rank - begin];
      const double part = between > 0 ? between / (between + of_ray / own.rays) : 0;
      usual[rank] = usual_of({.rays = own.rays,
                              .square = part * own.square + (1 - part) * mean.square,
                              .fourth = part * own.fourth + (1 - part) * mean.fourth});
    }
  }
  return usual;
}

ErrorDraws::ErrorDraws(const FluxOptions& options, const RayPlan& plan,
                       std::span<const double> halves, std::vector<double> scatter,
                       const std::function<bool(std::size_t rank)>& is_left_out)
    : options_(options),
      plan_(plan),
      usual_(plan.size()),
      times_usual_(plan.size()),
      wholes_(plan.size()) {
  for (std::size_t rank = 0; rank < plan.size(); ++rank) {
    const double of_ray = scatter.empty() ? 1 : scatter[rank];
    const double usual = usual_error(of_ray, plan.rays(rank), plan.share_of(plan.element_at(rank)));
    if (is_left_out(rank) || usual == 0) continue;
    usual_[rank] = static_cast<float>(usual);
    times_usual_[rank] = static_cast<float>(halves[rank] / usual);
    Whole& whole = wholes_[plan.block_of(rank).begin];
    whole.area += area(rank);
    whole.sum += area(rank) * halves[rank];
    whole.expected += square(area(rank) * usual);
  }
}

std::vector<float> ErrorDraws::draws(std::size_t first, std::size_t count) const {
  static_assert(draw_count == 32);
  std::vector<float> errors(usual_.size() * count);
  for (const RayPlan::Window& window : plan_.windows()) draw_in(window, first, count, errors);
  return errors;
}

ErrorDraws::Sizes ErrorDraws::sizes(const RayPlan::Window& window) const {
  double of_elements = 0;  // squares
  double expected = 0;
  double of_wholes = 0;
  double expected_of_wholes = 0;
  double passed_on = 0;  // as multiples of what is usual
  double passed_on_of_wholes = 0;
  for (const RayPlan::Block& block : window) {
    double of_block = 0;
    for (std::size_t rank = block.begin; rank < block.end; ++rank) {
      const double usual = area(rank) * static_cast<double>(usual_[rank]);
      const auto times_usual = static_cast<double>(times_usual_[rank]);
      of_elements += square(usual * times_usual);
      expected += square(usual);
      of_block += square(times_usual);
    }
    passed_on += of_block / block.size();
    const Whole& whole = wholes_[block.begin];
    of_wholes += square(whole.sum);
    expected_of_wholes += whole.expected;
    passed_on_of_wholes += square(whole.times_usual());
  }
  const auto blocks = static_cast<double>(window.size());
  Sizes sizes;
  if (passed_on > 0)
    sizes.of_elements =
        static_cast<float>(std::sqrt(of_elements / (expected * passed_on / blocks)));
  if (passed_on_of_wholes > 0)
    sizes.of_wholes = std::sqrt(of_wholes / (expected_of_wholes * passed_on_of_wholes / blocks));
  return sizes;
}

void ErrorDraws::draw_in(const RayPlan::Window& window, std::size_t first, std::size_t count,
                         std::vector<float>& errors) const {
  const Sizes sizes = this->sizes(window);
  for (std::size_t b = 0; b < window.size(); ++b) {
    const RayPlan::Block& block = window[b];
    const Whole& whole = wholes_[block.begin];
    if (whole.area == 0) continue;
    const std::uint64_t stream = (std::uint64_t{1} << 32) + plan_.element_at(block.begin);
    RandomStream random({options_.seed, options_.time_step, 0xFFFFFFFFU, stream});
    const std::uint32_t signs = random.bits();
    const std::size_t first_shift = random.bits() & 0xFFU;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t draw = first + k;
      const float sign = (signs >> draw) & 1U ? 1 : -1;
      const RayPlan::Block& source = window[(b + draw) % window.size()];
      const std::size_t shift = first_shift + draw / window.size() * shift_step;
      double drawn = 0;
      for (std::size_t to = block.begin; to < block.end; ++to) {
        const std::size_t from = source.begin + (to - block.begin + shift) % source.size();
        const float error =
            sizes.of_elements * usual_[to] * times_usual_[usual_[from] > 0 ? from : to];
        errors[to * count + k] = sign * error;
        drawn += area(to) * static_cast<double>(error);
      }
      const double wanted =
          sizes.of_wholes * std::sqrt(whole.expected) * wholes_[source.begin].times_usual();
      // What a sum tells of an element goes with its part in the variance of the sum.
      const double rest = (wanted - drawn) / whole.expected;
      for (std::size_t to = block.begin; to < block.end; ++to)
        errors[to * count + k] +=
            sign * static_cast<float>(rest * area(to) * square(static_cast<double>(usual_[to])));
    }
  }
}

std::vector<double> ErrorDraws::variances_of_sum(std::span<const float> errors,
                                                 std::span<const double> factors) const {
  const std::size_t count = errors.size() / factors.size();
  std::vector<double> variances(count);
  std::vector<double> of_block(count);
  for (const RayPlan::Window& window : plan_.windows()) {
    for (const RayPlan::Block& block : window) {
      std::ranges::fill(of_block, 0.0);
      for (std::size_t rank = block.begin; rank < block.end; ++rank)
        for (std::size_t k = 0; k < count; ++k)
          of_block[k] += factors[rank] * static_cast<double>(errors[rank * count + k]);
      for (std::size_t k = 0; k < count; ++k) variances[k] += of_block[k] * of_block[k];
    }
  }
  return variances;
}

KnownSum::KnownSum(std::span<const double> draws, double variance)
    : along_(draws.begin(), draws.end()) {
  double squares = 0;
  for (const double draw : draws) squares += draw * draw;
  if (squares == 0) return;
  for (double& part : along_) part /= std::sqrt(squares);
  more_ = std::sqrt(variance * static_cast<double>(draws.size()) / squares) - 1;
}

template <class Number>
void KnownSum::correct(std::span<Number> draws) const {
  double goes_along = 0;
  for (std::size_t k = 0; k < draws.size(); ++k)
    goes_along += along_[k] * static_cast<double>(draws[k]);
  for (std::size_t k = 0; k < draws.size(); ++k)
    draws[k] += static_cast<Number>(more_ * goes_along * along_[k]);
}

template void KnownSum::correct(std::span<float>) const;
template void KnownSum::correct(std::span<double>) const;

void mean_draws_on_facet(const RayPlan& plan, std::size_t facet, std::span<const float> of_ranks,
                         std::span<double> draws) {
  const Elements& elements = plan.elements();
  const auto row_of = [&](std::uint32_t piece) {
    return of_ranks.subspan(plan.rank_of(elements.element_of(piece)) * draw_count, draws.size());
  };
  const auto pieces = elements.pieces_of_facet(facet);
  if (pieces.size() == 1) {
    std::ranges::copy(row_of(pieces.front()), draws.begin());
    return;
  }
  std::ranges::fill(draws, 0.0);
  for (const std::uint32_t p : pieces) {
    const auto row = row_of(p);
    const double share = elements.share_of_facet(p);
    for (std::size_t k = 0; k < draws.size(); ++k) draws[k] += share * static_cast<double>(row[k]);
  }
}

}  // namespace scarp

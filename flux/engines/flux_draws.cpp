#include "flux/engines/flux_draws.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"

namespace scarp {

namespace {

constexpr double tolerance = 2e-2;

// How many rays of each element tell where its error goes on to, unless all of them meet no more
// elements: a few percent of the error are nothing, and these take most of the time that the draws
// take.
constexpr std::size_t rays_for_draws = 32;

double seen_of_elements(const ExchangeMatrix& matrix, std::size_t row) {
  double sum = 0;
  matrix.for_each_part(row, [&](std::size_t hit, double part) {
    if (hit < matrix.size()) sum += part;
  });
  return sum;
}

// The part of what an element sees that is itself, in a mirror.
double sees_of_itself(const ExchangeRows& rows, std::size_t row) {
  double sum = 0;
  rows.for_each_part(row, [&](std::size_t hit, double part) { sum += hit == row ? part : 0; });
  return std::min(sum, 1.0);
}

ExchangeRows thinned(const ExchangeMatrix& matrix) {
  static_assert(rays_for_draws % set_count == 0);
  ExchangeMatrix few;
  few.first.push_back(0);
  for (std::size_t i = 0; i < matrix.size(); ++i) {
    const auto rays = matrix.row(i);
    const auto part = rays.first(std::min(rays.size(), rays_for_draws));
    few.rays.insert(few.rays.end(), part.begin(), part.end());
    few.first.push_back(few.rays.size());
    few.scale.push_back(matrix.scale[i]);
  }
  for (std::size_t i = 0; i < matrix.size(); ++i) {
    const double seen = seen_of_elements(few, i);
    const double more = seen > 0 ? seen_of_elements(matrix, i) / seen : 0;
    for (double& scale : few.scale[i]) scale *= more;
  }
  return ExchangeRows(few);
}

bool are_few(const ExchangeRows& rows) { return rows.seen.size() <= rays_for_draws * rows.size(); }

}  // namespace

FluxDraws::FluxDraws(const RayPlan& plan, const Passing& passing, ErrorDraws of_equations,
                     std::span<const double> weights, double largest)
    : plan_(plan),
      thinned_(are_few(passing.rows)
                   ? nullptr
                   : std::make_unique<const ExchangeRows>(thinned(passing.matrix))),
      rows_(thinned_ ? *thinned_ : passing.rows),
      own_(passing.solver != nullptr && !thinned_
               ? nullptr
               : std::make_unique<const ExchangeSolver>(rows_, passing.reemitted)),
      exchange_(own_ ? *own_ : *passing.solver),
      reemitted_(passing.reemitted),
      of_equations_(std::move(of_equations)),
      effects_(effects(weights)),
      drawn_(plan.size() * draw_count),
      corrected_(drawn_.size()) {
  for (std::size_t rank = 0; rank < plan.size(); ++rank) {
    most_.push_back(static_cast<float>(largest * (1 - sees_of_itself(passing.rows, rank))));
    counts_.push_back(area(rank) * weights[rank]);
    effects_[rank] *= area(rank);
  }
}

FluxDraws::~FluxDraws() = default;

// With errors e of the equations those of the flux are x = e + K c x, and their sum w x = a e,
// where a = w + c K* a and K* is the transpose of K. With areas A, A K = K* A: a = A y where w =
// A v and y = v + c z, z = K v + K c z.
std::vector<double> FluxDraws::effects(std::span<const double> weights) const {
  std::vector<float> first(weights.size());
  parallel_for(first.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      double sum = 0;
      rows_.for_each_part(i, [&](std::size_t hit, double part) { sum += part * weights[hit]; });
      first[i] = static_cast<float>(sum);
    }
  });
  const std::vector<float> brought = exchange_.solve<float>(first, 1, tolerance);
  std::vector<double> effects(weights.begin(), weights.end());
  for (std::size_t i = 0; i < effects.size(); ++i)
    effects[i] += static_cast<double>(reemitted_[i]) * static_cast<double>(brought[i]);
  return effects;
}

// An element that sees mostly itself passes an error of its equation to and fro many times. But
// what it has is what it sees besides, and that makes up no more of the equation than its part.
void FluxDraws::limit(std::span<float> errors) const {
  for (std::size_t k = 0; k < errors.size(); ++k) {
    const float most = most_[k / at_once];
    errors[k] = std::clamp(errors[k], -most, most);
  }
}

double FluxDraws::possible_part(std::size_t rank, double error) const {
  const auto most = static_cast<double>(most_[rank]);
  return std::abs(error) > most ? most / std::abs(error) : 1;
}

void FluxDraws::draw(std::size_t count) {
  for (std::size_t first = sums_.size(); first < count; first += at_once) {
    std::vector<float> errors = of_equations_.draws(first, at_once);
    limit(errors);
    of_equations_.add_variances_in_sum(errors, effects_, variances_);
    const std::vector<float> solved = exchange_.solve<float>(errors, at_once, tolerance);
    sums_.resize(first + at_once);
    for (std::size_t k = 0; k < solved.size(); ++k) {
      const std::size_t rank = k / at_once;
      const std::size_t draw = first + k % at_once;
      drawn_[rank * draw_count + draw] = solved[k];
      sums_[draw] += counts_[rank] * static_cast<double>(solved[k]);
    }
  }
  known_sum_ = KnownSum(
      sums_, of_equations_.variance_of_sum(variances_) / static_cast<double>(sums_.size()));
  corrected_ = drawn_;
  parallel_for(plan_.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t rank = begin; rank < end; ++rank)
      known_sum_.correct(std::span(corrected_).subspan(rank * draw_count, sums_.size()));
  });
}

}  // namespace scarp

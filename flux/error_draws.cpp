#include "flux/error_draws.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace scarp {

namespace {

// Between shifts of one block to another; odd, so that those of a whole block all differ.
constexpr std::size_t shift_step = 5;

}  // namespace

// The variance of scrambled sets falls about as n^-1.5 with their number of rays.
ErrorDraws::ErrorDraws(const FluxOptions& options, const RayPlan& plan,
                       std::span<const double> halves,
                       const std::function<bool(std::size_t rank)>& is_left_out)
    : options_(options),
      plan_(plan),
      scale_(plan.size()),
      normalised_(plan.size()),
      wholes_(plan.size()) {
  for (std::size_t rank = 0; rank < plan.size(); ++rank) {
    if (is_left_out(rank)) continue;
    const double n = plan.rays(rank);
    const double scale = 1 / std::sqrt(n * std::sqrt(n));
    scale_[rank] = static_cast<float>(scale);
    normalised_[rank] = static_cast<float>(halves[rank] / scale);
    wholes_[plan.block_of(rank).begin].add(area(rank), share(rank), halves[rank]);
  }
}

std::vector<float> ErrorDraws::draws(std::size_t first, std::size_t count) const {
  static_assert(draw_count == 32);
  std::vector<float> errors(scale_.size() * count);
  for (const RayPlan::Window& window : plan_.windows()) draw_in(window, first, count, errors);
  return errors;
}

void ErrorDraws::draw_in(const RayPlan::Window& window, std::size_t first, std::size_t count,
                         std::vector<float>& errors) const {
  for (std::size_t b = 0; b < window.size(); ++b) {
    const RayPlan::Block& block = window[b];
    const std::uint64_t stream = (std::uint64_t{1} << 32) + plan_.element_at(block.begin);
    RandomStream random({options_.seed, options_.time_step, 0xFFFFFFFFU, stream});
    const std::uint32_t signs = random.bits();
    const std::size_t first_shift = random.bits() & 0xFFU;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t draw = first + k;
      const float sign = (signs >> draw) & 1U ? 1 : -1;
      const RayPlan::Block& source = window[(b + draw) % window.size()];
      const std::size_t shift = first_shift + draw / window.size() * shift_step;
      Whole drawn;
      for (std::size_t to = block.begin; to < block.end; ++to) {
        const std::size_t from = source.begin + (to - block.begin + shift) % source.size();
        const float error = scale_[to] * normalised_[scale_[from] > 0 ? from : to];
        errors[to * count + k] = sign * error;
        if (scale_[to] > 0) drawn.add(area(to), share(to), error);
      }
      const Whole& wanted = wholes_[source.begin];
      if (drawn.area == 0 || wanted.area == 0) continue;
      // Rays go with the share, and the error as n^-3/4 with them.
      const double size = std::sqrt(wanted.share / drawn.share);
      const auto rest = static_cast<float>(wanted.mean() * size * std::sqrt(size) - drawn.mean());
      for (std::size_t to = block.begin; to < block.end; ++to)
        if (scale_[to] > 0) errors[to * count + k] += sign * rest;
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

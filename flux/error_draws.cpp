#include "flux/error_draws.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace scarp {

namespace {

// Blocks in a row along the curve that take each other's half differences.
constexpr std::size_t blocks_in_window = 4;

// Between shifts of one block to another; odd, so that those of a whole block all differ.
constexpr std::size_t shift_step = 5;

}  // namespace

// The variance of scrambled sets falls about as n^-1.5 with their number of rays.
ErrorDraws::ErrorDraws(const FluxOptions& options, const RayPlan& plan,
                       std::span<const double> halves,
                       const std::function<bool(std::size_t rank)>& is_left_out)
    : options_(options), plan_(plan), scale_(plan.size()), normalised_(plan.size()) {
  for (std::size_t rank = 0; rank < plan.size(); ++rank) {
    if (is_left_out(rank)) continue;
    const double n = plan.rays(rank);
    const double scale = 1 / std::sqrt(n * std::sqrt(n));
    scale_[rank] = static_cast<float>(scale);
    normalised_[rank] = static_cast<float>(halves[rank] / scale);
  }
}

std::vector<float> ErrorDraws::draws(std::size_t first, std::size_t count) const {
  static_assert(draw_count == 32);
  std::vector<float> errors(scale_.size() * count);
  const std::span<const RayPlan::Block> blocks = plan_.blocks();
  for (std::size_t begin = 0, end = 0; begin < blocks.size(); begin = end) {
    while (end < std::min(begin + blocks_in_window, blocks.size()) &&
           blocks[end].main_direction == blocks[begin].main_direction)
      ++end;
    draw_in(blocks.subspan(begin, end - begin), first, count, errors);
  }
  return errors;
}

void ErrorDraws::draw_in(std::span<const RayPlan::Block> window, std::size_t first,
                         std::size_t count, std::vector<float>& errors) const {
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
      for (std::size_t to = block.begin; to < block.end; ++to) {
        const std::size_t from = source.begin + (to - block.begin + shift) % source.size();
        errors[to * count + k] = sign * scale_[to] * normalised_[scale_[from] > 0 ? from : to];
      }
    }
  }
}

}  // namespace scarp

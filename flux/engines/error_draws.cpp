#include "flux/engines/error_draws.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "core/random.h"
#include "flux/sampling/sobol.h"

namespace scarp {

namespace {

// Between shifts of one block to another; odd, so that those of a whole block all differ.
constexpr std::size_t shift_step = 5;

constexpr double square(double x) { return x * x; }

// The usual error of an element whose single rays scatter by 1. The variance of scrambled sets
// falls about as n^-1.5 with the number n of rays on the same area; of elements with as many rays
// on an area it is as that of rays that are drawn without order, one over their number.
double usual_error(double rays, double share) { return std::sqrt(std::sqrt(share / rays) / rays); }

// By how much the variance of a scrambled set is less than that of a ray.
double gain(double rays) { return rays * std::sqrt(rays); }

// The mean of some variances and a guess.
struct Mean {
  double value = 0;
  double freedom = 0;   // squares that are as good
  double of_guess = 0;  // its part in the mean

  Variance as_guess(double freedom_of_guess) const { return {value, freedom_of_guess}; }
};

// How much elements with so many rays say about each other's errors: how these fall with the number
// is known about only, and what hardly any ray finds makes them fall more slowly.
double likeness(double rays, double others) {
  return std::min(1.0, 2 * std::min(rays, others) / std::max(rays, others));
}

// Of the variances around one of them; one that is further away counts less, and so does one with
// another number of rays, if they are given.
Mean mean_around(std::span<const Variance> all, std::size_t place, int reach, const Variance& guess,
                 std::span<const double> rays = {}) {
  const int k = static_cast<int>(place);
  double sum = guess.freedom * guess.value;
  double weights = guess.freedom;
  double squares = guess.freedom;
  for (int j = std::max(0, k - reach + 1); j < std::min(static_cast<int>(all.size()), k + reach);
       ++j) {
    const auto& [value, freedom] = all[static_cast<std::size_t>(j)];
    const double near = 1 - 1.0 * std::abs(j - k) / reach;
    const double alike =
        rays.empty() ? 1 : likeness(rays[place], rays[static_cast<std::size_t>(j)]);
    const double part = near * alike;
    sum += part * freedom * value;
    weights += part * freedom;
    squares += part * part * freedom;
  }
  if (weights == 0) return {};
  return {sum / weights, weights * weights / squares, guess.freedom / weights};
}

Mean mean_of(std::span<const Variance> all, const Variance& guess) {
  double sum = guess.freedom * guess.value;
  double weights = guess.freedom;
  for (const auto& [value, freedom] : all) {
    sum += freedom * value;
    weights += freedom;
  }
  if (weights == 0) return {};
  return {sum / weights, weights, guess.freedom / weights};
}

// By block, the mean over those of about as many elements: the fewer share a sequence, the less
// they fill each other's gaps.
std::vector<Mean> means_of_alike(std::span<const RayPlan::Block> blocks,
                                 std::span<const Variance> of_blocks, const Variance& guess) {
  const auto size_of = [&](std::size_t b) {
    return static_cast<std::size_t>(std::bit_width(blocks[b].size()));
  };
  std::array<std::vector<Variance>, std::bit_width(share_count) + 1> by_size;
  for (std::size_t b = 0; b < blocks.size(); ++b) by_size[size_of(b)].push_back(of_blocks[b]);
  std::vector<Mean> means;
  for (std::size_t b = 0; b < blocks.size(); ++b)
    means.push_back(mean_of(by_size[size_of(b)], guess));
  return means;
}

// How much of the variance that parts let expect sets have, by what parts have of the variance of
// as many single rays. Of trenches, holes and slabs, of which seeds told the errors, it was half:
// elements by themselves, and those of a block together. Where few rays find something bright,
// parts are no better than single rays, and sets no better than their parts.
double share_by_parts(double parts_of_rays) {
  const double x = std::min(parts_of_rays, 1.0);
  return 0.5 * (1 + square(square(square(x))));
}

// That is right within a factor of two here and there.
constexpr Variance known_before{.value = 1, .freedom = 8};

// How many times as large as usual the square of an error is. Where by chance next to nothing is
// usual it says nothing.
Variance times_usual(double error, double usual_square) {
  constexpr double most = 25;
  if (usual_square == 0) return {};
  return {.value = std::min(square(error) / usual_square, most), .freedom = 1};
}

// An error with a variance that is itself known by a few squares only is one of Student's t: by
// so much more in its own variance.
double student_factor(double freedom) {
  constexpr double least = 4;
  return freedom > 0 ? 1 / (1 - 2 / std::max(freedom, least)) : 1;
}

}  // namespace

// What is usual is the mean of squares over what parts let expect, which is larger where that is
// known little, and allows for more than is known of each. Of many blocks neither is needed: their
// squares over what is usual, each counted by what it adds, make up for it.
Variance variance_over_blocks(std::span<const double> usual, std::span<const double> times_usual) {
  constexpr double freedom_of_usual = 8;
  // Of a block, by which parts tell what is usual.
  constexpr double squares_of_parts = set_count * (most_parts - 1);
  double sum = 0;
  double squares = 0;
  double found = 0;
  for (std::size_t b = 0; b < usual.size(); ++b) {
    sum += usual[b];
    squares += square(usual[b]);
    found += usual[b] * times_usual[b];
  }
  if (sum == 0) return {};
  const double freedom = sum * sum / squares;
  const double weights = freedom + freedom_of_usual;
  const double of_usual = freedom_of_usual / weights;
  // The variance of a variance is twice its square over the squares that it is known by.
  const double by_found = freedom / square(weights);
  const double by_parts = square(of_usual) / (squares_of_parts * freedom);
  return {.value = (freedom * found + freedom_of_usual * sum) / weights,
          .freedom = 1 / (by_found + by_parts)};
}

UsualErrors::UsualErrors(const RayPlan& plan, const Differences& of,
                         const std::function<bool(std::size_t rank)>& is_left_out)
    : plan_(plan),
      of_(of),
      of_elements_(plan.size()),
      of_blocks_(plan.size()),
      parts_of_rays_(plan.size()) {
  for (std::size_t rank = 0; rank < plan.size(); ++rank)
    of_elements_[rank] = is_left_out(rank) ? 0 : 1;
  if (of.parts.empty()) {
    find_without_parts();
  } else {
    find_by_parts();
    find_blocks();
    find_elements();
  }
}

// Errors are as large as half differences in the window say.
void UsualErrors::find_without_parts() {
  for (const RayPlan::Window& window : plan_.windows()) {
    double squares = 0;
    double expected = 0;
    for (std::size_t rank = window.front().begin; rank < window.back().end; ++rank) {
      of_elements_[rank] *= usual_error(plan_.rays(rank), plan_.share_of(plan_.element_at(rank)));
      if (of_elements_[rank] == 0) continue;
      squares += square(area(rank) * of_.halves[rank]);
      expected += square(area(rank) * of_elements_[rank]);
    }
    const double more = expected > 0 ? std::sqrt(squares / expected) : 0;
    double of_blocks = 0;
    for (const RayPlan::Block& block : window) {
      for (std::size_t rank = block.begin; rank < block.end; ++rank) of_elements_[rank] *= more;
      of_blocks += square(whole(block));
    }
    for (const RayPlan::Block& block : window)
      if (squares > 0)
        of_blocks_[block.begin] = std::sqrt(sum_of_squares(block) * of_blocks / squares);
  }
}

double UsualErrors::whole(const RayPlan::Block& block) const {
  double sum = 0;
  for (std::size_t rank = block.begin; rank < block.end; ++rank)
    if (of_elements_[rank] > 0) sum += area(rank) * of_.halves[rank];
  return sum;
}

double UsualErrors::sum_of_squares(const RayPlan::Block& block) const {
  double sum = 0;
  for (std::size_t rank = block.begin; rank < block.end; ++rank)
    sum += square(area(rank) * of_elements_[rank]);
  return sum;
}

// What parts of elements have of the variance of as many single rays.
double UsualErrors::parts_of_rays(const RayPlan::Block& block) const {
  double of_rays = 0;
  for (std::size_t rank = block.begin; rank < block.end; ++rank)
    if (parts_of_rays_[rank] > 0)
      of_rays += square(area(rank) * of_elements_[rank]) / parts_of_rays_[rank];
  return of_rays > 0 ? sum_of_squares(block) / of_rays : 0;
}

double UsualErrors::rays_of_part(std::size_t rank) const {
  return plan_.rays(rank) / static_cast<double>(part_count(plan_, plan_.block_of(rank)));
}

double UsualErrors::variance_of_parts(std::size_t rank) const {
  const auto count = static_cast<double>(part_count(plan_, plan_.block_of(rank)));
  double squares = 0;
  for (const float part : of_.parts[rank]) squares += square(static_cast<double>(part));
  const double by_rays = static_cast<double>(of_.of_rays[rank]) * count / plan_.rays(rank);
  return squares / (set_count * (count - 1)) + by_rays;
}

// Parts of all elements together; the variance, as part of the sum of those of the elements.
double UsualErrors::share_of_whole(const RayPlan::Block& block) const {
  const auto count = static_cast<double>(part_count(plan_, block));
  std::array<double, set_count * most_parts> sums{};
  double of_elements = 0;
  double of_rays = 0;
  for (std::size_t rank = block.begin; rank < block.end; ++rank) {
    if (of_elements_[rank] == 0) continue;
    const double area = this->area(rank);
    for (std::size_t k = 0; k < sums.size(); ++k)
      sums[k] += area * static_cast<double>(of_.parts[rank][k]);
    of_elements += square(area) * variance_of_parts(rank);
    of_rays += square(area) * static_cast<double>(of_.of_rays[rank]) * count / plan_.rays(rank);
  }
  double squares = 0;
  for (const double sum : sums) squares += square(sum);
  return of_elements > 0 ? (squares / (set_count * (count - 1)) + of_rays) / of_elements : 0;
}

std::vector<double> UsualErrors::rays_in(const RayPlan::Window& window) const {
  std::vector<double> rays;
  for (std::uint32_t rank = window.front().begin; rank < window.back().end; ++rank)
    rays.push_back(plan_.rays(rank));
  return rays;
}

// What single rays let expect of a part, if each is by itself.
double UsualErrors::variance_by_rays(std::size_t rank) const {
  const double of_ray =
      static_cast<double>(of_.of_rays[rank]) + static_cast<double>(of_.of_rays_in_parts[rank]);
  return of_ray / rays_of_part(rank);
}

// Parts of a few rays are no better than these, whatever they find.
void UsualErrors::find_parts_of_rays(const RayPlan::Window& window) {
  constexpr int reach = 10;  // ranks
  constexpr double enough = 8;
  if (of_.of_rays_in_parts.empty()) return;
  const std::uint32_t begin = window.front().begin;
  std::vector<Variance> of_parts;
  std::vector<Variance> by_rays;
  for (std::uint32_t rank = begin; rank < window.back().end; ++rank) {
    const double n = rays_of_part(rank);
    const double freedom = n >= enough ? of_elements_[rank] : 0;
    of_parts.push_back({.value = variance_of_parts(rank) * gain(n), .freedom = freedom});
    by_rays.push_back({.value = variance_by_rays(rank) * gain(n), .freedom = freedom});
  }
  for (std::size_t k = 0; k < of_parts.size(); ++k) {
    const double of_rays = mean_around(by_rays, k, reach, {}).value;
    if (of_rays > 0)
      parts_of_rays_[begin + k] = mean_around(of_parts, k, reach, {}).value / of_rays;
  }
}

// What parts let expect of the sets of elements.
void UsualErrors::find_by_parts() {
  constexpr int reach = 10;  // ranks
  for (const RayPlan::Window& window : plan_.windows()) {
    find_parts_of_rays(window);
    std::vector<Variance> of_ray;
    for (const RayPlan::Block& block : window) {
      const auto count = static_cast<double>(part_count(plan_, block));
      for (std::size_t rank = block.begin; rank < block.end; ++rank)
        of_ray.push_back({.value = variance_of_parts(rank) * gain(rays_of_part(rank)),
                          .freedom = of_elements_[rank] * set_count * (count - 1)});
    }
    const std::size_t begin = window.front().begin;
    const std::vector<double> rays = rays_in(window);
    for (std::size_t k = 0; k < of_ray.size(); ++k) {
      const double variance = mean_around(of_ray, k, reach, {}, rays).value;
      of_elements_[begin + k] *= std::sqrt(variance / gain(plan_.rays(begin + k)));
    }
  }
}

void UsualErrors::find_elements() {
  constexpr int reach = 24;  // ranks
  constexpr double freedom_of_guess = 3;
  std::vector<Variance> more;
  for (std::size_t rank = 0; rank < plan_.size(); ++rank)
    of_elements_[rank] *= std::sqrt(share_by_parts(parts_of_rays_[rank]));
  for (std::size_t rank = 0; rank < plan_.size(); ++rank)
    more.push_back(times_usual(of_.halves[rank], square(of_elements_[rank])));
  const Variance guess = mean_of(more, known_before).as_guess(freedom_of_guess);
  for (const RayPlan::Window& window : plan_.windows()) {
    const std::size_t begin = window.front().begin;
    const auto of_window = std::span(more).subspan(begin, window.back().end - begin);
    const std::vector<double> rays = rays_in(window);
    for (std::size_t k = 0; k < of_window.size(); ++k) {
      const Mean around = mean_around(of_window, k, reach, guess, rays);
      of_elements_[begin + k] *= std::sqrt(around.value * student_factor(around.freedom));
    }
  }
}

// By what parts of the whole let expect, not by the errors of the elements: how far whole sets are
// better than parts differs less from place to place for sums than how far errors of elements
// cancel in them.
//
// Before the half differences of the elements are looked at.
void UsualErrors::find_blocks() {
  constexpr int reach_of_parts = 3;  // blocks
  constexpr double freedom_of_share = 1;
  std::vector<Variance> shares;
  for (const RayPlan::Block& block : all_blocks()) {
    const double share = share_of_whole(block);
    const double squares = static_cast<double>(set_count * (part_count(plan_, block) - 1));
    shares.push_back({.value = share, .freedom = share > 0 ? squares : 0});
  }
  const std::vector<Mean> usual_shares = means_of_alike(all_blocks(), shares, {});
  std::vector<Variance> more;
  for (const RayPlan::Window& window : plan_.windows()) {
    const auto of_window = std::span(shares).subspan(more.size(), window.size());
    for (std::size_t b = 0; b < window.size(); ++b) {
      const Variance usual = usual_shares[more.size()].as_guess(freedom_of_share);
      const double share = mean_around(of_window, b, reach_of_parts, usual).value;
      const double variance =
          share * sum_of_squares(window[b]) * share_by_parts(share * parts_of_rays(window[b]));
      of_blocks_[window[b].begin] = std::sqrt(variance);
      more.push_back(times_usual(whole(window[b]), variance));
    }
  }
  find_blocks_by_halves(more);
}

// The guess counts as many squares as places were seen to differ by (2 over 8 is a factor of 1.5),
// so the mean is what may be expected here of the variance, and of the square of an error: unlike
// that of squares alone it needs no factor of Student's. But the guess is known by so many squares:
// where it makes a part p of the mean, 1 over the mean is larger by p^2 times 2 over their number.
//
// Shape: by block, squares of wholes as multiples of what parts let expect.
void UsualErrors::find_blocks_by_halves(std::span<const Variance> more) {
  constexpr int reach = 4;  // blocks
  constexpr double freedom_of_guess = 8;
  const std::vector<Mean> guesses = means_of_alike(all_blocks(), more, known_before);
  std::size_t first = 0;
  for (const RayPlan::Window& window : plan_.windows()) {
    for (std::size_t b = 0; b < window.size(); ++b) {
      const Mean& guess = guesses[first + b];
      const Mean around = mean_around(more.subspan(first, window.size()), b, reach,
                                      guess.as_guess(freedom_of_guess));
      const double off = square(around.of_guess) * 2 / guess.freedom;
      of_blocks_[window[b].begin] *= std::sqrt(around.value * (1 + off));
    }
    first += window.size();
  }
}

std::vector<RayPlan::Block> UsualErrors::all_blocks() const {
  std::vector<RayPlan::Block> blocks;
  for (const RayPlan::Window& window : plan_.windows())
    blocks.insert(blocks.end(), window.begin(), window.end());
  return blocks;
}

double UsualErrors::of_all() const {
  std::vector<double> usual;
  std::vector<double> more;
  for (const RayPlan::Block& block : all_blocks()) {
    usual.push_back(square(of_block(block)));
    more.push_back(usual.back() > 0 ? square(whole(block)) / usual.back() : 0);
  }
  const auto [variance, freedom] = variance_over_blocks(usual, more);
  return std::sqrt(variance * student_factor(freedom));
}

ErrorDraws::ErrorDraws(const FluxOptions& options, const RayPlan& plan, const Differences& of,
                       const std::function<bool(std::size_t rank)>& is_left_out)
    : options_(options),
      plan_(plan),
      usual_(plan.size()),
      times_usual_(plan.size()),
      wholes_(plan.size()) {
  const UsualErrors usual(plan, of, is_left_out);
  for (const RayPlan::Window& window : plan.windows()) {
    for (const RayPlan::Block& block : window) {
      Whole& whole = wholes_[block.begin];
      double sum = 0;
      for (std::size_t rank = block.begin; rank < block.end; ++rank) {
        const double of_element = usual.of_element(rank);
        if (of_element == 0) continue;
        usual_[rank] = static_cast<float>(of_element);
        times_usual_[rank] = static_cast<float>(of.halves[rank] / of_element);
        whole.area += area(rank);
        whole.squares += square(area(rank) * of_element);
        sum += area(rank) * of.halves[rank];
      }
      whole.usual = usual.of_block(block);
      if (whole.usual > 0) whole.times_usual = sum / whole.usual;
    }
  }
}

std::vector<float> ErrorDraws::draws(std::size_t first, std::size_t count) const {
  static_assert(draw_count == 32);
  std::vector<float> errors(usual_.size() * count);
  for (const RayPlan::Window& window : plan_.windows()) draw_in(window, first, count, errors);
  return errors;
}

ErrorDraws::Sizes ErrorDraws::sizes(const RayPlan::Window& window) const {
  double of_elements = 0;
  double of_wholes = 0;
  double blocks = 0;
  for (const RayPlan::Block& block : window) {
    const Whole& whole = wholes_[block.begin];
    if (whole.area == 0) continue;
    double of_block = 0;
    for (std::size_t rank = block.begin; rank < block.end; ++rank)
      of_block += square(static_cast<double>(times_usual_[rank]));
    of_elements += of_block / block.size();
    of_wholes += square(whole.times_usual);
    blocks += 1;
  }
  Sizes sizes;
  if (of_elements > 0) sizes.of_elements = static_cast<float>(std::sqrt(blocks / of_elements));
  if (of_wholes > 0) sizes.of_wholes = std::sqrt(blocks / of_wholes);
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
      const double wanted = sizes.of_wholes * whole.usual * wholes_[source.begin].times_usual;
      // What a sum says about an element goes with its part in the variance of the sum.
      const double rest = (wanted - drawn) / whole.squares;
      for (std::size_t to = block.begin; to < block.end; ++to)
        errors[to * count + k] +=
            sign * static_cast<float>(rest * area(to) * square(static_cast<double>(usual_[to])));
    }
  }
}

void ErrorDraws::add_variances_in_sum(std::span<const float> errors,
                                      std::span<const double> factors,
                                      std::vector<double>& of_blocks) const {
  const std::size_t count = errors.size() / factors.size();
  std::vector<double> of_block(count);
  std::size_t number = 0;
  for (const RayPlan::Window& window : plan_.windows()) {
    for (const RayPlan::Block& block : window) {
      std::ranges::fill(of_block, 0.0);
      for (std::size_t rank = block.begin; rank < block.end; ++rank)
        for (std::size_t k = 0; k < count; ++k)
          of_block[k] += factors[rank] * static_cast<double>(errors[rank * count + k]);
      if (number == of_blocks.size()) of_blocks.push_back(0);
      for (const double each : of_block) of_blocks[number] += each * each;
      ++number;
    }
  }
}

double ErrorDraws::variance_of_sum(std::span<const double> of_blocks) const {
  std::vector<double> times_usual;
  for (const RayPlan::Window& window : plan_.windows())
    for (const RayPlan::Block& block : window)
      times_usual.push_back(square(wholes_[block.begin].times_usual));
  return variance_over_blocks(of_blocks, times_usual).value;
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

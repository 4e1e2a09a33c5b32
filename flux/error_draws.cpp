#include "flux/error_draws.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/random.h"

namespace scarp {

namespace {

// Between shifts of one block to another; odd, so that those of a whole block all differ.
constexpr std::size_t shift_step = 5;

double power_of_rays(double rays) { return rays * std::sqrt(rays); }

double F(const char* n, double d) { const char* e = getenv(n); return e ? atof(e) : d; }

constexpr double square(double x) { return x * x; }

// The usual error of an element. The variance of scrambled sets falls about as n^-1.5 with the
// number n of rays on the same area; of elements with as many rays on an area it is as that of
// rays that are drawn without order, one over their number.
double usual_error(double scatter, double rays, double share) {
  return scatter * std::sqrt(std::sqrt(share / rays) / rays);
}

// Numbers of ranks, or of blocks, from one that is known by some differences.
struct Known {
  double value = 0;
  double freedom = 0;  // of the differences
};

// Means over those nearby, the less the further away, and over what is usual everywhere.
std::vector<double> nearby(std::span<const Known> all, int reach, const Known& usual) {
  std::vector<double> means;
  const int count = static_cast<int>(all.size());
  for (int k = 0; k < count; ++k) {
    double sum = usual.freedom * usual.value;
    double freedom = usual.freedom;
    for (int j = std::max(0, k - reach + 1); j < std::min(count, k + reach); ++j) {
      const Known& other = all[static_cast<std::size_t>(j)];
      const double weight = other.freedom * (reach - std::abs(j - k)) / reach;
      sum += weight * other.value;
      freedom += weight;
    }
    means.push_back(freedom > 0 ? sum / freedom : 0);
  }
  return means;
}

// The mean of all, if they are as many, or nearly that of a guess.
double mean_of(std::span<const Known> all, Known guess) {
  for (const Known& each : all) {
    guess.value = (guess.freedom * guess.value + each.freedom * each.value) /
                  std::max(guess.freedom + each.freedom, 1e-300);
    guess.freedom += each.freedom;
  }
  return guess.value;
}

}  // namespace

UsualErrors::UsualErrors(const RayPlan& plan, const Differences& of,
                         const std::function<bool(std::size_t rank)>& is_left_out)
    : plan_(plan), of_(of), of_elements_(plan.size()), of_blocks_(plan.size()) {
  for (std::size_t rank = 0; rank < plan.size(); ++rank) of_elements_[rank] = is_left_out(rank) ? 0 : 1;
  if (of.parts.empty()) {
    find_by_windows();
  } else {
    find_by_parts();
  }
  find_blocks();
}

// The variance of what a part says.
double UsualErrors::square_of_parts(std::size_t rank) const {
  const auto count = static_cast<double>(part_count(plan_, plan_.block_of(rank)));
  double squares = 0;
  for (const float part : of_.parts[rank]) squares += square(static_cast<double>(part));
  return squares / (set_count * (count - 1)) +
         static_cast<double>(of_.of_rays[rank]) * count / plan_.rays(rank);
}

// Of what the parts of all elements say together.
double UsualErrors::square_of_parts(const RayPlan::Block& block) const {
  const auto count = static_cast<double>(part_count(plan_, block));
  std::array<double, set_count * most_parts> sums{};
  double of_rays = 0;
  for (std::size_t rank = block.begin; rank < block.end; ++rank) {
    if (of_elements_[rank] == 0) continue;
    for (std::size_t k = 0; k < sums.size(); ++k)
      sums[k] += area(rank) * static_cast<double>(of_.parts[rank][k]);
    of_rays += square(area(rank)) * static_cast<double>(of_.of_rays[rank]) * count / plan_.rays(rank);
  }
  double squares = 0;
  for (const double sum : sums) squares += square(sum);
  return squares / (set_count * (count - 1)) + of_rays;
}

// Without parts: errors are as large as half differences in the window say.
void UsualErrors::find_by_windows() {
  for (const RayPlan::Window& window : plan_.windows()) {
    double squares = 0;
    double expected = 0;
    for (std::size_t rank = window.front().begin; rank < window.back().end; ++rank) {
      if (of_elements_[rank] == 0) continue;
      of_elements_[rank] =
          usual_error(1, plan_.rays(rank), plan_.share_of(plan_.element_at(rank)));
      squares += square(area(rank) * of_.halves[rank]);
      expected += square(area(rank) * of_elements_[rank]);
    }
    const double more = expected > 0 ? std::sqrt(squares / expected) : 0;
    for (std::size_t rank = window.front().begin; rank < window.back().end; ++rank)
      of_elements_[rank] *= more;
  }
}

void UsualErrors::find_by_parts() {
  static const int reach = static_cast<int>(F("REACH", 6));
  static const int reach2 = static_cast<int>(F("REACH2", 24));
  static const double f0 = F("F0", 8), r0 = F("R0", .5), f1 = F("F1", 5);
  std::vector<Known> more(plan_.size());
  for (const RayPlan::Window& window : plan_.windows()) {
    std::vector<Known> scatter;
    for (const RayPlan::Block& block : window) {
      const std::size_t count = part_count(plan_, block);
      for (std::size_t rank = block.begin; rank < block.end; ++rank) {
        scatter.push_back({square_of_parts(rank) * power_of_rays(1.0 * plan_.rays(rank) / count), of_elements_[rank] == 0 ? 0 : 1.0 * set_count * (count - 1)});
      }
    }
    const std::vector<double> usual = nearby(scatter, reach, {});
    for (std::size_t k = 0; k < usual.size(); ++k) {
      const std::size_t rank = window.front().begin + k;
      of_elements_[rank] *= std::sqrt(usual[k] / power_of_rays(plan_.rays(rank)));
      if (of_elements_[rank] > 0) more[rank] = {std::min(square(of_.halves[rank] / of_elements_[rank]), F("CAP", 25)), 1};
    }
  }
  const double everywhere = mean_of(more, {r0, f0});
  for (const RayPlan::Window& window : plan_.windows()) {
    const std::size_t begin = window.front().begin;
    const std::vector<double> here = nearby(std::span(more).subspan(begin, window.back().end - begin), reach2, {everywhere, f1});
    for (std::size_t k = 0; k < here.size(); ++k) of_elements_[begin + k] *= std::sqrt(here[k]);
  }
}

void UsualErrors::find_blocks() {
  static const int reach = static_cast<int>(F("REACHB", 3));
  static const double g0 = F("G0", 8), q0 = F("Q0", 1), g1 = F("G1", 4);
  const auto sum_of_squares = [&](const RayPlan::Block& block) {
    double squares = 0;
    for (std::size_t rank = block.begin; rank < block.end; ++rank)
      squares += square(area(rank) * of_elements_[rank]);
    return squares;
  };
  const auto whole_of = [&](const RayPlan::Block& block) {
    double sum = 0;
    for (std::size_t rank = block.begin; rank < block.end; ++rank)
      if (of_elements_[rank] > 0) sum += area(rank) * of_.halves[rank];
    return sum;
  };
  std::vector<Known> more;
  std::vector<Known> all;
  std::vector<std::vector<Known>> of_windows;
  for (const RayPlan::Window& window : plan_.windows()) {
    std::vector<Known>& shares = of_windows.emplace_back();
    for (const RayPlan::Block& block : window) {
      const double usual = sum_of_squares(block);
      if (of_.parts.empty()) {
        const double sum = whole_of(block);
        shares.push_back({usual > 0 ? square(sum) / usual : 0, usual > 0 ? 1.0 : 0.0});
      } else {
        double of_elements = 0;
        for (std::size_t rank = block.begin; rank < block.end; ++rank)
          if (of_elements_[rank] > 0) of_elements += square(area(rank)) * square_of_parts(rank);
        const double freedom = 1.0 * set_count * (part_count(plan_, block) - 1);
        shares.push_back({of_elements > 0 ? square_of_parts(block) / of_elements : 0, of_elements > 0 ? freedom : 0.0});
      }
      all.push_back(shares.back());
    }
  }
  const Known everywhere{mean_of(all, {0.7, g1}), g1};
  std::size_t w = 0;
  for (const RayPlan::Window& window : plan_.windows()) {
    const std::vector<double> shares = of_.parts.empty() ? std::vector<double>(window.size(), mean_of(of_windows[w], {})) : nearby(of_windows[w], reach, everywhere);
    for (std::size_t b = 0; b < window.size(); ++b) {
      const double usual = shares[b] * sum_of_squares(window[b]);
      of_blocks_[window[b].begin] = std::sqrt(usual);
      more.push_back({usual > 0 ? std::min(square(whole_of(window[b])) / usual, F("CAP", 25)) : 0, usual > 0 ? 1.0 : 0.0});
    }
    ++w;
  }
  if (of_.parts.empty()) return;
  static const double g2 = F("G2", 6);
  static const int reachc = static_cast<int>(F("REACHC", 4));
  const double factor = mean_of(more, {q0, g0});
  std::size_t first = 0;
  for (const RayPlan::Window& window : plan_.windows()) {
    const std::vector<double> here = nearby(std::span(more).subspan(first, window.size()), reachc, {factor, g2});
    for (std::size_t b = 0; b < window.size(); ++b) of_blocks_[window[b].begin] *= std::sqrt(here[b]);
    first += window.size();
  }
}

double UsualErrors::of_all() const {
  double squares = 0;
  for (const double each : of_blocks_) squares += square(each);
  return std::sqrt(squares);
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
      const double wanted =
          sizes.of_wholes * whole.usual * wholes_[source.begin].times_usual;
      // What a sum tells of an element goes with its part in the variance of the sum.
      const double rest = (wanted - drawn) / whole.squares;
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

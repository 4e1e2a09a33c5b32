#include "flux/radiosity.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 512;  // elements

// Each changes the flux by about a tenth of what the one before did.
constexpr int most_slope_solves = 20;
constexpr double share_of_change = 0.1;

// What planes change by much more, the constants they start from need not tell.
constexpr double tolerance_of_start = 1e-2;

// What planes change is known well enough by constants of this.
constexpr double tolerance_of_constants = 1e-4;

// Of the root of an element's area: how far its ends are from its middle.
constexpr double reach_of_root = 1.0;

// Of x from y, relative, in the root mean square.
double change_of(std::span<const double> x, std::span<const double> y) {
  double apart = 0;
  double size = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    apart += (x[k] - y[k]) * (x[k] - y[k]);
    size += x[k] * x[k];
  }
  return apart > 0 ? std::sqrt(apart / size) : 0;
}

}  // namespace

Radiosity::Radiosity(const RayPlan& plan, const FacetValues& values, const View& view,
                     std::span<const float> reemitted, std::span<const double> emission,
                     const ExchangeSolver& exchange, std::vector<double> first)
    : plan_(plan),
      values_(values),
      view_(view),
      reemitted_(reemitted),
      emission_(emission),
      exchange_(exchange),
      first_(std::move(first)),
      slopes_(plan.size()) {}

void Radiosity::solve(double tolerance, std::span<const double> start) {
  if (!start.empty()) {
    flux_.assign(start.begin(), start.end());
  } else if (flux_.empty()) {
    flux_ = exchange_.solve<double>(first_, 1, std::max(tolerance, tolerance_of_start));
  }
  double before = 0;
  for (int k = 0; k < most_slope_solves; ++k) {
    find_slopes();
    std::vector<double> next = exchange_.solve<double>(right_side(), 1, tolerance, flux_);
    std::swap(flux_, next);
    const double change = change_of(flux_, next);
    // What another one would change. The first change is that of the start as well.
    const double share = before > change ? std::max(change / before, share_of_change) : 1;
    if (share * change <= tolerance) break;
    before = change;
  }
  flux_ = seen_of(flux_);
}

void Radiosity::solve_constants() {
  constant_ = exchange_.solve<double>(first_, 1, tolerance_of_constants, flux_);
}

// What elements see of a flux. Of a solution it is one: with the tolerance for each element by
// itself, where the solver keeps that of all together; what sees nothing gets nothing.
std::vector<double> Radiosity::seen_of(std::span<const double> flux) const {
  std::vector<double> seen = right_side();
  parallel_for(seen.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t rank = begin; rank < end; ++rank)
      view_.rows.for_each_part(rank, [&](std::size_t hit, double part) {
        seen[rank] += part * static_cast<double>(reemitted_[hit]) * flux[hit];
      });
  });
  return seen;
}

// Flatter where the plane would go below zero. What is emitted may have steps: it is constant.
void Radiosity::find_slopes() {
  const Elements& elements = plan_.elements();
  parallel_for(plan_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t rank = begin; rank < end; ++rank) {
      const std::uint32_t element = plan_.element_at(rank);
      const Vec3d slope =
          values_.slope(element, [&](std::size_t e) { return reemitted(plan_.rank_of(e)); });
      const double change = length(slope) * reach_of_root * std::sqrt(elements.area(element));
      const double most = std::max(reemitted(rank), 0.0);
      slopes_[rank] = change > most ? (most / change) * slope : slope;
    }
  });
}

std::vector<double> Radiosity::right_side() const {
  std::vector<double> sum = first_;
  const ExchangeRows& rows = view_.rows;
  parallel_for(sum.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t rank = begin; rank < end; ++rank)
      for (std::uint64_t k = rows.first[rank]; k < rows.first[rank + 1]; ++k)
        sum[rank] += dot(Vec3d(view_.moments[k]), slopes_[rows.seen[k].hit]);
  });
  return sum;
}

}  // namespace scarp

#include "flux/engines/radiosity.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 512;  // elements

// Each solve changes the flux by about a tenth of what the one before did.
constexpr double share_of_change = 0.1;

// If slopes have not settled after so many, elements that still change are constants from there on;
// after twice as many all are.
constexpr int solves_to_settle = 8;

// Of the root of an element's area, in spacings: a constant where it is as fine as the grid, where
// planes would change next to nothing, a plane where it is twice as wide. Fine ones have few rays,
// by which two that face each other in a notch may seem to get all of each other's planes.
constexpr double width_of_constants = 1;
constexpr double width_of_planes = 2;

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
      slopes_(plan.size()) {
  for (std::size_t rank = 0; rank < plan.size(); ++rank) {
    const double width = std::sqrt(plan.elements().area(plan.element_at(rank)));
    plane_.push_back(static_cast<float>(std::clamp(
        (width - width_of_constants) / (width_of_planes - width_of_constants), 0.0, 1.0)));
  }
  has_planes_ = std::ranges::any_of(plane_, [](float part) { return part > 0; });
}

void Radiosity::solve(double tolerance, std::span<const double> start) {
  if (!start.empty()) flux_.assign(start.begin(), start.end());
  if (!has_planes_) {
    flux_ = exchange_.solve<double>(first_, 1, tolerance, flux_);
  } else {
    if (flux_.empty())
      flux_ = exchange_.solve<double>(first_, 1, std::max(tolerance, tolerance_of_start));
    solve_planes(tolerance);
  }
  flux_ = seen_of(flux_);
}

void Radiosity::solve_planes(double tolerance) {
  double before = 0;
  for (int k = 0;; ++k) {
    find_slopes();
    std::vector<double> next = exchange_.solve<double>(right_side(), 1, tolerance, flux_);
    std::swap(flux_, next);
    const double change = change_of(flux_, next);
    // What another one would change. The first change is that of the start as well.
    const double share = before > change ? std::max(change / before, share_of_change) : 1;
    if (share * change <= tolerance) return;
    before = change;
    if (k == solves_to_settle) flatten(next, tolerance);
    if (k == 2 * solves_to_settle) flatten(next, 0);
  }
}

// Makes constants of the elements whose flux is not what it was before.
void Radiosity::flatten(std::span<const double> before, double tolerance) {
  for (std::size_t rank = 0; rank < flux_.size(); ++rank)
    if (std::abs(flux_[rank] - before[rank]) >= tolerance * std::abs(flux_[rank])) plane_[rank] = 0;
}

void Radiosity::solve_constants() {
  constant_ =
      has_planes_ ? exchange_.solve<double>(first_, 1, tolerance_of_constants, flux_) : flux_;
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
      const double part = static_cast<double>(plane_[rank]);
      slopes_[rank] = (change > most ? part * most / change : part) * slope;
    }
  });
}

std::vector<double> Radiosity::right_side() const {
  std::vector<double> sum = first_;
  if (!has_planes_) return sum;
  const ExchangeRows& rows = view_.rows;
  parallel_for(sum.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t rank = begin; rank < end; ++rank)
      for (std::uint64_t k = rows.first[rank]; k < rows.first[rank + 1]; ++k)
        sum[rank] += dot(Vec3d(view_.moments[k]), slopes_[rows.seen[k].hit]);
  });
  return sum;
}

}  // namespace scarp

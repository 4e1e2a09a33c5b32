#include "flux/engines/element_flux.h"

#include "core/parallel.h"

namespace scarp {

namespace {

std::vector<float> reemitted_parts(const FluxProblem& problem, const RayPlan& plan) {
  std::vector<float> of_facets;
  for (const float sticking : problem.sticking) of_facets.push_back(1 - sticking);
  return on_elements(plan, of_facets);
}

// What elements emit of their own, by rank.
std::vector<double> emission_of(const FluxProblem& problem, const RayPlan& plan) {
  std::vector<double> emission(plan.size());
  const std::vector<float>& of_facets = problem.species.emission;
  if (of_facets.empty()) return emission;
  for (std::size_t rank = 0; rank < emission.size(); ++rank)
    emission[rank] = plan.elements().mean(
        plan.element_at(rank), [&](std::uint32_t f) { return static_cast<double>(of_facets[f]); });
  return emission;
}

// What every element, by rank, sees of the source and of what elements emit.
std::vector<double> first_flux(const View& view, std::span<const float> direct,
                               std::span<const double> emission) {
  const ExchangeMatrix& matrix = view.matrix;
  std::vector<double> flux(matrix.size());
  parallel_for(matrix.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      double of_source = 0;
      for (std::size_t set = 0; set < set_count; ++set)
        of_source += static_cast<double>(direct[i * set_count + set]);
      double of_elements = 0;
      view.rows.for_each_part(
          i, [&](std::size_t hit, double part) { of_elements += part * emission[hit]; });
      flux[i] = of_source / static_cast<double>(matrix.row(i).size()) + of_elements;
    }
  });
  return flux;
}

}  // namespace

std::vector<float> on_elements(const RayPlan& plan, std::span<const float> of_facets) {
  std::vector<float> values(plan.size());
  for (std::size_t rank = 0; rank < values.size(); ++rank)
    values[rank] = static_cast<float>(plan.elements().mean(
        plan.element_at(rank), [&](std::uint32_t f) { return static_cast<double>(of_facets[f]); }));
  return values;
}

ElementFlux::ElementFlux(const FluxProblem& problem, std::size_t number, const RayPlan& plan,
                         const FacetValues& values, const View& view)
    : problem_(problem),
      number_(number),
      plan_(plan),
      values_(values),
      view_(view),
      reemitted_(reemitted_parts(problem, plan)),
      emission_(emission_of(problem, plan)),
      exchange_(view.rows, reemitted_),
      radiosity_(plan, values, view, reemitted_, emission_, exchange_,
                 first_flux(view, view.direct[number], emission_)) {}

void ElementFlux::solve(double tolerance, std::span<const double> start) {
  radiosity_.solve(tolerance, start);
  on_facets_ =
      std::make_unique<const FacetFlux>(problem_, number_, plan_, values_, view_, by_rank());
}

}  // namespace scarp

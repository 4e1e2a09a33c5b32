#include "flux/rays/problem.h"

#include <vector>

namespace scarp {

double FluxProblem::emitted() const {
  double sum = has_source() ? scene.source_area() : 0;
  for (std::size_t f = 0; f < species.emission.size(); ++f)
    sum += scene.area(f) * static_cast<double>(species.emission[f]);
  return sum;
}

std::optional<double> response_error(const FluxProblem& problem,
                                     const std::function<FluxSpread(std::size_t tally)>& spread) {
  const auto responses = problem.responses();
  if (responses.empty()) return std::nullopt;
  std::vector<FluxSpread> spreads;
  for (std::size_t tally = 0; tally < responses.size(); ++tally) spreads.push_back(spread(tally));
  return response_error(problem.scene, problem.patches, spreads, responses,
                        sum_of_responses(spreads, responses));
}

}  // namespace scarp

#include "models/plasma_ions.h"

#include <algorithm>
#include <string>
#include <utility>

namespace scarp {

std::size_t SharedYields::tally_of(const YieldLaw& law, double shape) {
  std::size_t k = 0;
  while (k < laws_.size() && (laws_[k].amplitude != law.amplitude ||
                              laws_[k].threshold != law.threshold || shapes_[k] != shape))
    ++k;
  if (k == laws_.size()) {
    laws_.push_back(law);
    shapes_.push_back(shape);
  }
  return k + 1;
}

PlasmaIons::PlasmaIons(const RecipeTable& step, const StepScope& scope, const Parameter& flux,
                       std::span<const YieldLaw> yields, std::vector<Species>& species)
    : first_tally_(species.size()), tallies_(1 + yields.size()) {
  const std::vector<RecipeTable> tables = step.tables_or_one("ion");
  for (const RecipeTable& table : tables) {
    flux_.push_back(read_value(table, inner(flux)));
    const std::string number = tables.size() > 1 ? '_' + std::to_string(flux_.size()) : "";
    Species ions = read_ions(table, scope);
    ions.name = "ion" + number;
    for (const YieldLaw& law : yields) {
      ions.yields.push_back(law);
      ions.yields.back().name += number;
    }
    stop_without_yield(ions);
    species.push_back(std::move(ions));
  }
}

double PlasmaIons::rate(std::span<const std::span<const float>> flux, std::size_t tally,
                        std::size_t point) const {
  double sum = 0;
  for (std::size_t i = 0; i < flux_.size(); ++i)
    sum += flux_[i] * std::max(0.0F, flux[first_tally_ + i * tallies_ + tally][point]);
  return sum;
}

}  // namespace scarp

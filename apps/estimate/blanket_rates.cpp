#include "apps/estimate/blanket_rates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "models/open_wafer.h"

namespace scarp {

namespace {

constexpr double per_minute = 60;

std::string rate_text(double speed) {
  const double rate = per_minute * speed;
  // Rounding is no etch.
  constexpr double least = 1e-9;
  if (std::abs(rate) < least) return "0";
  constexpr double many = 10'000;
  return std::abs(rate) < many ? fmt::format("{:+.3g} nm/min", rate)
                               : fmt::format("{:+.3g} um/min", rate / 1000);
}

}  // namespace

const BlanketRate* StepRates::fastest_etched() const {
  const auto fastest = std::ranges::min_element(rates, {}, &BlanketRate::speed);
  return fastest != rates.end() && fastest->speed < 0 ? &*fastest : nullptr;
}

std::optional<double> StepRates::selectivity_to(const BlanketRate& other) const {
  const BlanketRate* const fastest = fastest_etched();
  if (fastest == nullptr || fastest->material == other.material || !(other.speed < 0))
    return std::nullopt;
  return fastest->speed / other.speed;
}

std::vector<StepRates> blanket_rates(std::span<const ProcessStep> steps,
                                     std::size_t material_count) {
  std::vector<StepRates> all;
  std::set<std::string> known;
  for (std::size_t n = 0; n < steps.size(); ++n) {
    const ProcessStep& step = steps[n];
    if (!step.model || !known.insert(step.path).second) continue;
    const std::vector<float> speeds = open_wafer_speeds(*step.model, material_count);
    StepRates rates{.step = n};
    for (const MaterialId material : step.meets)
      rates.rates.push_back({material, static_cast<double>(speeds[material])});
    all.push_back(std::move(rates));
  }
  return all;
}

std::string text_of(const StepRates& rates, const Materials& materials) {
  const auto is_first = [&](const BlanketRate& rate) {
    return rate.speed == rates.rates.front().speed;
  };
  if (rates.rates.size() > 1 && std::ranges::all_of(rates.rates, is_first))
    return "all materials " + rate_text(rates.rates.front().speed);
  std::vector<std::string> speeds;
  std::vector<std::string> selectivities;
  for (const BlanketRate& rate : rates.rates) {
    speeds.push_back(materials[rate.material].name + ' ' + rate_text(rate.speed));
    if (const auto selectivity = rates.selectivity_to(rate))
      selectivities.push_back(fmt::format("{} : {} {:.3g}",
                                          materials[rates.fastest_etched()->material].name,
                                          materials[rate.material].name, *selectivity));
  }
  std::string text = fmt::format("{}", fmt::join(speeds, ", "));
  if (!selectivities.empty()) text += fmt::format("; {}", fmt::join(selectivities, ", "));
  return text;
}

}  // namespace scarp

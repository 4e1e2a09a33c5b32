#include "apps/estimate/blanket_rates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>
#include <utility>

#include "core/plain_number.h"
#include "models/open_wafer.h"

namespace scarp {

namespace {

constexpr double per_minute = 60;
constexpr int digits = 3;

std::string rate_text(double speed) {
  const double rate = per_minute * speed;
  // Rounding is no etch.
  constexpr double least = 1e-9;
  if (std::abs(rate) < least) return "0";
  constexpr double many = 10'000;
  const std::string sign = rate > 0 ? "+" : "";
  return sign + (std::abs(rate) < many ? plain_number(rate, digits) + " nm/min"
                                       : plain_number(rate / 1000, digits) + " um/min");
}

// The outermost table of a recipe that a step stands in.
std::string_view outermost(std::string_view path) { return path.substr(0, path.find('.')); }

// What the wafer is made of as steps go on. What a step or its repeat grows joins it once that is
// over, unless it stays on what is etched meanwhile.
class Films {
 public:
  explicit Films(std::vector<MaterialId> start) : films_(std::move(start)) {}

  /// Before a step.
  const std::vector<MaterialId>& at(const ProcessStep& step) {
    const std::string_view table = outermost(step.path);
    if (std::exchange(table_, table) != table) {
      films_.insert(films_.end(), grown_.begin(), grown_.end());
      grown_.clear();
    }
    return films_;
  }

  void add_deposit(const ProcessStep& step, std::span<const float> open_wafer_speeds) {
    const bool etches = std::ranges::any_of(open_wafer_speeds, [](float v) { return v < 0; });
    if (step.deposits && !etches) (step.model ? grown_ : films_).push_back(*step.deposits);
  }

 private:
  std::vector<MaterialId> films_;
  std::vector<MaterialId> grown_;
  std::string_view table_;
};

}  // namespace

bool StepRates::is_film(const BlanketRate& rate) const {
  return std::ranges::find(films, rate.material) != films.end();
}

const BlanketRate* StepRates::fastest_etched() const {
  const BlanketRate* fastest = nullptr;
  for (const BlanketRate& rate : rates)
    if (is_film(rate) && rate.speed < (fastest == nullptr ? 0 : fastest->speed)) fastest = &rate;
  return fastest;
}

std::optional<double> StepRates::selectivity_to(const BlanketRate& other) const {
  const BlanketRate* const fastest = fastest_etched();
  if (fastest == nullptr || fastest->material == other.material || !is_film(other) ||
      !(other.speed < 0))
    return std::nullopt;
  return fastest->speed / other.speed;
}

std::vector<StepRates> blanket_rates(const Recipe& recipe) {
  std::vector<StepRates> all;
  std::set<std::string> known;
  Films films(recipe.start.materials);
  for (std::size_t n = 0; n < recipe.steps.size(); ++n) {
    const ProcessStep& step = recipe.steps[n];
    if (!known.insert(step.path).second) continue;
    StepRates rates{.step = n, .rates = {}, .films = films.at(step)};
    std::vector<float> speeds;
    if (step.model) speeds = open_wafer_speeds(*step.model, recipe.materials.size());
    films.add_deposit(step, speeds);
    if (!step.model) continue;
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
      selectivities.push_back(
          fmt::format("{} : {} {}", materials[rates.fastest_etched()->material].name,
                      materials[rate.material].name, plain_number(*selectivity, digits)));
  }
  std::string text = fmt::format("{}", fmt::join(speeds, ", "));
  if (!selectivities.empty()) text += fmt::format("; {}", fmt::join(selectivities, ", "));
  return text;
}

}  // namespace scarp

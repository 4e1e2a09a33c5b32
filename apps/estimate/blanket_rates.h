#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/simulator/recipe.h"

namespace scarp {

/// How fast a step moves an open flat wafer of one material. Units: nm/s, > 0 grows.
struct BlanketRate {
  MaterialId material = 0;
  double speed = 0;
};

/// Those of the materials that a step can meet.
struct StepRates {
  std::size_t step = 0;
  std::vector<BlanketRate> rates{};
  /// Those of them that the wafer is made of: not polymers and the like, which the step, its repeat
  /// or another etch deposits.
  std::vector<MaterialId> films{};

  /// How many times faster the fastest etched film is etched than this one; nothing where one of
  /// them is no film or not etched, or for that film itself.
  std::optional<double> selectivity_to(const BlanketRate& other) const;
  /// That film; null where none is etched.
  const BlanketRate* fastest_etched() const;

 private:
  bool is_film(const BlanketRate& rate) const;
};

/// Of steps that have a model, repeated ones once.
std::vector<StepRates> blanket_rates(const Recipe& recipe);

/// As "SiO2 -200 nm/min, resist -40 nm/min; SiO2 : resist 5".
std::string text_of(const StepRates& rates, const Materials& materials);

}  // namespace scarp

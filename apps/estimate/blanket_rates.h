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

  /// How many times faster the fastest etched material is etched than this one; nothing where
  /// either is not etched, or for that material itself.
  std::optional<double> selectivity_to(const BlanketRate& other) const;
  /// That material; null where nothing is etched.
  const BlanketRate* fastest_etched() const;
};

/// Of steps that have a model, repeated ones once.
std::vector<StepRates> blanket_rates(std::span<const ProcessStep> steps,
                                     std::size_t material_count);

/// As "SiO2 -200 nm/min, resist -40 nm/min; SiO2 : resist 5".
std::string text_of(const StepRates& rates, const Materials& materials);

}  // namespace scarp

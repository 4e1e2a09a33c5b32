#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "flux/sampling/polar_density.h"

namespace scarp::exact {

/// A table of a density per solid angle over the polar angle, in steps of a quarter of a degree.
inline PolarDensity polar_table(const std::function<double(double theta)>& density) {
  constexpr int steps = 360;
  std::vector<double> theta;
  std::vector<double> values;
  for (int k = 0; k <= steps; ++k) {
    theta.push_back(std::numbers::pi / 2 * k / steps);
    values.push_back(std::max(0.0, density(theta.back())));
  }
  return {theta, values};
}

inline PolarDensity power_cosine_table(double power) {
  return polar_table([power](double theta) { return std::pow(std::cos(theta), power); });
}

/// The mean of a function of the polar angle over directions of a density per solid angle.
inline double polar_mean(const std::function<double(double theta)>& density,
                         const std::function<double(double theta)>& function) {
  constexpr int steps = 100'000;
  double sum = 0;
  double norm = 0;
  for (int k = 0; k < steps; ++k) {
    const double theta = std::numbers::pi / 2 * (k + 0.5) / steps;
    const double weight = density(theta) * std::sin(theta);
    norm += weight;
    sum += weight * function(theta);
  }
  return sum / norm;
}

}  // namespace scarp::exact

#pragma once

#include <cmath>
#include <numbers>

#include "flux/solve.h"
#include "tests/flux/shapes.h"

namespace scarp::exact {

inline constexpr double degree = std::numbers::pi / 180;
inline constexpr double right_angle = 90 * degree;

inline FluxField trace(const Shape& shape, const Species& species, FluxOptions options) {
  options.sides.lower = shape.sides.lower;
  options.sides.upper = shape.sides.upper;
  options.spacing = 1;
  return solve_flux(shape.mesh, {&species, 1}, options).front();
}

/// Mean of a tally over the facets that are taken, by area; the error as if facets were
/// independent.
struct Mean {
  double value = 0;
  double error = 0;
};

template <class Taken>
Mean mean_of(const TriMesh& mesh, const Tally& tally, const Taken& taken) {
  const std::vector<double> areas = facet_areas(mesh);
  Mean mean;
  double area = 0;
  for (std::size_t f = 0; f < areas.size(); ++f) {
    const auto [a, b, c] = corners(mesh, f);
    if (!taken((a + b + c) / 3.0)) continue;
    mean.value += areas[f] * tally.mean[f];
    mean.error += std::pow(areas[f] * tally.std_error[f], 2);
    area += areas[f];
  }
  return {mean.value / area, std::sqrt(mean.error) / area};
}

inline bool everywhere(Vec3d) { return true; }

inline const YieldLaw sputter{.name = "sputter",
                              .amplitude = 0.5,
                              .threshold = 25,
                              .factor = AngleTable([](double theta) {
                                return std::cos(theta) * (1 + 9.3 * std::pow(std::sin(theta), 2));
                              })};

inline Species plasma_ions() {
  return {.name = "ion",
          .source = {.cosine_power = 50},
          .ions = Ions{.energy = EnergyDistribution::gaussian(100, 10),
                       .sticking = sticking_between(70 * degree, 90 * degree),
                       .cone = reflection_cone(80 * degree),
                       .energy_kept = kept_energy(89 * degree, 10),
                       .energy_deviation = 0.1,
                       .least_energy = 10},
          .yields = {sputter}};
}

}  // namespace scarp::exact

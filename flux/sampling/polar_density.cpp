#include "flux/sampling/polar_density.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/error.h"

namespace scarp {

namespace {

constexpr double right_angle = std::numbers::pi / 2;
constexpr int least_pieces = 8;
constexpr double longest_piece = right_angle / 180;

// Linear in the angle is bent in 1 - cos(theta), so every interval is cut into pieces. Rounded to
// single precision, in which all versions of the C library agree.
double height_of_cap(double theta) {
  const double sine = std::sin(theta / 2);
  return static_cast<float>(std::min(2 * sine * sine, 1.0));
}

LinearDensity by_height_of_cap(std::span<const double> theta, std::span<const double> density) {
  const LinearDensity checked(theta, density);
  if (theta.front() < 0 || theta.back() > right_angle * (1 + 1e-12))
    throw InputError("the angles of a distribution have to lie between 0 and 90 deg");
  std::vector<double> height{height_of_cap(theta[0])};
  std::vector<double> values{density[0]};
  for (std::size_t k = 1; k < theta.size(); ++k) {
    const double width = theta[k] - theta[k - 1];
    const int pieces = std::max(least_pieces, static_cast<int>(std::ceil(width / longest_piece)));
    for (int i = 1; i <= pieces; ++i) {
      const double part = static_cast<double>(i) / pieces;
      const double x = height_of_cap(theta[k - 1] + part * width);
      if (x > height.back()) {
        height.push_back(x);
        values.push_back(density[k - 1]);
      }
      values.back() = density[k - 1] + part * (density[k] - density[k - 1]);
    }
  }
  return {height, values};
}

}  // namespace

PolarDensity::PolarDensity(std::span<const double> theta, std::span<const double> density)
    : density_(by_height_of_cap(theta, density)) {}

double PolarDensity::at(double cosine) const {
  return density_.at(1 - cosine) / (2 * std::numbers::pi);
}

}  // namespace scarp

#include "core/angular_factor.h"

namespace scarp {

BeamResponse::BeamResponse(Vec3d direction, const std::function<double(double)>& response)
    : direction_(direction), table_(interval_count + 1) {
  for (int n = 0; n <= interval_count; ++n) {
    table_[static_cast<std::size_t>(n)] =
        static_cast<float>(response(static_cast<double>(n) / interval_count));
  }
}

CrystalRates::CrystalRates(const Values& rates, const std::array<Vec3d, 3>& axes)
    : axes_{Vec3f(axes[0]), Vec3f(axes[1]), Vec3f(axes[2])},
      near_110_(
          Vec3d{rates.r100, rates.r110 - rates.r100, 3 * rates.r311 - rates.r110 - 2 * rates.r100}),
      near_111_(Vec3d{1.5 * rates.r311 - 0.5 * rates.r111,
                      rates.r110 + 0.5 * rates.r111 - 1.5 * rates.r311, rates.r111 - rates.r110}) {}

void AngularFactor::find_bounds() {
  // The surface of a cube of directions.
  constexpr int half = 48;
  const auto include = [&](Vec3d direction) {
    const AngularRate at = rate(Vec3f(normalized(direction)));
    const double slopes =
        static_cast<double>(std::abs(at.slope.x)) + std::abs(at.slope.y) + std::abs(at.slope.z);
    bounds_.value = std::max(bounds_.value, std::abs(static_cast<double>(at.value)));
    bounds_.slopes = std::max(bounds_.slopes, slopes);
  };
  for (int a = -half; a <= half; ++a) {
    for (int b = -half; b <= half; ++b) {
      for (const int side : {-half, half}) {
        include({1.0 * a, 1.0 * b, 1.0 * side});
        include({1.0 * a, 1.0 * side, 1.0 * b});
        include({1.0 * side, 1.0 * a, 1.0 * b});
      }
    }
  }
}

double AngularFactor::limiting_speed() const {
  // A constant speed has slopes up to the square root of 3.
  return std::max(bounds_.value, bounds_.slopes / std::sqrt(3.0));
}

}  // namespace scarp

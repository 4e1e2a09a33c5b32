#include "core/angular_factor.h"

#include <algorithm>
#include <numbers>

#include "core/error.h"

namespace scarp {

BeamResponse::BeamResponse(Vec3d direction, const std::function<double(double)>& response)
    : direction_(direction), table_(interval_count + 1) {
  for (int n = 0; n <= interval_count; ++n) {
    table_[static_cast<std::size_t>(n)] =
        static_cast<float>(response(static_cast<double>(n) / interval_count));
  }
}

// On both sides of each bend.
std::vector<float> SlopeResponse::places() const {
  constexpr float beside = 1e-4F;
  std::vector<float> cosines;
  for (const float bend : {below_, at_, above_}) {
    for (const float cosine : {bend - beside, bend + beside})
      if (cosine > 0 && cosine < 1) cosines.push_back(cosine);
  }
  cosines.push_back(0.5F * (at_ + std::max(below_, 0.0F)));
  return cosines;
}

CrystalRates::CrystalRates(const Values& rates, const std::array<Vec3d, 3>& axes)
    : axes_{Vec3f(axes[0]), Vec3f(axes[1]), Vec3f(axes[2])},
      near_110_(
          Vec3d{rates.r100, rates.r110 - rates.r100, 3 * rates.r311 - rates.r110 - 2 * rates.r100}),
      near_111_(Vec3d{1.5 * rates.r311 - 0.5 * rates.r111,
                      rates.r110 + 0.5 * rates.r111 - 1.5 * rates.r311, rates.r111 - rates.r110}) {}

CrystalRates::Creases CrystalRates::creases(Vec3f p, int axis) const {
  p[axis] = 0;
  std::array<float, 3> start{};
  std::array<float, 3> turn{};
  for (std::size_t n = 0; n < 3; ++n) {
    start[n] = dot(axes_[n], p);
    turn[n] = axes_[n][axis];
  }
  Creases found;
  const auto add_zero = [&](float at_start, float rise) {
    constexpr float least_rise = 1e-4F;
    if (std::abs(rise) > least_rise) found.at[found.count++] = -at_start / rise;
  };
  for (std::size_t n = 0; n < 3; ++n) {
    const std::size_t next = (n + 1) % 3;
    add_zero(start[n], turn[n]);
    add_zero(start[n] - start[next], turn[n] - turn[next]);
    add_zero(start[n] + start[next], turn[n] + turn[next]);
  }
  return found;
}

void AngularFactor::find_bounds() {
  // The surface of a cube of directions.
  constexpr int half = 48;
  visit([this](const auto& kind) {
    const auto include = [&](Vec3d direction) {
      const AngularRate at = rate_of(kind, Vec3f(normalized(direction)));
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
  });
}

LimitingSpeed::LimitingSpeed(std::span<const AngularFactor> factors) {
  for (std::size_t first = 0; first < factors.size();) {
    Group& group = groups_.emplace_back(Group{.first = first});
    if (factors[first].between_slopes() == nullptr) {
      // The derivatives by x, y and z add up; those of a constant speed to up to this.
      const AngularFactor::Bounds& bounds = factors[first].bounds();
      group.limit = static_cast<float>(std::max(bounds.value, bounds.slopes / std::sqrt(3.0)));
      ++first;
      continue;
    }
    const std::optional<Vec3f> axis = factors[first].axis();
    std::size_t end = first;
    std::vector<float> cosines;
    for (; end < factors.size() && factors[end].axis() == axis; ++end) {
      const SlopeResponse* slopes = factors[end].between_slopes();
      if (slopes == nullptr) break;
      const std::vector<float> places = slopes->places();
      cosines.insert(cosines.end(), places.begin(), places.end());
    }
    std::ranges::sort(cosines);
    cosines.erase(std::unique(cosines.begin(), cosines.end()), cosines.end());
    SCARP_ASSERT(cosines.size(), <=, most_places);
    group.count = cosines.size();
    for (; first < end; ++first) group.factors.push_back(sampled(factors[first], *axis, cosines));
  }
}

LimitingSpeed::Sampled LimitingSpeed::sampled(const AngularFactor& factor, Vec3f axis,
                                              std::span<const float> cosines) {
  // How much the components of a vector along the axis, and of one across it, add up to at most.
  const bool is_vertical = factor.is_vertical();
  const float along = (std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z)) / std::sqrt(3.0F);
  const float across = is_vertical ? std::sqrt(2.0F / 3.0F) : 1.0F;
  const Vec3f other = std::abs(axis.x) < 0.5F ? Vec3f{1, 0, 0} : Vec3f{0, 1, 0};
  const Vec3f side = normalized(other - dot(other, axis) * axis);
  Sampled result;
  for (std::size_t n = 0; n < cosines.size(); ++n) {
    const float sine = std::sqrt(std::max(1 - cosines[n] * cosines[n], 0.0F));
    const AngularRate rate = factor.rate(sine * side - cosines[n] * axis);
    result.value[n] = rate.value;
    result.across[n] = across * dot(rate.slope, side);
    result.along[n] = along * dot(rate.slope, axis);
  }
  return result;
}

}  // namespace scarp

#include "models/lobe_response.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace scarp {

namespace {

// The slopes for which the model is asked, by their cosine to the axis: 0, 26, 41, 60, 71, 80 and
// 88 degrees. The steep ones are those of the foot of a wall; from 60 degrees on the yields of many
// ions fall off.
constexpr std::array<float, lobe_factor_count> slopes{1, 0.9F, 0.75F, 0.5F, 0.33F, 0.17F, 0.04F};
using AtSlopes = std::array<float, lobe_factor_count>;

// Below this cosine nothing is known of how a speed turns.
constexpr float grazing = 1e-4F;

std::vector<std::size_t> tallies_of(const Lobe& lobe) {
  std::vector<std::size_t> tallies;
  for (const LobeTally& each : lobe.tallies) tallies.push_back(each.tally);
  return tallies;
}

std::vector<float> cosines_to(Vec3d direction, std::span<const Vec3f> normals) {
  std::vector<float> cosines;
  for (const Vec3f& normal : normals) cosines.push_back(-dot(Vec3f(direction), normal));
  return cosines;
}

// What a surface at a cosine to the axis gets of a tally if all of it comes straight.
double response(const LobeTally& tally, float cosine) {
  const double yield =
      tally.yield ? tally.yield->at(AngleTable::half_sine(static_cast<double>(cosine))) : 1;
  return yield * static_cast<double>(cosine);
}

// What points would get of a tally if they met the lobe head on, but for the yield.
std::vector<float> flux_at_normal(const LobeTally& tally, std::span<const float> flux,
                                  std::span<const float> cosines) {
  std::vector<float> bright(flux.size());
  for (std::size_t p = 0; p < flux.size(); ++p) {
    if (!(cosines[p] > grazing)) continue;
    const double here = response(tally, std::hypot(cosines[p], tally.along));
    if (here > 0) bright[p] = flux[p] / static_cast<float>(here);
  }
  return bright;
}

// What there would be of the speeds because of a lobe at the slopes. Shape: an entry per point.
std::vector<AtSlopes> contribution_at_slopes(const SpeedQuestion& question, const Lobe& lobe,
                                             std::span<const float> cosines,
                                             const std::vector<bool>& apart,
                                             std::span<const float> contribution) {
  std::vector<std::vector<float>> bright;
  for (const LobeTally& tally : lobe.tallies)
    bright.push_back(flux_at_normal(tally, question.flux[tally.tally], cosines));
  std::vector<AtSlopes> result(cosines.size());
  for (std::size_t k = 0; k < slopes.size(); ++k) {
    std::vector<float> of_slope;
    for (const LobeTally& tally : lobe.tallies)
      of_slope.push_back(static_cast<float>(response(tally, slopes[k])));
    const std::vector<float> lost = question.loss_with(
        [&](std::size_t n, std::size_t p) {
          const LobeTally& tally = lobe.tallies[n];
          return tally.is_peaked && apart[p] ? question.flux[tally.tally][p]
                                             : of_slope[n] * bright[n][p];
        },
        tallies_of(lobe));
    for (std::size_t p = 0; p < result.size(); ++p) result[p][k] = contribution[p] - lost[p];
  }
  return result;
}

// Of a point, for each slope by its cosine. here is what the factors come to at its own normal.
AtSlopes slope_amplitudes(const AtSlopes& at_slopes, const AtSlopes& here, float contribution,
                          float angular) {
  constexpr float most_more = 2;  // than the slopes say; what is more does not turn
  AtSlopes amplitudes{};
  float sum = 0;
  for (std::size_t k = 0; k < slopes.size(); ++k) {
    // A model may have nothing to say of a slope that nothing arrives at.
    const bool is_known = std::isfinite(at_slopes[k]) && at_slopes[k] * contribution > 0;
    if (is_known) amplitudes[k] = at_slopes[k] / slopes[k];
    sum += amplitudes[k] * here[k];
  }
  if (!(sum * contribution > 0)) return {};
  const float scale = std::min(contribution / sum, most_more) * (angular / contribution);
  for (float& each : amplitudes) each *= scale;
  return amplitudes;
}

// Where the lobe only grazes a surface much was reflected elsewhere, and turns less than what comes
// straight: by no more than where it meets the surface, or the time steps would be short.
void bound_grazed(std::span<const float> cosines, std::span<const float> angular,
                  std::vector<AtSlopes>& amplitudes) {
  constexpr float meets = 0.7F;  // of the cosine where it meets the surface best
  const auto steepest = [](const AtSlopes& of_point) {
    float most = 0;
    for (const float each : of_point) most = std::max(most, std::abs(each));
    return most;
  };
  float best = grazing;
  float most_angular = 0;
  for (std::size_t p = 0; p < amplitudes.size(); ++p) {
    if (angular[p] != 0) best = std::max(best, cosines[p]);
    most_angular = std::max(most_angular, std::abs(angular[p]));
  }
  const float head_on = most_angular / best;
  float bound = 0;
  for (std::size_t p = 0; p < amplitudes.size(); ++p)
    if (cosines[p] > meets * best) bound = std::max(bound, steepest(amplitudes[p]));
  if (bound == 0) bound = head_on;
  for (AtSlopes& of_point : amplitudes) {
    const float part =
        std::min({1.0F, bound / steepest(of_point), head_on / std::abs(of_point[0])});
    for (float& each : of_point) each *= part;
  }
}

}  // namespace

float arrivals_along(const SourceLobe& source) {
  constexpr std::uint32_t direction_count = 1 << 10;
  const Vec3d axis = source.direction;
  const Vec3d other = std::abs(axis.x) < 0.5 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  const Vec3d side = normalized(other - dot(other, axis) * axis);
  const Vec3d third = cross(axis, side);
  double along = 0;
  double across = 0;
  for (const Vec3d& u : lobe_directions(source, direction_count)) {
    // Those of particles that cross the plane of the source. Half of them meet each side.
    along += (std::abs(dot(u, side)) + std::abs(dot(u, third))) / (4 * -u.z);
    across += dot(u, axis) / -u.z;
  }
  return static_cast<float>(along / across);
}

std::vector<AngularFactor> lobe_factors(Vec3d direction) {
  std::vector<AngularFactor> factors;
  for (std::size_t k = 0; k < slopes.size(); ++k)
    factors.push_back(SlopeResponse(direction, k + 1 < slopes.size() ? slopes[k + 1] : -1.0F,
                                    slopes[k], k > 0 ? slopes[k - 1] : 2.0F));
  return factors;
}

std::vector<float> contribution_of_lobe(const SpeedQuestion& question, const Lobe& lobe,
                                        const std::vector<bool>& apart) {
  // Of nothing at all a model may say 0 / 0.
  constexpr float next_to_nothing = 1e-6F;
  const std::vector<std::size_t> tallies = tallies_of(lobe);
  const auto loss = [&](float left) {
    return question.loss_with(
        [&](std::size_t n, std::size_t p) {
          const float all = question.flux[tallies[n]][p];
          return lobe.tallies[n].is_peaked && apart[p] ? all : left * all;
        },
        tallies);
  };
  std::vector<float> contribution = loss(0);
  const auto is_known = [](float speed) { return std::isfinite(speed); };
  if (std::ranges::all_of(contribution, is_known)) return contribution;
  const std::vector<float> nearly = loss(next_to_nothing);
  for (std::size_t p = 0; p < contribution.size(); ++p)
    if (!is_known(contribution[p])) contribution[p] = is_known(nearly[p]) ? nearly[p] : 0;
  return contribution;
}

std::vector<std::vector<float>> lobe_amplitudes(const SpeedQuestion& question, const Lobe& lobe,
                                                std::span<const AngularFactor> factors,
                                                const std::vector<bool>& apart,
                                                std::span<const float> contribution,
                                                std::span<const float> angular,
                                                std::vector<float>& rest) {
  constexpr float rounding = 1e-5F;
  const std::size_t count = angular.size();
  const std::vector<float> cosines = cosines_to(lobe.direction, question.points.normal);
  const std::vector<AtSlopes> at_slopes =
      contribution_at_slopes(question, lobe, cosines, apart, contribution);
  std::vector<AtSlopes> found(count);
  std::vector<AtSlopes> here(count);
  for (std::size_t p = 0; p < count; ++p) {
    if (!(cosines[p] > grazing) || angular[p] == 0) continue;
    for (std::size_t k = 0; k < slopes.size(); ++k)
      here[p][k] = factors[k].value(question.points.normal[p]);
    found[p] = slope_amplitudes(at_slopes[p], here[p], contribution[p], angular[p]);
  }
  bound_grazed(cosines, angular, found);
  std::vector<std::vector<float>> amplitudes(factors.size(), std::vector<float>(count));
  for (std::size_t p = 0; p < count; ++p) {
    float taken = 0;
    for (std::size_t k = 0; k < slopes.size(); ++k) {
      amplitudes[k][p] = found[p][k];
      taken += found[p][k] * here[p][k];
    }
    rest[p] -= taken;
    if (std::abs(rest[p]) <= rounding * std::abs(angular[p])) rest[p] = 0;
  }
  return amplitudes;
}

}  // namespace scarp

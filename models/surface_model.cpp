#include "models/surface_model.h"

#include <algorithm>
#include <cmath>

#include "flux/source_lobe.h"

namespace scarp {

namespace {

// Particles that come from about one direction, of one or more species.
struct Lobe {
  Vec3d direction;
  std::vector<std::size_t> tallies;
};

// Half of the particles within 15 degrees of the axis. Models of beams know better themselves.
bool is_narrow(const SourceLobe& source) {
  constexpr double least_cosine = 0.966;
  constexpr double least_power = 19;
  if (source.rotating || source.kind != SourceLobe::Kind::cosine) return false;
  return source.table.empty() ? source.cosine_power >= least_power
                              : source.table.cosine(0.5) >= least_cosine;
}

std::vector<Lobe> lobes_of(const SurfaceModel& model) {
  std::vector<Lobe> lobes;
  std::size_t tally = 0;
  for (const Species& species : model.species()) {
    const std::size_t end = tally + 1 + species.yields.size();
    if (is_narrow(species.source)) {
      const Vec3d direction = species.source.direction;
      auto lobe = std::ranges::find(lobes, direction, &Lobe::direction);
      if (lobe == lobes.end()) lobe = lobes.insert(lobe, {.direction = direction, .tallies = {}});
      for (std::size_t t = tally; t < end; ++t) lobe->tallies.push_back(t);
    }
    tally = end;
  }
  return lobes;
}

// The speeds if a lobe brought a part less.
std::vector<float> speeds_with_less(float less, const Lobe& lobe, const SurfaceModel& model,
                                    const SurfacePoints& points,
                                    std::span<const std::span<const float>> flux) {
  std::vector<std::vector<float>> weaker;
  std::vector<std::span<const float>> views(flux.begin(), flux.end());
  weaker.reserve(lobe.tallies.size());
  for (const std::size_t t : lobe.tallies) {
    std::vector<float>& tally = weaker.emplace_back(flux[t].begin(), flux[t].end());
    for (float& value : tally) value *= 1 - less;
    views[t] = tally;
  }
  return model.speeds(points, views);
}

// What the speeds of points owe to a lobe.
struct Owed {
  std::vector<float> rise;  ///< by how much each changes with the logarithm of all that it brings
  std::vector<float> all;   ///< what there would not be without it
};

Owed owed_to(const Lobe& lobe, const SurfaceModel& model, const SurfacePoints& points,
             std::span<const std::span<const float>> flux, std::span<const float> speeds) {
  constexpr float less = 0.01F;
  Owed owed{.rise = speeds_with_less(less, lobe, model, points, flux),
            .all = speeds_with_less(1, lobe, model, points, flux)};
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    owed.rise[p] = (speeds[p] - owed.rise[p]) / less;
    owed.all[p] = speeds[p] - owed.all[p];
  }
  return owed;
}

// The powers of the cosine to the axis by which a speed turns with the normal: with both, and a
// part that does not turn, it can follow any response up to the higher power, and has one sign.
constexpr float higher_power = 3;
float higher(float cosine) { return cosine * cosine * cosine; }

struct Turning {
  float linear = 0;
  float higher = 0;
};

// Of a speed, what turns with the normal: what changes at once with what the lobe brings, or more.
// A surface along the lobe gets none of it: that a floor goes on nearly as fast with fewer ions
// says nothing of the walls that it leaves behind, which ions alone may etch.
Turning turning_part(float speed, float rise, float all) {
  const bool saturates =
      all * speed > 0 && std::abs(all) <= std::abs(speed) && std::abs(rise) < std::abs(all);
  if (saturates) return {.linear = all};
  if (rise * speed <= 0 || std::abs(rise) <= std::abs(speed)) return {.linear = rise};
  const float part = std::min((rise / speed - 1) / (higher_power - 1), 1.0F);
  return {.linear = (1 - part) * speed, .higher = part * speed};
}

}  // namespace

std::vector<AngularFactor> SurfaceModel::angular_factors() const {
  std::vector<AngularFactor> factors;
  for (const Lobe& lobe : lobes_of(*this)) {
    factors.push_back(CubicResponse(lobe.direction, 1, 0));
    factors.push_back(CubicResponse(lobe.direction, 0, 1));
  }
  return factors;
}

// A narrow lobe brings by the cosine what it brings straight. Where it only grazes the surface most
// was reflected elsewhere: that turns with the normal at most as what meets a surface head on. More
// would shorten the time step.
std::vector<std::vector<float>> SurfaceModel::amplitudes(
    const SurfacePoints& points, std::span<const std::span<const float>> flux) const {
  constexpr float grazing = 1e-4F;
  std::vector<std::vector<float>> parts{speeds(points, flux)};
  const std::vector<float> whole = parts.front();
  for (const Lobe& lobe : lobes_of(*this)) {
    const Owed owed = owed_to(lobe, *this, points, flux, whole);
    std::vector<Turning> turning(whole.size());
    float most = 0;
    for (std::size_t p = 0; p < whole.size(); ++p) {
      turning[p] = turning_part(whole[p], owed.rise[p], owed.all[p]);
      most = std::max(most, std::abs(turning[p].linear + turning[p].higher));
    }
    const Vec3f direction(lobe.direction);
    std::vector<float> linear(whole.size());
    std::vector<float> high(whole.size());
    for (std::size_t p = 0; p < whole.size(); ++p) {
      const float cosine = -dot(direction, points.normal[p]);
      if (!(cosine > grazing)) continue;
      linear[p] = turning[p].linear / cosine;
      high[p] = turning[p].higher / higher(cosine);
      const float head_on = std::abs(linear[p] + high[p]);
      const float part = head_on > most ? most / head_on : 1;
      linear[p] *= part;
      high[p] *= part;
      float& rest = parts.front()[p];
      rest -= part * (turning[p].linear + turning[p].higher);
      // By rounding.
      if (rest * whole[p] < 0 && owed.rise[p] * whole[p] > 0) rest = 0;
    }
    parts.push_back(std::move(linear));
    parts.push_back(std::move(high));
  }
  return parts;
}

}  // namespace scarp

#include "models/surface_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "flux/source_lobe.h"
#include "models/open_response.h"

namespace scarp {

namespace {

// A yield, its species and where it is counted.
struct CountedYield {
  std::size_t species = 0;
  std::size_t yield = 0;
  std::size_t tally = 0;
};

// Particles that come from about one direction, of one or more species.
struct Lobe {
  Vec3d direction;
  std::vector<std::size_t> tallies;  ///< all
  std::vector<std::size_t> others;   ///< those of no peaked yield
  std::vector<CountedYield> fading;  ///< that fall off with the angle besides, all alike

  /// The cosine, its third power and, if there are any, what the first of the fading yields brings.
  std::size_t factor_count() const { return fading.empty() ? 2 : 3; }
};

// Half of the particles within 15 degrees of the axis. Models of beams know better themselves.
bool is_narrow(const SourceLobe& source) {
  constexpr double least_cosine = 0.966;
  constexpr double least_power = 19;
  if (source.rotating || source.kind != SourceLobe::Kind::cosine) return false;
  return source.table.empty() ? source.cosine_power >= least_power
                              : source.table.cosine(0.5) >= least_cosine;
}

// A yield that is largest at a slant: no power of the cosine can follow its tally.
bool is_peaked(const YieldLaw& law, double energy) {
  constexpr int angles = 90;
  constexpr double least_rise = 1.05;
  double most = 0;
  for (int k = 0; k <= angles; ++k) {
    const double cosine = static_cast<double>(k) / angles;
    most = std::max(most, cosine * law.at(energy, AngleTable::half_sine(cosine)));
  }
  return most > least_rise * law.at(energy, 0);
}

// A slope steep enough that yields which fall off do so there.
constexpr double steep_cosine = 0.2588;

// A yield that is less at a slant than on a flat surface, by more than what arrives is.
bool is_fading(const YieldLaw& law, double energy) {
  constexpr double least_fall = 0.9;
  return law.at(energy, AngleTable::half_sine(steep_cosine)) < least_fall * law.at(energy, 0);
}

// Of what a yield is on a flat surface.
double law_part(const YieldLaw& law, double energy, double cosine) {
  return law.at(energy, AngleTable::half_sine(cosine)) / law.at(energy, 0);
}

// Whether one factor serves for both.
bool fade_alike(std::span<const Species> all, const CountedYield& a, const CountedYield& b) {
  constexpr double nearly = 1e-2;
  const auto part = [&](const CountedYield& counted, double cosine) {
    const Species& ions = all[counted.species];
    return law_part(ions.yields[counted.yield], ions.ions->energy.mean(), cosine);
  };
  return std::ranges::all_of(std::array{0.7071, steep_cosine}, [&](double cosine) {
    return std::abs(part(a, cosine) - part(b, cosine)) <= nearly;
  });
}

// The tallies of species by how they turn with the normal.
struct TurningTallies {
  std::vector<Lobe> lobes;
  std::vector<CountedYield> peaked;
};

TurningTallies turning_tallies(std::span<const Species> all) {
  TurningTallies turning;
  std::size_t tally = 0;
  for (std::size_t s = 0; s < all.size(); ++s) {
    const Species& species = all[s];
    std::vector<std::size_t> others{tally};
    std::vector<CountedYield> fading;
    for (std::size_t y = 0; y < species.yields.size(); ++y) {
      const CountedYield counted{.species = s, .yield = y, .tally = tally + 1 + y};
      const double energy = species.ions ? species.ions->energy.mean() : 0;
      if (species.ions && is_peaked(species.yields[y], energy)) {
        turning.peaked.push_back(counted);
        continue;
      }
      others.push_back(counted.tally);
      if (species.ions && is_fading(species.yields[y], energy)) fading.push_back(counted);
    }
    tally += 1 + species.yields.size();
    if (!is_narrow(species.source)) continue;
    const Vec3d direction = species.source.direction;
    auto lobe = std::ranges::find(turning.lobes, direction, &Lobe::direction);
    if (lobe == turning.lobes.end())
      lobe = turning.lobes.insert(
          lobe, {.direction = direction, .tallies = {}, .others = {}, .fading = {}});
    for (std::size_t t = others.front(); t < tally; ++t) lobe->tallies.push_back(t);
    lobe->others.insert(lobe->others.end(), others.begin(), others.end());
    lobe->fading.insert(lobe->fading.end(), fading.begin(), fading.end());
  }
  // By other laws than one, the speed of a lobe is left to the powers of the cosine.
  for (Lobe& lobe : turning.lobes) {
    const bool alike = std::ranges::all_of(lobe.fading, [&](const CountedYield& each) {
      return fade_alike(all, lobe.fading.front(), each);
    });
    if (!alike) lobe.fading.clear();
  }
  return turning;
}

// What the speeds of points owe to some tallies.
struct Owed {
  std::vector<float> rise;  ///< by how much each changes with the logarithm of what they count
  std::vector<float> all;   ///< what there would not be without it
};

// A model, points, and what arrives there.
struct Question {
  const SurfaceModel& model;
  const SurfacePoints& points;
  std::span<const std::span<const float>> flux;
  std::vector<float> speeds = model.speeds(points, flux);

  // What of the speeds goes if part(n, point) is left of what the nth of some tallies counts.
  template <class Part>
  std::vector<float> loss_to(const Part& part, std::span<const std::size_t> tallies) const {
    std::vector<std::vector<float>> changed;
    std::vector<std::span<const float>> views(flux.begin(), flux.end());
    changed.reserve(tallies.size());
    for (std::size_t n = 0; n < tallies.size(); ++n) {
      const std::span<const float> before = flux[tallies[n]];
      std::vector<float>& tally = changed.emplace_back(before.begin(), before.end());
      for (std::size_t p = 0; p < tally.size(); ++p) tally[p] *= part(n, p);
      views[tallies[n]] = tally;
    }
    std::vector<float> lost = model.speeds(points, views);
    for (std::size_t p = 0; p < lost.size(); ++p) lost[p] = speeds[p] - lost[p];
    return lost;
  }

  std::vector<float> loss(float less, std::span<const std::size_t> tallies) const {
    return loss_to([&](std::size_t, std::size_t) { return 1 - less; }, tallies);
  }

  Owed owed_to(std::span<const std::size_t> tallies) const {
    constexpr float less = 0.01F;
    Owed owed{.rise = loss(less, tallies), .all = loss(1, tallies)};
    for (float& rise : owed.rise) rise /= less;
    return owed;
  }
};

// The powers of the cosine to the axis by which a speed turns with the normal: with both, and a
// part that does not turn, it can follow any response up to the higher power, and has one sign.
constexpr float higher_power = 3;
float higher(float cosine) { return cosine * cosine * cosine; }

struct Turning {
  float linear = 0;
  float higher = 0;

  float sum() const { return linear + higher; }
};

// Of a speed, what turns with the normal: what changes at once with what arrives, or more.
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

// The same for every lobe and point. Of a product of what several lobes bring each of them would
// take the whole: then they share it.
std::vector<std::vector<Turning>> turning_parts(std::span<const float> speeds,
                                                std::span<const Owed> to_lobes) {
  std::vector<std::vector<Turning>> parts(to_lobes.size(), std::vector<Turning>(speeds.size()));
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    float together = 0;  // of those with the sign of the speed
    for (std::size_t l = 0; l < to_lobes.size(); ++l) {
      parts[l][p] = turning_part(speeds[p], to_lobes[l].rise[p], to_lobes[l].all[p]);
      if (parts[l][p].sum() * speeds[p] > 0) together += parts[l][p].sum();
    }
    if (!(std::abs(together) > std::abs(speeds[p]))) continue;
    const float share = speeds[p] / together;
    for (std::vector<Turning>& part : parts) {
      if (part[p].sum() * speeds[p] <= 0) continue;
      part[p].linear *= share;
      part[p].higher *= share;
    }
  }
  return parts;
}

// What speeds owe to each peaked yield, and to the rest of each lobe.
struct OwedApart {
  std::vector<Owed> to_peaked;
  std::vector<Owed> to_others;
};

// Whether the speeds of points are sums of these, the former in proportion to their yields. Others,
// as of products and quotients of tallies, the powers of the cosine have to follow.
std::vector<bool> are_sums(const OwedApart& owed, std::span<const float> owed_to_all,
                           std::span<const float> speeds) {
  constexpr float nearly = 1e-2F;
  constexpr float rounding = 1e-4F;
  std::vector<bool> sums(speeds.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    float sum = 0;
    float size = std::abs(speeds[p]);
    const auto add = [&](float all) {
      sum += all;
      size = std::max(size, std::abs(all));
    };
    for (const Owed& other : owed.to_others) add(other.all[p]);
    for (const Owed& peaked : owed.to_peaked) add(peaked.all[p]);
    const bool proportional = std::ranges::all_of(owed.to_peaked, [&](const Owed& peaked) {
      const float all = peaked.all[p];
      return std::abs(peaked.rise[p] - all) <= nearly * std::abs(all) + rounding * size;
    });
    sums[p] = proportional && std::abs(sum - owed_to_all[p]) <= rounding * size;
  }
  return sums;
}

// Of speeds that are in proportion to a peaked yield, the amplitude of its factor.
//
// A part of what an open source would bring at the normal comes straight from it; what is more than
// all of it was reflected and does not turn. Where ions only graze, the normal tells little.
std::vector<float> amplitude_of(const Species& ions, const AngularFactor& factor,
                                const SurfacePoints& points, std::span<const float> tally,
                                const Owed& owed, const std::vector<bool>& follows) {
  constexpr double grazing = 1e-3;
  const bool is_even = ions.source.map.empty();
  std::vector<float> amplitude(tally.size());
  for (std::size_t p = 0; p < tally.size(); ++p) {
    const float open = factor.value(points.normal[p]);
    if (!follows[p] || !(tally[p] > 0) || open <= grazing * factor.bounds().value) continue;
    amplitude[p] = owed.all[p] / (is_even ? std::max(open, tally[p]) : open);
  }
  return amplitude;
}

// The responses by which the speeds of a lobe turn: powers of the cosine to its axis, and that of a
// yield that falls off with the angle, if there is one.
struct LobeResponses {
  Vec3f direction;
  const AngularFactor* fading = nullptr;

  struct Values {
    float cosine = 0;
    float fading = 0;
  };
  Values at(Vec3f normal) const {
    return {.cosine = -dot(direction, normal),
            .fading = fading == nullptr ? 0 : fading->value(normal)};
  }
  /// At a cosine to the axis, around which the response is taken as the same.
  Values at_cosine(float cosine) const {
    const Vec3f across = std::abs(direction.x) < 0.5F ? Vec3f{1, 0, 0} : Vec3f{0, 1, 0};
    const Vec3f side = normalized(across - dot(across, direction) * direction);
    return at(std::sqrt(std::max(1 - cosine * cosine, 0.0F)) * side - cosine * direction);
  }
};

// For every point the part of its linear response that falls off as the fading yields do and not as
// the cosine: by what the model says of another slope, where fading yields are less than here by
// their response, and all else by the cosine. Of a floor that is a steep slope, such as the foot of
// a wall has; of what is steep itself, one a little less so. Where speeds are sums the peaked
// yields have their own factors.
std::vector<float> fading_parts(const Question& question, const Lobe& lobe,
                                const LobeResponses& responses, const std::vector<Turning>& turning,
                                const std::vector<bool>& sums) {
  constexpr float floor_cosine = 0.5F;
  constexpr float less_steep = 1.1F;
  constexpr float least_contrast = 1e-3F;
  const std::size_t count = turning.size();
  // How much more or less arrives on the other slope.
  std::vector<float> arrivals(count, 1);
  std::vector<float> fading(count, 1);
  std::vector<float> peaked(count, 1);
  const LobeResponses::Values at_foot = responses.at_cosine(static_cast<float>(steep_cosine));
  for (std::size_t p = 0; p < count; ++p) {
    const LobeResponses::Values here = responses.at(question.points.normal[p]);
    if (!(here.cosine > 0) || !(here.fading > 0)) continue;
    const LobeResponses::Values there =
        here.cosine > floor_cosine ? at_foot : responses.at_cosine(less_steep * here.cosine);
    arrivals[p] = there.cosine / here.cosine;
    fading[p] = there.fading / here.fading;
    if (!sums[p]) peaked[p] = arrivals[p];
  }
  std::vector<const std::vector<float>*> parts_of;
  for (const std::size_t tally : lobe.tallies) {
    const bool fades =
        std::ranges::find(lobe.fading, tally, &CountedYield::tally) != lobe.fading.end();
    const bool is_peaked = std::ranges::find(lobe.others, tally) == lobe.others.end();
    const std::vector<float>* by_cosine = is_peaked ? &peaked : &arrivals;
    parts_of.push_back(fades ? &fading : by_cosine);
  }
  const std::vector<float> lost = question.loss_to(
      [&](std::size_t n, std::size_t p) { return (*parts_of[n])[p]; }, lobe.tallies);
  std::vector<float> shares(count);
  for (std::size_t p = 0; p < count; ++p) {
    const auto [linear, high] = turning[p];
    const float by_cosine = linear * (1 - arrivals[p]) + high * (1 - higher(arrivals[p]));
    const float contrast = linear * (arrivals[p] - fading[p]);
    if (std::abs(contrast) <= least_contrast * std::abs(linear)) continue;
    const float share = (lost[p] - by_cosine) / contrast;
    // Models may have nothing to say of a slope that nothing arrives at.
    shares[p] = share > 0 ? std::min(share, 1.0F) : 0.0F;
  }
  return shares;
}

// A narrow lobe brings by the cosine what it brings straight. Where it only grazes the surface most
// was reflected elsewhere: that turns with the normal at most as what meets a surface head on. More
// would shorten the time step further than the bends of its responses do.
//
// sums tells of which points the speeds are sums, turning what turns with the lobe, whole what the
// speeds owe to lobes and to what does not turn, rest what this lobe leaves of it. By factor of the
// lobe.
std::vector<std::vector<float>> amplitudes_of(const Question& question, const Lobe& lobe,
                                              const LobeResponses& responses,
                                              const std::vector<bool>& sums,
                                              const std::vector<Turning>& turning,
                                              std::span<const float> whole,
                                              std::vector<float>& rest) {
  constexpr float grazing = 1e-4F;
  const std::size_t count = whole.size();
  float most = 0;
  for (const Turning& each : turning) most = std::max(most, std::abs(each.sum()));
  const std::vector<float> fading_part =
      lobe.fading.empty() ? std::vector<float>(count)
                          : fading_parts(question, lobe, responses, turning, sums);
  const float open = responses.at_cosine(1).fading;
  std::vector<std::vector<float>> amplitudes(lobe.factor_count(), std::vector<float>(count));
  for (std::size_t p = 0; p < count; ++p) {
    const LobeResponses::Values here = responses.at(question.points.normal[p]);
    if (!(here.cosine > grazing)) continue;
    const float fading = here.fading > grazing * open ? fading_part[p] : 0;
    const float linear = (1 - fading) * turning[p].linear / here.cosine;
    const float high = turning[p].higher / higher(here.cosine);
    const float falling = fading > 0 ? fading * turning[p].linear / here.fading : 0;
    const float head_on = std::abs(linear + high + falling * open);
    const float part = head_on > most ? most / head_on : 1;
    amplitudes[0][p] = part * linear;
    amplitudes[1][p] = part * high;
    if (!lobe.fading.empty()) amplitudes[2][p] = part * falling;
    rest[p] -= part * turning[p].sum();
    // By rounding.
    if (rest[p] * whole[p] < 0 && turning[p].sum() * whole[p] > 0) rest[p] = 0;
  }
  return amplitudes;
}

// What is left but for rounding is nothing, and must not let an etch grow.
void take_from(std::vector<float>& rest, std::span<const float> amplitude,
               const AngularFactor& factor, const SurfacePoints& points) {
  constexpr float rounding = 1e-5F;
  for (std::size_t p = 0; p < rest.size(); ++p) {
    const float part = amplitude[p] * factor.value(points.normal[p]);
    rest[p] -= part;
    if (std::abs(rest[p]) <= rounding * std::abs(part)) rest[p] = 0;
  }
}

void replace_where(const std::vector<bool>& chosen, const Owed& by, Owed& owed) {
  for (std::size_t p = 0; p < chosen.size(); ++p) {
    if (!chosen[p]) continue;
    owed.rise[p] = by.rise[p];
    owed.all[p] = by.all[p];
  }
}

}  // namespace

std::vector<AngularFactor> SurfaceModel::angular_factors() const {
  const std::vector<Species> all = species();
  const TurningTallies turning = turning_tallies(all);
  const auto response_of = [&](const CountedYield& counted) {
    const Species& ions = all[counted.species];
    return OpenResponse(ions, ions.yields[counted.yield]).factor();
  };
  std::vector<AngularFactor> factors;
  for (const Lobe& lobe : turning.lobes) {
    factors.push_back(CubicResponse(lobe.direction, 1, 0));
    factors.push_back(CubicResponse(lobe.direction, 0, 1));
    if (!lobe.fading.empty()) factors.push_back(response_of(lobe.fading.front()));
  }
  for (const CountedYield& peaked : turning.peaked) factors.push_back(response_of(peaked));
  return factors;
}

// Peaked yields first: what they leave of the speeds is the lobes'.
std::vector<std::vector<float>> SurfaceModel::amplitudes(
    const SurfacePoints& points, std::span<const std::span<const float>> flux,
    std::span<const AngularFactor> factors) const {
  const std::vector<Species> all = species();
  const auto [lobes, peaked] = turning_tallies(all);
  const Question question{.model = *this, .points = points, .flux = flux};
  std::vector<std::vector<float>> parts(1 + factors.size());
  std::vector<float>& rest = parts.front() = question.speeds;
  std::vector<bool> sums(points.material.size(), true);
  std::vector<Owed> to_lobes;
  for (const Lobe& lobe : lobes) to_lobes.push_back(question.owed_to(lobe.tallies));
  if (!peaked.empty()) {
    OwedApart apart;
    std::vector<std::size_t> turning;
    for (const CountedYield& yield : peaked) {
      apart.to_peaked.push_back(question.owed_to({&yield.tally, 1}));
      turning.push_back(yield.tally);
    }
    for (const Lobe& lobe : lobes) {
      apart.to_others.push_back(question.owed_to(lobe.others));
      turning.insert(turning.end(), lobe.others.begin(), lobe.others.end());
    }
    sums = are_sums(apart, question.loss(1, turning), question.speeds);
    for (std::size_t k = 0; k < peaked.size(); ++k) {
      const std::size_t place = factors.size() - peaked.size() + k;
      parts[1 + place] = amplitude_of(all[peaked[k].species], factors[place], points,
                                      flux[peaked[k].tally], apart.to_peaked[k], sums);
      take_from(rest, parts[1 + place], factors[place], points);
    }
    for (std::size_t l = 0; l < lobes.size(); ++l)
      replace_where(sums, apart.to_others[l], to_lobes[l]);
  }
  const std::vector<float> of_lobes = rest;
  const std::vector<std::vector<Turning>> turning = turning_parts(of_lobes, to_lobes);
  std::size_t place = 0;
  for (std::size_t l = 0; l < lobes.size(); ++l) {
    const LobeResponses responses{
        .direction = Vec3f(lobes[l].direction),
        .fading = lobes[l].fading.empty() ? nullptr : &factors[place + 2]};
    for (std::vector<float>& part :
         amplitudes_of(question, lobes[l], responses, sums, turning[l], of_lobes, rest))
      parts[1 + place++] = std::move(part);
  }
  return parts;
}

}  // namespace scarp

#include "models/angular_tallies.h"

#include <algorithm>

#include "flux/source_lobe.h"

namespace scarp {

namespace {

// Half of the particles within 15 degrees of the axis. Models of beams know better themselves.
bool is_narrow(const SourceLobe& source) {
  constexpr double least_cosine = 0.966;
  constexpr double least_power = 19;
  if ((source.rotating && !source.is_upright()) || source.kind != SourceLobe::Kind::cosine)
    return false;
  return source.table.empty() ? source.cosine_power >= least_power
                              : source.table.cosine(0.5) >= least_cosine;
}

bool is_peaked(const MeanYield& yield) {
  constexpr int angles = 90;
  constexpr double least_rise = 1.05;
  double most = 0;
  for (int k = 0; k <= angles; ++k) {
    const double cosine = static_cast<double>(k) / angles;
    most = std::max(most, cosine * yield.at(AngleTable::half_sine(cosine)));
  }
  return most > least_rise * yield.at(0);
}

Lobe& lobe_along(Vec3d direction, std::vector<Lobe>& lobes) {
  const auto found = std::ranges::find(lobes, direction, &Lobe::direction);
  return found != lobes.end() ? *found : lobes.emplace_back(Lobe{.direction = direction});
}

}  // namespace

AngularTallies angular_tallies(std::span<const Species> all) {
  AngularTallies turning;
  std::size_t tally = 0;
  for (const Species& species : all) {
    std::vector<LobeTally> tallies{{.tally = tally++}};
    for (std::size_t y = 0; y < species.yields.size(); ++y, ++tally) {
      LobeTally& counted = tallies.emplace_back(LobeTally{.tally = tally});
      if (!species.ions) continue;
      counted.yield = MeanYield(species.yields[y], species.ions->energy);
      counted.is_peaked = is_peaked(*counted.yield);
      if (counted.is_peaked)
        turning.peaked.push_back({.ions = species, .yield = y, .tally = tally});
    }
    if (!is_narrow(species.source)) continue;
    const float along = arrivals_along(species.source);
    for (LobeTally& each : tallies) each.along = along;
    Lobe& lobe = lobe_along(species.source.direction, turning.lobes);
    lobe.tallies.insert(lobe.tallies.end(), tallies.begin(), tallies.end());
  }
  return turning;
}

}  // namespace scarp

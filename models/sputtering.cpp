#include "models/sputtering.h"

#include <algorithm>

#include "models/source_parameters.h"

namespace scarp {

namespace {

// Below this part of what the normal could get at best, it tells nothing of what is in sight.
constexpr double grazing = 0.05;

std::vector<Species> species_of(const Sputtering::Values& values) {
  std::vector<Species> species;
  if (values.atoms) species.push_back(*values.atoms);
  species.insert(species.end(), values.ions.begin(), values.ions.end());
  for (const std::optional<Species>& axis : values.axes)
    if (axis) species.push_back(*axis);
  if (values.sputtered) species.push_back(*values.sputtered);
  return species;
}

}  // namespace

// Tallies: atoms from above, ions with their yields, beams along them, sputtered atoms.
Sputtering::Sputtering(Values values)
    : SurfaceModel(species_of(values),
                   {.emitter = values.sputtered ? this : nullptr, .angular = this}),
      values_(std::move(values)) {
  tally_count_ = values_.atoms ? 1 : 0;
  for (const Species& ion : values_.ions) {
    first_tally_.push_back(tally_count_);
    first_factor_.push_back(factor_count_);
    tally_count_ += 1 + ion.yields.size();
    factor_count_ += ion.yields.size();
  }
  for (const std::optional<Species>& axis : values_.axes) {
    visibility_.push_back(tally_count_ + 1);
    if (axis) tally_count_ += 2;
  }
  if (values_.sputtered) ++tally_count_;
}

double Sputtering::loss(const Loss& loss, std::size_t ion,
                        std::span<const std::span<const float>> flux, std::size_t point) const {
  const float yield = flux[first_tally_[ion] + 1 + loss.yield][point];
  return loss.atoms * std::max(0.0F, yield);
}

Sputtering::Balance Sputtering::balance(const Surface& surface,
                                        std::span<const std::span<const float>> flux,
                                        std::size_t point) const {
  Balance sum;
  for (std::size_t i = 0; i < surface.by_ion.size(); ++i)
    sum.leaves += loss(surface.by_ion[i], i, flux, point);
  if (values_.atoms)
    sum.settles += surface.atom_sticking * values_.atom_flux * std::max(0.0F, flux[0][point]);
  if (values_.sputtered) {
    const float arrives = std::max(0.0F, flux[tally_count_ - 1][point]);
    sum.settles += surface.settling * values_.sputtered_unit * arrives;
  }
  return sum;
}

std::vector<float> Sputtering::speeds(const SurfacePoints& points,
                                      std::span<const std::span<const float>> flux) const {
  std::vector<float> speeds(points.material.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    const Surface& surface = values_.surfaces[points.material[p]];
    const double net = balance(surface, flux, p).net();
    speeds[p] = static_cast<float>(net / density(surface, net));
  }
  return speeds;
}

std::vector<std::vector<float>> Sputtering::emission(
    const SurfacePoints& points, std::span<const std::span<const float>> flux) const {
  std::vector<float> emission(points.material.size());
  for (std::size_t p = 0; p < emission.size(); ++p) {
    const Balance here = balance(values_.surfaces[points.material[p]], flux, p);
    emission[p] = static_cast<float>(here.leaves / values_.sputtered_unit);
  }
  return {std::move(emission)};
}

bool Sputtering::is_mirror_symmetric(int axis) const {
  return are_mirror_symmetric(species(), axis);
}

std::vector<AngularFactor> Sputtering::factors() const {
  std::vector<AngularFactor> all;
  for (const auto& of_ion : values_.factors) all.insert(all.end(), of_ion.begin(), of_ion.end());
  return all;
}

// A map of the source may bring more than an even one.
double Sputtering::part_in_sight(std::size_t ion, double open, double lost,
                                 std::span<const std::span<const float>> flux,
                                 std::size_t point) const {
  if (open > 0) {
    const double part = lost / open;
    return values_.ions[ion].source.map.empty() ? std::min(1.0, part) : part;
  }
  return values_.axes[ion] ? static_cast<double>(flux[visibility_[ion]][point]) : 0;
}

// A part of what the open source would bring comes straight from it and depends on the normal. What
// is more than all of it was reflected.
std::vector<std::vector<float>> Sputtering::amplitudes(
    const SurfacePoints& points, std::span<const std::span<const float>> flux,
    std::span<const AngularFactor> factors) const {
  std::vector<std::vector<float>> parts(1 + factor_count_,
                                        std::vector<float>(points.material.size()));
  for (std::size_t p = 0; p < points.material.size(); ++p) {
    const Surface& surface = values_.surfaces[points.material[p]];
    const Balance here = balance(surface, flux, p);
    const double rho = density(surface, here.net());
    double rest = here.settles;
    for (std::size_t i = 0; i < surface.by_ion.size(); ++i) {
      const Loss& of_ion = surface.by_ion[i];
      const AngularFactor& factor = factors[first_factor_[i] + of_ion.yield];
      const double value = factor.value(points.normal[p]);
      const double open = of_ion.atoms * value;
      const bool grazes = value < grazing * factor.bounds().value;
      const double lost = loss(of_ion, i, flux, p);
      const double seen = part_in_sight(i, grazes ? 0 : open, lost, flux, p);
      parts[1 + first_factor_[i] + of_ion.yield][p] =
          static_cast<float>(-seen * of_ion.atoms / rho);
      rest -= std::max(0.0, lost - seen * open);
    }
    parts[0][p] = static_cast<float>(rest / rho);
  }
  return parts;
}

}  // namespace scarp

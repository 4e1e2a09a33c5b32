#include "models/open_wafer.h"

#include <algorithm>
#include <cmath>

#include "core/solute.h"
#include "models/open_response.h"

namespace scarp {

namespace {

// What ions straight from the source bring to the slope on which their yield counts most.
double largest_yield(const YieldLaw& law, double energy) {
  double largest = 0;
  for (double cosine = 0.01; cosine < 1.005; cosine += 0.01)
    largest = std::max(largest, cosine * law.at(energy, AngleTable::half_sine(cosine)));
  return largest;
}

// Every material once, as a wafer that sees the whole source.
struct OpenWafers {
  std::vector<MaterialId> material;
  std::vector<Vec3f> normal;
  std::vector<std::vector<float>> flux;       // by tally
  std::vector<std::vector<float>> coverages;  // at the end of a cycle, if the model has phases

  SurfacePoints points() const {
    return {.material = material, .normal = normal, .coverages = coverages};
  }
  std::vector<std::span<const float>> tallies() const { return {flux.begin(), flux.end()}; }
};

void go_through_cycle(const SurfaceModel& model, OpenWafers& wafers) {
  const CycledCoverages* const cycle = model.cycle();
  if (cycle == nullptr) return;
  const std::vector<double> phases = cycle->phases();
  wafers.coverages.assign(cycle->coverage_names().size(),
                          std::vector<float>(wafers.material.size()));
  for (std::size_t phase = 0; phase < phases.size(); ++phase)
    wafers.coverages =
        cycle->coverages_after(phases[phase], phase, wafers.points(), wafers.tallies());
}

// yield(species, law) is what ions bring of a yield.
template <class Yield>
OpenWafers open_wafers(const SurfaceModel& model, std::size_t material_count, const Yield& yield) {
  OpenWafers wafers;
  for (std::size_t m = 0; m < material_count; ++m)
    wafers.material.push_back(static_cast<MaterialId>(m));
  wafers.normal.assign(material_count, Vec3f{0, 0, 1});
  for (const Species& species : model.species()) {
    // What comes from the surface itself hinders at most.
    const bool from_above = species.source.kind != SourceLobe::Kind::none;
    wafers.flux.emplace_back(material_count, from_above ? 1.0F : 0.0F);
    // Of a beam, the part from which it is seen.
    if (species.source.kind == SourceLobe::Kind::beam)
      wafers.flux.emplace_back(material_count, 1.0F);
    for (const YieldLaw& law : species.yields)
      wafers.flux.emplace_back(material_count, static_cast<float>(yield(species, law)));
  }
  if (const Bath* const bath = model.bath()) {
    wafers.flux.emplace_back();
    const Solute solute = bath->solute();
    for (const Exchange& wafer : bath->exchange(wafers.points()))
      wafers.flux.back().push_back(static_cast<float>(open_wafer_concentration(solute, wafer)));
  }
  go_through_cycle(model, wafers);
  return wafers;
}

// The fastest that a step moves a surface that sees the whole source; with factors of the normal,
// the speed that limits the time step as much as their kinks do.
double top_speed(const SurfaceModel& model, std::span<const AngularFactor> factors,
                 std::size_t material_count) {
  const OpenWafers wafers =
      open_wafers(model, material_count, [](const Species& species, const YieldLaw& law) {
        return largest_yield(law, species.ions->energy.mean());
      });
  const std::vector<std::vector<float>> parts =
      model.angular().amplitudes(wafers.points(), wafers.tallies(), factors);
  const LimitingSpeed limiting_speed(factors);
  double top = 0;
  for (std::size_t m = 0; m < material_count; ++m) {
    const auto amplitude = [&](std::size_t k) { return parts[1 + k][m]; };
    top = std::max(top, static_cast<double>(limiting_speed(parts[0][m], amplitude)));
  }
  return top;
}

}  // namespace

std::vector<float> open_wafer_speeds(const SurfaceModel& model, std::size_t material_count) {
  const OpenWafers wafers =
      open_wafers(model, material_count, [](const Species& species, const YieldLaw& law) {
        return OpenResponse(species, law).flat();
      });
  return model.speeds(wafers.points(), wafers.tallies());
}

double open_wafer_time_steps(const SurfaceModel& model, std::span<const AngularFactor> factors,
                             std::size_t material_count, double duration, double longest_move) {
  constexpr double rounding = 1 - 1e-6;  // of speeds: what they make is no time step more
  const double distance = duration * top_speed(model, factors, material_count);
  const double at_least = model.cycle() == nullptr
                              ? 1
                              : std::ceil(rounding * duration / model.cycle()->longest_time_step());
  return std::max({1.0, at_least, std::ceil(rounding * distance / longest_move)});
}

}  // namespace scarp

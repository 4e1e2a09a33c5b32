#include "models/catalogue/ald.h"

#include <algorithm>
#include <array>
#include <memory>

#include "flux/sampling/portable_math.h"
#include "models/source_parameters.h"

namespace scarp {

namespace {

constexpr std::size_t precursor = 0;  // species, and tally
constexpr std::size_t desorbed = 1;   // species, and tally, if there is any
constexpr std::size_t pulse = 0;      // phase

constexpr std::string_view arts =
    "example of ViennaPS for 220 degC, after Arts, Knoops, Kessels 2019";

const Parameter deposited{.name = "material",
                          .kind = Parameter::Kind::material,
                          .meaning = "what is deposited",
                          .source = "the process"};
const Parameter growth_per_cycle{.name = "growth_per_cycle",
                                 .dimension = Dimension::length,
                                 .limits = {.minimum = 0, .maximum = 100, .exclusive = true},
                                 .meaning = "GPC: film of a cycle on a surface that is all covered",
                                 .source = "blanket wafers: Al2O3 0.1 nm"};
const Parameter cycles{.name = "cycles",
                       .limits = {.minimum = 1, .maximum = 1e9},
                       .meaning = "how many there are, a whole number",
                       .source = "the process"};
const Parameter cycles_at_once{
    .name = "cycles_at_once",
    .limits = {.fallback = "1e9", .minimum = 1, .maximum = 1e9},
    .meaning = "the most that one simulated cycle stands for; advection.cfl limits them, too"};
const Parameter pulse_time{.name = "pulse_time",
                           .dimension = Dimension::time,
                           .limits = {.fallback = "0.1 s", .minimum = 0, .exclusive = true},
                           .meaning = "of the precursor",
                           .source = "the process"};
const Parameter purge_time{.name = "purge_time",
                           .dimension = Dimension::time,
                           .limits = {.fallback = "0 s", .minimum = 0},
                           .meaning = "after the pulse, in which what has adsorbed may desorb",
                           .source = "the process"};
const Parameter flux_of_source{
    .name = "flux",
    .dimension = Dimension::flux,
    .limits = {.fallback = "2e21 /cm2/s", .minimum = 0, .maximum = 1e10, .exclusive = true},
    .meaning = "J of an open flat wafer",
    .source = "reactor: p / sqrt(2 pi m k T)"};
const Parameter sticking{.name = "sticking",
                         .kind = Parameter::Kind::per_material,
                         .limits = {.fallback = "5e-5", .minimum = 0, .maximum = 1},
                         .meaning = "g: probability that a molecule stays on a bare surface",
                         .source = arts};
const Parameter desorption{.name = "desorption",
                           .dimension = Dimension::flux,
                           .limits = {.fallback = "2.5e15 /cm2/s", .minimum = 0, .maximum = 1e10},
                           .meaning = "J_d: what leaves a covered surface",
                           .source = arts};
const Parameter sites{.name = "sites",
                      .dimension = Dimension::areal_density,
                      .limits = {.fallback = "3.36e15 /cm2", .minimum = 1e-3, .maximum = 1e3},
                      .meaning = "s0: molecules on a surface that is all covered",
                      .source = arts};
const Parameter source_power = source_power_parameter("source_power");
const Parameter source_table = source_table_parameter("source_table");
const Parameter source_map = source_map_parameter("source_map");

std::span<const Parameter> parameters() {
  static const std::array rows{
      deposited,      growth_per_cycle, cycles, cycles_at_once, pulse_time,   purge_time, sticking,
      flux_of_source, desorption,       sites,  source_power,   source_table, source_map};
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  const MaterialId film = step.material(deposited.name, scope.materials);
  Ald::Values values;
  values.growth_per_cycle = read_value(step, growth_per_cycle);
  const auto count = static_cast<double>(step.integer(cycles.name, cycles.limits));
  const double at_once = read_value(step, cycles_at_once);
  values.pulse = read_value(step, pulse_time);
  values.purge = read_value(step, purge_time);
  values.flux = read_value(step, flux_of_source);
  values.sticking = read_per_material(step, sticking, scope, film);
  values.desorption = read_value(step, desorption);
  values.sites = read_value(step, sites);
  values.source = read_upright_source(step, source_power, scope);
  require_one(
      step, scope, sticking, [&](MaterialId m) { return values.sticking[m] > 0; },
      "is 0 on all that", "so cycles of ald do nothing; a material needs more than 0");
  const double cycle = values.pulse + values.purge;
  values.longest_time_step = at_once * cycle;
  StepModel made{std::make_shared<Ald>(std::move(values)), film};
  made.duration = {.seconds = count * cycle, .key = cycles.name};
  return made;
}

std::vector<Species> species_of(const Ald::Values& values) {
  std::vector<Species> species(1);
  species[precursor] = {.name = "precursor", .source = values.source, .sticking = values.sticking};
  if (values.desorption > 0)
    species.push_back({.name = "desorbed",
                       .source = {.kind = SourceLobe::Kind::none},
                       .sticking = values.sticking});
  return species;
}

}  // namespace

Ald::Ald(Values values)
    : SurfaceModel(species_of(values),
                   {.cycle = this, .emitter = values.desorption > 0 ? this : nullptr}),
      values_(std::move(values)) {}

std::vector<float> Ald::speeds(const SurfacePoints& points,
                               std::span<const std::span<const float>>) const {
  const double rate = values_.growth_per_cycle / (values_.pulse + values_.purge);
  std::vector<float> speeds;
  for (const float theta : points.coverages.front())
    speeds.push_back(static_cast<float>(rate * theta));
  return speeds;
}

// 1 stands for J, so that an error of this flux counts as one of the precursor's.
std::vector<std::vector<float>> Ald::emission(const SurfacePoints& points,
                                              std::span<const std::span<const float>>) const {
  const auto part = static_cast<float>(values_.desorption / values_.flux);
  std::vector<float> leaves;
  for (const float theta : points.coverages.front()) leaves.push_back(part * theta);
  return {leaves};
}

std::vector<double> Ald::phases() const {
  if (values_.purge > 0) return {values_.pulse, values_.purge};
  return {values_.pulse};
}

std::vector<std::vector<float>> Ald::coverages_after(
    double seconds, std::size_t phase, const SurfacePoints& points,
    std::span<const std::span<const float>> flux) const {
  std::vector<float> after(points.material.size());
  for (std::size_t p = 0; p < after.size(); ++p) {
    double arrives = 0;
    if (phase == pulse) arrives += std::max(0.0F, flux[precursor][p]);
    if (desorbs()) arrives += std::max(0.0F, flux[desorbed][p]);
    const double adsorbs = values_.sticking[points.material[p]] * values_.flux * arrives;
    const double sum = adsorbs + values_.desorption;
    const double before = points.coverages.front()[p];
    const double balance = sum > 0 ? adsorbs / sum : 0;
    // What is e^-100 away from the balance is there.
    const double part = portable_exp(-std::min(100.0, sum * seconds / values_.sites));
    after[p] = static_cast<float>(balance + (before - balance) * part);
  }
  return {after};
}

std::vector<std::vector<float>> Ald::covered_sticking(
    const SurfacePoints& points, std::span<const std::vector<float>> coverages) const {
  std::vector<float> bare(points.material.size());
  for (std::size_t p = 0; p < bare.size(); ++p)
    bare[p] = values_.sticking[points.material[p]] * (1 - coverages.front()[p]);
  return std::vector<std::vector<float>>(desorbs() ? 2 : 1, bare);
}

ModelDescription ald_description() {
  return {
      .name = "ald",
      .summary = "atomic layer deposition: cycles of a pulse that covers the surface, and a purge",
      .equation =
          "pulse: s0 d(theta)/dt = g J (F + F_d) (1 - theta) - J_d theta; purge: the same without "
          "F; "
          "v = GPC theta / (pulse + purge)",
      .symbols =
          "v is the speed along the outward normal. theta is the part of the sites that the "
          "precursor covers, 0 when a cycle begins; what is left of it at the end of the purge "
          "becomes film. F is what arrives of the precursor, first and later arrivals together, "
          "relative to an open flat wafer, F_d what arrives of molecules that have desorbed, "
          "relative to the same J: they "
          "leave by the cosine law, with a flux J_d theta. Both stick with probability "
          "g (1 - theta), or are re-emitted by the cosine law. Flux and coverage are carried "
          "through the cycle together, in steps for which the exact exponential of the coverage is "
          "within flux.coverage_tolerance. A time step simulates one cycle, which stands for as "
          "many as move the surface by no more than advection.cfl allows; the duration of the step "
          "is cycles (pulse_time + purge_time).",
      .limits =
          "One of the two half reactions: the second reactant has all the time that it needs, "
          "none of which counts in the duration. Molecules meet walls and not each other (mean "
          "free path above ten widths), and a wall is reached at once. No diffusion on the "
          "surface, no decomposition.",
      .source =
          "L. Aguinsky et al. (2022) after K. Arts, H. C. M. Knoops, W. M. M. Kessels (2019); "
          "Langmuir kinetics with first order in both directions",
      .parameters = parameters(),
      .read = read,
      .duration_text = "cycles (pulse_time + purge_time)"};
}

}  // namespace scarp

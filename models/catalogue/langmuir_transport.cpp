#include "models/catalogue/langmuir_transport.h"

#include <algorithm>
#include <array>
#include <memory>

#include "models/source_parameters.h"

namespace scarp {

namespace {

constexpr std::string_view panagopoulos = "T. Panagopoulos, T. Lill (2023)";

const Parameter flux_of_source{.name = "flux",
                               .dimension = Dimension::flux,
                               .limits = {.minimum = 0, .maximum = 1e10, .exclusive = true},
                               .meaning = "J of an open flat wafer",
                               .source = "reactor: p / sqrt(2 pi m k T)"};
const Parameter sticking{
    .name = "sticking",
    .kind = Parameter::Kind::per_material,
    .limits = {.fallback = "{ Si = 1, polySi = 1, default = 0.1 }", .minimum = 0, .maximum = 1},
    .meaning = "s: probability that a molecule stays on a bare surface",
    .source = panagopoulos};
const Parameter desorption{.name = "desorption",
                           .kind = Parameter::Kind::per_material,
                           .dimension = Dimension::flux,
                           .limits = {.fallback = "0 /cm2/s", .minimum = 0, .maximum = 1e10},
                           .meaning = "J_d: what leaves a covered surface, rate times sites",
                           .source = panagopoulos};
const Parameter reaction{
    .name = "reaction",
    .kind = Parameter::Kind::per_material,
    .dimension = Dimension::flux,
    .limits = {.minimum = 0, .maximum = 1e10},
    .meaning = "J_r: what reacts on a covered surface, rate times sites; 0 on walls",
    .source = "etch rate at high flux: J_r / (n rho)"};
const Parameter molecules_per_atom{
    .name = "molecules_per_atom",
    .limits = {.fallback = "1", .minimum = 0, .maximum = 100, .exclusive = true},
    .meaning = "n: how many react with an atom of the solid",
    .source = "the product: 4 of F to SiF4"};
const Parameter source_power = source_power_parameter("source_power");
const Parameter source_table = source_table_parameter("source_table");
const Parameter source_map = source_map_parameter("source_map");

std::span<const Parameter> parameters() {
  static const std::array rows{flux_of_source,     sticking,     desorption,   reaction,
                               molecules_per_atom, source_power, source_table, source_map};
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  LangmuirTransport::Values values;
  values.flux = read_value(step, flux_of_source);
  values.molecules_per_atom = read_value(step, molecules_per_atom);
  values.source = read_upright_source(step, source_power, scope);
  const std::vector<float> sticks = read_per_material(step, sticking, scope, std::nullopt);
  const std::vector<float> leaves = read_per_material(step, desorption, scope, std::nullopt);
  const std::vector<float> reacts = read_per_material(step, reaction, scope, std::nullopt);
  for (std::size_t m = 0; m < scope.materials.size(); ++m)
    values.surfaces.push_back({.sticking = sticks[m],
                               .desorption = leaves[m],
                               .reaction = reacts[m],
                               .density = scope.materials[static_cast<MaterialId>(m)].density});
  if (step.ok(sticking.name))
    require_one(
        step, scope, reaction,
        [&](MaterialId m) {
          return values.surfaces[m].reaction > 0 && values.surfaces[m].sticking > 0;
        },
        "is 0, or the sticking is, on all that",
        "so langmuir_transport etches nothing; a material needs more than 0 of both");
  return {std::make_shared<LangmuirTransport>(std::move(values))};
}

std::vector<Species> species_of(const LangmuirTransport::Values& values) {
  Species etchant{.name = "etchant", .source = values.source, .sticking = {}};
  for (const LangmuirTransport::Surface& surface : values.surfaces)
    etchant.sticking.push_back(static_cast<float>(surface.sticking));
  return {etchant};
}

}  // namespace

// Where nothing arrives nothing covers, also where nothing leaves.
double LangmuirTransport::coverage(const Surface& surface, float flux) const {
  const double adsorbs = surface.sticking * values_.flux * std::max(0.0F, flux);
  if (adsorbs == 0) return 0;
  return adsorbs / (adsorbs + surface.desorption + surface.reaction);
}

LangmuirTransport::LangmuirTransport(Values values)
    : SurfaceModel(species_of(values), {.balance = this}), values_(std::move(values)) {}

std::vector<float> LangmuirTransport::speeds(const SurfacePoints& points,
                                             std::span<const std::span<const float>> flux) const {
  std::vector<float> speeds(points.material.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    const Surface& surface = values_.surfaces[points.material[p]];
    speeds[p] = static_cast<float>(-surface.reaction * coverage(surface, flux.front()[p]) /
                                   (values_.molecules_per_atom * surface.density));
  }
  return speeds;
}

std::vector<std::vector<float>> LangmuirTransport::steady_coverages(
    const SurfacePoints& points, std::span<const std::span<const float>> flux) const {
  std::vector<float> theta(points.material.size());
  for (std::size_t p = 0; p < theta.size(); ++p)
    theta[p] = static_cast<float>(coverage(values_.surfaces[points.material[p]], flux.front()[p]));
  return {theta};
}

std::vector<std::vector<float>> LangmuirTransport::covered_sticking(
    const SurfacePoints& points, std::span<const std::vector<float>> coverages) const {
  std::vector<float> stays(points.material.size());
  for (std::size_t p = 0; p < stays.size(); ++p) {
    const Surface& surface = values_.surfaces[points.material[p]];
    if (surface.reaction == 0) continue;
    stays[p] = static_cast<float>(surface.sticking * (1 - coverages.front()[p]) * surface.reaction /
                                  (surface.desorption + surface.reaction));
  }
  return {stays};
}

ModelDescription langmuir_transport_description() {
  return {
      .name = "langmuir_transport",
      .summary = "a neutral that adsorbs, desorbs and reacts: etching down a deep hole",
      .equation = "v = -J_r theta / (n rho), s J F (1 - theta) = (J_d + J_r) theta",
      .symbols =
          "v is the speed along the outward normal, rho the density of the material. theta is the "
          "part of the sites that is covered, in balance with what arrives. F is what arrives, "
          "first and later arrivals and what has desorbed together, relative to an open flat "
          "wafer; it leaves the source with a density cos^n(theta) per solid angle. A molecule "
          "stays with probability s (1 - theta); of those that stay the part J_d / (J_d + J_r) "
          "desorbs again, by the cosine law as what does not stay. On walls nothing reacts, so as "
          "much leaves as arrives. J_d and J_r are rates (per second) times the sites per area, of "
          "about 1e15 /cm2.",
      .limits =
          "Coverages follow at once what arrives. Molecules meet walls and not each other (mean "
          "free path above ten widths). Products leave without meeting a wall.",
      .source =
          "T. Panagopoulos, T. Lill, J. Vac. Sci. Technol. A 41 (2023), doi 10.1116/6.0002468; I. "
          "Langmuir (1918)",
      .parameters = parameters(),
      .read = read};
}

}  // namespace scarp

#include "models/catalogue/plasma_etch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "models/ion_parameters.h"
#include "models/source_parameters.h"

namespace scarp {

namespace {

constexpr std::string_view equation =
    "v = -(k theta_E / 4 + R_sp + theta_E R_ie) / rho of what is etched, "
    "v = -R_sp / rho of all else";

constexpr std::string_view two_gases =
    "v is the speed along the outward normal. theta_E and theta_P are the parts of the sites "
    "that hold etchant and passivation, in balance with what arrives: "
    "g_E J_E F_E (1 - theta_E - theta_P) = (k + 2 R_ie) theta_E and "
    "g_P J_P F_P (1 - theta_E - theta_P) = (b + R_p) theta_P. F is what arrives of a gas, "
    "first and later arrivals together, relative to an open flat wafer; it leaves the source "
    "with a density cos(theta) per solid angle, sticks with probability "
    "g (1 - theta_E - theta_P), or is re-emitted by the cosine law.";

constexpr std::string_view one_gas =
    "v is the speed along the outward normal. theta_E is the part of the sites that holds "
    "etchant, in balance with what arrives: g_E J_E F_E (1 - theta_E) = (k + 2 R_ie) theta_E. "
    "F_E is what arrives of it, first and later arrivals together, relative to an open flat "
    "wafer; it leaves the source with a density cos(theta) per solid angle, sticks with "
    "probability g_E (1 - theta_E), or is re-emitted by the cosine law.";

constexpr std::string_view ions_of_all =
    " Flux and coverages are "
    "solved together. R is the flux of ions times their yield, "
    "Y(E, theta) = A max(0, sqrt(E) - sqrt(threshold)) f(theta): R_sp with f = cos(theta) "
    "(1 + B sin^2(theta)) of each material, R_ie and R_p with f = 1 up to 60 deg and from "
    "there linear to 0 at 90 deg. rho is the density of the material. In the balance all "
    "materials have R_ie of what is etched. Ions that do not stick leave near the specular "
    "direction with a part of their energy, as in multi_particle.";

std::string_view symbols(bool has_passivation) {
  static const std::string of_two = std::string(two_gases) + std::string(ions_of_all);
  static const std::string of_one = [] {
    std::string text = std::string(one_gas) + std::string(ions_of_all);
    constexpr std::string_view both = "R_ie and R_p with";
    return text.replace(text.find(both), both.size(), "R_ie with");
  }();
  return has_passivation ? of_two : of_one;
}

constexpr std::string_view limits =
    "Coverages follow at once what arrives. Molecules meet walls and not each other "
    "(mean free path above ten widths). Neither temperature nor loading; what is "
    "sputtered or desorbs leaves without meeting a wall.";

// Shape of the yield of passivation: a tally of its own, also where it is that of the etch.
constexpr double removal_shape = -4;

// Tallies of an ion: its arrivals, then its yields. The removal is that of passivation, if there is
// any.
enum IonTally : std::size_t { enhanced = 1, removal = 2 };
constexpr std::size_t etchant = 0;      // species, and tally
constexpr std::size_t passivation = 1;  // species, and tally, if there is any

constexpr Limits fluxes(std::string_view fallback) {
  return {.fallback = fallback, .minimum = 0, .maximum = 1e10};
}
constexpr Limits parts(std::string_view fallback) {
  return {.fallback = fallback, .minimum = 0, .maximum = 1};
}
constexpr Limits energies(std::string_view fallback) {
  return {.fallback = fallback, .minimum = 0, .maximum = 1e6};
}
constexpr Limits amplitudes(std::string_view fallback) {
  return {.fallback = fallback, .minimum = 0, .maximum = 1e6};
}

// Everything but what the chemistry has its own values for.
const Parameter etchant_flux{.name = "etchant_flux",
                             .dimension = Dimension::flux,
                             .limits = fluxes("1.8e18 /cm2/s"),
                             .meaning = "J_E of an open flat wafer",
                             .source = "reactor: p / sqrt(2 pi m k T)"};
const Parameter passivation_flux{.name = "passivation_flux",
                                 .dimension = Dimension::flux,
                                 .limits = fluxes("1e17 /cm2/s"),
                                 .meaning = "J_P of an open flat wafer",
                                 .source = "reactor: p / sqrt(2 pi m k T)"};
const Parameter sticking_in_balance{.name = "sticking_in_balance",
                                    .kind = Parameter::Kind::flag,
                                    .limits = {.fallback = "true"},
                                    .meaning = "false: g_E and g_P count for the sticking alone",
                                    .source = "true: Belen et al. 2005; false: other simulators"};
const Parameter etchant_desorption{.name = "etchant_desorption",
                                   .dimension = Dimension::flux,
                                   .limits = fluxes("3e17 /cm2/s"),
                                   .meaning = "k: what leaves a covered surface without ions",
                                   .source = "Belen et al. 2005"};
const Parameter passivation_desorption{.name = "passivation_desorption",
                                       .dimension = Dimension::flux,
                                       .limits = fluxes("4e13 /cm2/s"),
                                       .meaning = "b: what leaves a covered surface without ions",
                                       .source = "Belen et al. 2005"};
const Parameter etches{.name = "etches",
                       .kind = Parameter::Kind::material_list,
                       .limits = {.fallback = "[\"Si\", \"polySi\"]"},
                       .meaning = "what the etchant reacts with; all else is sputtered only",
                       .source = "the process"};
const Parameter enhanced_threshold{.name = "enhanced_threshold",
                                   .dimension = Dimension::energy,
                                   .limits = energies("15 eV"),
                                   .meaning = "energy below which ions etch no covered site",
                                   .source = "Belen et al. 2005"};
const Parameter removal_amplitude{.name = "removal_amplitude",
                                  .limits = amplitudes("3"),
                                  .meaning = "A of Y_p: what an ion removes of the passivation",
                                  .source = "Belen et al. 2005"};
const Parameter removal_threshold{.name = "removal_threshold",
                                  .dimension = Dimension::energy,
                                  .limits = energies("10 eV"),
                                  .meaning = "energy below which it removes nothing",
                                  .source = "Belen et al. 2005"};
const Parameter ion_flux{.name = "ion.flux",
                         .dimension = Dimension::flux,
                         .limits = fluxes("1.2e16 /cm2/s"),
                         .meaning = "J_i of an open flat wafer",
                         .source = "probe: ion current / charge"};

Parameter bare_sticking(std::string_view name, std::string_view fallback,
                        std::string_view meaning) {
  return {.name = name,
          .kind = Parameter::Kind::per_material,
          .limits = parts(fallback),
          .meaning = meaning,
          .source = "Belen et al. 2005"};
}

Parameter etchant_sticking(const PlasmaChemistry& chemistry) {
  return bare_sticking("etchant_sticking", chemistry.etchant_sticking,
                       "g_E: probability that it sticks to a bare surface");
}

Parameter passivation_sticking(const PlasmaChemistry& chemistry) {
  return bare_sticking("passivation_sticking", chemistry.passivation_sticking,
                       "g_P: probability that it sticks to a bare surface");
}

Parameter sputter_amplitude(const PlasmaChemistry& chemistry) {
  return {.name = "sputter_amplitude",
          .kind = Parameter::Kind::per_material,
          .limits = amplitudes(chemistry.sputter_amplitude),
          .meaning = "A of Y_sp, per square root of an eV",
          .source = chemistry.values_source};
}

Parameter sputter_threshold(const PlasmaChemistry& chemistry) {
  return {.name = "sputter_threshold",
          .kind = Parameter::Kind::per_material,
          .dimension = Dimension::energy,
          .limits = energies(chemistry.sputter_threshold),
          .meaning = "energy below which nothing is sputtered",
          .source = chemistry.values_source};
}

Parameter sputter_factor_row(const PlasmaChemistry& chemistry) {
  return {.name = "sputter_factor",
          .kind = Parameter::Kind::per_material,
          .limits = {.fallback = chemistry.sputter_factor, .minimum = -1, .maximum = 1000},
          .meaning = "B of sputtering",
          .source = "9.3 for oxide and Si, 8.5 for polymer"};
}

Parameter enhanced_amplitude(const PlasmaChemistry& chemistry) {
  return {.name = "enhanced_amplitude",
          .limits = amplitudes(chemistry.enhanced_amplitude),
          .meaning = "A of Y_ie: what an ion etches of sites with etchant",
          .source = chemistry.values_source};
}

bool has_passivation(const PlasmaChemistry& chemistry) { return !chemistry.passivation.empty(); }

class Reader {
 public:
  Reader(const RecipeTable& step, const StepScope& scope, const PlasmaChemistry& chemistry)
      : step_(step), scope_(scope), chemistry_(chemistry) {}

  StepModel read() {
    PlasmaEtch::Values values;
    values.has_passivation = has_passivation(chemistry_);
    values.etchant_flux = read_value(step_, etchant_flux);
    values.sticking_in_balance = read_flag(step_, sticking_in_balance);
    values.etchant_desorption = read_value(step_, etchant_desorption);
    values.surfaces.resize(scope_.materials.size());
    read_surfaces(values.surfaces);
    values.species = {neutral(chemistry_.etchant)};
    if (values.has_passivation) {
      values.passivation_flux = read_value(step_, passivation_flux);
      values.passivation_desorption = read_value(step_, passivation_desorption);
      values.species.push_back(neutral(chemistry_.passivation));
    }
    const SharedYields yields = read_yields(values.surfaces);
    values.ions = PlasmaIons(step_, scope_, ion_flux, yields.laws(), values.species);
    return {std::make_shared<PlasmaEtch>(std::move(values))};
  }

 private:
  std::vector<float> per_material(const Parameter& parameter) const {
    return read_per_material(step_, parameter, scope_, std::nullopt);
  }

  void read_surfaces(std::vector<PlasmaEtch::Surface>& surfaces) const {
    const std::vector<float> of_etchant = per_material(etchant_sticking(chemistry_));
    for (std::size_t m = 0; m < surfaces.size(); ++m) {
      surfaces[m] = {.etchant_sticking = of_etchant[m],
                     .density = scope_.materials[static_cast<MaterialId>(m)].density};
    }
    if (has_passivation(chemistry_)) {
      const std::vector<float> of_passivation = per_material(passivation_sticking(chemistry_));
      for (std::size_t m = 0; m < surfaces.size(); ++m)
        surfaces[m].passivation_sticking = of_passivation[m];
    }
    for (const MaterialId m : read_material_list(step_, etches, scope_))
      surfaces[m].is_etched = true;
  }

  SharedYields read_yields(std::vector<PlasmaEtch::Surface>& surfaces) const {
    SharedYields yields;
    yields.tally_of({.name = "enhanced",
                     .amplitude = read_value(step_, enhanced_amplitude(chemistry_)),
                     .threshold = read_value(step_, enhanced_threshold),
                     .factor = enhanced_factor()},
                    enhanced_shape);
    if (has_passivation(chemistry_)) {
      yields.tally_of({.name = "removal",
                       .amplitude = read_value(step_, removal_amplitude),
                       .threshold = read_value(step_, removal_threshold),
                       .factor = enhanced_factor()},
                      removal_shape);
    }
    const std::vector<float> amplitude = per_material(sputter_amplitude(chemistry_));
    const std::vector<float> threshold = per_material(sputter_threshold(chemistry_));
    const std::vector<float> b = per_material(sputter_factor_row(chemistry_));
    for (const MaterialId m : scope_.reachable) {
      surfaces[m].sputter_yield =
          static_cast<int>(yields.tally_of({.name = "sputter_" + scope_.materials[m].name,
                                            .amplitude = amplitude[m],
                                            .threshold = threshold[m],
                                            .factor = sputter_factor(b[m])},
                                           b[m]));
    }
    return yields;
  }

  // Its sticking depends on what covers the surface.
  Species neutral(std::string_view name) const {
    Species species;
    species.name = name;
    species.sticking.assign(scope_.materials.size(), 1.0F);
    return species;
  }

  const RecipeTable& step_;
  const StepScope& scope_;
  const PlasmaChemistry& chemistry_;
};

}  // namespace

// theta_E : theta_P : bare sites = arriving / leaving of E : the same of P : 1, with denominators
// cleared. What does not arrive does not cover, whatever leaves.
PlasmaEtch::Coverage PlasmaEtch::coverage_at(const Surface& surface,
                                             std::span<const std::span<const float>> flux,
                                             std::size_t point) const {
  const double g_etchant = values_.sticking_in_balance ? surface.etchant_sticking : 1;
  const double g_passivation = values_.sticking_in_balance ? surface.passivation_sticking : 1;
  const double e = g_etchant * values_.etchant_flux * std::max(0.0F, flux[etchant][point]);
  const double e_leaves = values_.etchant_desorption + 2 * values_.ions.rate(flux, enhanced, point);
  const double p = values_.has_passivation ? g_passivation * values_.passivation_flux *
                                                 std::max(0.0F, flux[passivation][point])
                                           : 0;
  if (p == 0) return {.etchant = e == 0 ? 0 : e / (e + e_leaves)};
  const double p_leaves = values_.passivation_desorption + values_.ions.rate(flux, removal, point);
  if (e == 0) return {.passivation = p / (p + p_leaves)};
  if (e_leaves == 0 && p_leaves == 0) return {.etchant = e / (e + p), .passivation = p / (e + p)};
  const double all = e_leaves * p_leaves + e * p_leaves + p * e_leaves;
  return {.etchant = e * p_leaves / all, .passivation = p * e_leaves / all};
}

std::vector<std::string> PlasmaEtch::coverage_names() const {
  std::vector<std::string> names;
  for (std::size_t gas = 0; gas < gas_count(); ++gas) names.push_back(values_.species[gas].name);
  return names;
}

std::vector<std::vector<float>> PlasmaEtch::steady_coverages(
    const SurfacePoints& points, std::span<const std::span<const float>> flux) const {
  std::vector<std::vector<float>> coverages(gas_count(),
                                            std::vector<float>(points.material.size()));
  for (std::size_t p = 0; p < points.material.size(); ++p) {
    const Coverage here = coverage_at(values_.surfaces[points.material[p]], flux, p);
    coverages[etchant][p] = static_cast<float>(here.etchant);
    if (values_.has_passivation) coverages[passivation][p] = static_cast<float>(here.passivation);
  }
  return coverages;
}

std::vector<std::vector<float>> PlasmaEtch::covered_sticking(
    const SurfacePoints& points, std::span<const std::vector<float>> coverages) const {
  std::vector<std::vector<float>> sticking(values_.species.size());
  for (std::size_t gas = 0; gas < gas_count(); ++gas) sticking[gas].resize(points.material.size());
  for (std::size_t p = 0; p < points.material.size(); ++p) {
    const Surface& surface = values_.surfaces[points.material[p]];
    const float bare =
        1 - coverages[etchant][p] - (values_.has_passivation ? coverages[passivation][p] : 0);
    sticking[etchant][p] = surface.etchant_sticking * std::max(0.0F, bare);
    if (values_.has_passivation)
      sticking[passivation][p] = surface.passivation_sticking * std::max(0.0F, bare);
  }
  return sticking;
}

std::vector<float> PlasmaEtch::speeds(const SurfacePoints& points,
                                      std::span<const std::span<const float>> flux) const {
  std::vector<float> speeds(points.material.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    const Surface& surface = values_.surfaces[points.material[p]];
    double atoms = 0;
    if (surface.sputter_yield >= 0)
      atoms += values_.ions.rate(flux, static_cast<std::size_t>(surface.sputter_yield), p);
    if (surface.is_etched) {
      atoms += coverage_at(surface, flux, p).etchant *
               (values_.etchant_desorption / 4 + values_.ions.rate(flux, enhanced, p));
    }
    if (atoms > 0) speeds[p] = static_cast<float>(-atoms / surface.density);
  }
  return speeds;
}

std::vector<Parameter> plasma_etch_parameters(const PlasmaChemistry& chemistry) {
  const std::vector<Parameter> common = parameter_rows(
      etches, sputter_amplitude(chemistry), sputter_threshold(chemistry),
      sputter_factor_row(chemistry), enhanced_amplitude(chemistry), enhanced_threshold);
  if (!has_passivation(chemistry))
    return parameter_rows(etchant_flux, etchant_sticking(chemistry), sticking_in_balance,
                          etchant_desorption, common, ion_flux, ion_parameters());
  return parameter_rows(etchant_flux, passivation_flux, etchant_sticking(chemistry),
                        passivation_sticking(chemistry), sticking_in_balance, etchant_desorption,
                        passivation_desorption, common, removal_amplitude, removal_threshold,
                        ion_flux, ion_parameters());
}

StepModel read_plasma_etch(const RecipeTable& step, const StepScope& scope,
                           const PlasmaChemistry& chemistry) {
  return Reader(step, scope, chemistry).read();
}

ModelDescription plasma_etch_page(const PlasmaChemistry& chemistry,
                                  std::span<const Parameter> parameters) {
  return {.name = chemistry.name,
          .summary = chemistry.summary,
          .equation = equation,
          .symbols = symbols(has_passivation(chemistry)),
          .limits = limits,
          .source = chemistry.equations_source,
          .parameters = parameters,
          .read = nullptr,
          .takes_blanket_rates = true};
}

}  // namespace scarp

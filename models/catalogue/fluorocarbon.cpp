#include "models/catalogue/fluorocarbon.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>

#include "flux/sampling/portable_math.h"
#include "models/source_parameters.h"

namespace scarp {

namespace {

constexpr std::string_view equation =
    "v = (J_p F_p s_p - R_p phi_pe) / rho_p where phi_p >= 1, or on polymer that goes;\n"
    "    v = -(J_ev phi_e + R_ie phi_e + R_sp (1 - phi_e)) / rho of what is etched, "
    "v = -R_sp / rho of all else";

constexpr std::string_view symbols =
    "v is the speed along the outward normal. F is what arrives of a radical, first and later "
    "arrivals together, relative to an open flat wafer, J its flux there; e etches, p forms "
    "polymer. R is the flux of ions times their yield, Y(E, theta) = A max(0, sqrt(E) - "
    "sqrt(threshold)) f(theta): R_p takes off polymer and R_ie etches sites with etchant, both "
    "with "
    "f = cos(theta); R_sp sputters, with f = cos(theta) (1 + B sin^2(theta)). The parts of sites "
    "that hold etchant, phi_e, that are under polymer, phi_p, and of these that hold etchant, "
    "phi_pe, follow what arrives: phi_pe = J_e F_e s_pe / (J_e F_e s_pe + R_p), phi_p = J_p F_p "
    "s_p "
    "/ (R_p phi_pe + delta) with delta = 1e15 /cm2/s, phi_e = J_e F_e s_e (1 - phi_p) / (2 R_ie + "
    "2 J_ev + J_e F_e s_e). Where phi_p reaches 1 polymer grows, as a layer of its own. J_ev = K "
    "exp(-E_a / k T) J_e leaves a covered surface without ions. Etchant sticks to bare sites with "
    "probability s_e and to bare polymer with s_pe; the former of polymer sticks with s_p. What "
    "does not stick is re-emitted by the cosine law. rho is the density of the material, s_pe the "
    "etchant_sticking of polymer.";

// Tallies of an ion: its arrivals, then its yields.
constexpr std::size_t removal = 1;
constexpr std::size_t etchant = 0;  // species, and tally
constexpr std::size_t former = 1;   // species, and tally

// Coverages: of each site exactly one, or none.
enum Covered : std::size_t { by_etchant, by_polymer, by_polymer_with_etchant };

constexpr double delta = 1;                // 1e15 /cm2/s
constexpr double atoms_per_product = 2;    // k_ie and k_ev: etchant that goes with what is etched
constexpr double boltzmann = 8.617333e-5;  // eV/K

constexpr Limits fluxes(std::string_view fallback) {
  return {.fallback = fallback, .minimum = 0, .maximum = 1e10};
}
constexpr Limits energies(std::string_view fallback) {
  return {.fallback = fallback, .minimum = 0, .maximum = 1e6};
}
constexpr Limits numbers(std::string_view fallback, double least, double most) {
  return {.fallback = fallback, .minimum = least, .maximum = most};
}
constexpr std::string_view la_magna = "La Magna, Garozzo 2003";

const Parameter etchant_flux{.name = "etchant_flux",
                             .dimension = Dimension::flux,
                             .limits = fluxes("5e17 /cm2/s"),
                             .meaning = "J_e of an open flat wafer",
                             .source = "reactor: p / sqrt(2 pi m k T)"};
const Parameter polymer_flux{.name = "polymer_flux",
                             .dimension = Dimension::flux,
                             .limits = fluxes("1e17 /cm2/s"),
                             .meaning = "J_p of an open flat wafer",
                             .source = "reactor: p / sqrt(2 pi m k T)"};
const Parameter polymer{.name = "material",
                        .kind = Parameter::Kind::material,
                        .limits = {.fallback = "polymer"},
                        .meaning = "what the polymer is called"};
const Parameter etchant_sticking{
    .name = "etchant_sticking",
    .kind = Parameter::Kind::per_material,
    .limits = numbers("{ SiO2 = 0.9, Si3N4 = 0.9, Si = 0.9, polySi = 0.9, polymer = 0.6, "
                      "default = 0.1 }",
                      0, 1),
    .meaning = "s_e: probability that etchant sticks to a bare surface",
    .source = la_magna};
const Parameter polymer_sticking{
    .name = "polymer_sticking",
    .kind = Parameter::Kind::per_material,
    .limits = numbers("{ SiO2 = 0.26, Si3N4 = 0.26, Si = 0.26, polySi = 0.26, polymer = 0.26, "
                      "default = 0.01 }",
                      0, 1),
    .meaning = "s_p: probability that the former of polymer sticks",
    .source = la_magna};
const Parameter etches{.name = "etches",
                       .kind = Parameter::Kind::material_list,
                       .limits = {.fallback = "[\"SiO2\", \"Si3N4\", \"Si\", \"polySi\"]"},
                       .meaning = "what the etchant reacts with; all else is sputtered only",
                       .source = "the process"};
const Parameter enhanced_amplitude{.name = "enhanced_amplitude",
                                   .kind = Parameter::Kind::per_material,
                                   .limits = numbers("0.0361", 0, 1e6),
                                   .meaning = "A of Y_ie of what is etched",
                                   .source = la_magna};
const Parameter enhanced_threshold{.name = "enhanced_threshold",
                                   .kind = Parameter::Kind::per_material,
                                   .dimension = Dimension::energy,
                                   .limits = energies("4 eV"),
                                   .meaning = "energy below which ions etch no covered site",
                                   .source = la_magna};
const Parameter sputter_amplitude{.name = "sputter_amplitude",
                                  .kind = Parameter::Kind::per_material,
                                  .limits = numbers("0.0139", 0, 1e6),
                                  .meaning =
                                      "A of Y_sp, per square root of an eV; polymer has "
                                      "none",
                                  .source = la_magna};
const Parameter sputter_threshold{.name = "sputter_threshold",
                                  .kind = Parameter::Kind::per_material,
                                  .dimension = Dimension::energy,
                                  .limits = energies("{ mask = \"20 eV\", default = \"18 eV\" }"),
                                  .meaning = "energy below which nothing is sputtered",
                                  .source = la_magna};
const Parameter sputter_b{.name = "sputter_factor",
                          .kind = Parameter::Kind::per_material,
                          .limits = numbers("9.3", -1, 1000),
                          .meaning = "B of sputtering",
                          .source = "9.3 for oxide and Si, 8.5 for polymer"};
const Parameter removal_amplitude{.name = "removal_amplitude",
                                  .limits = numbers("0.0722", 0, 1e6),
                                  .meaning = "A of Y_p: what an ion takes off of the polymer",
                                  .source = la_magna};
const Parameter removal_threshold{.name = "removal_threshold",
                                  .dimension = Dimension::energy,
                                  .limits = energies("4 eV"),
                                  .meaning = "energy below which it takes off nothing",
                                  .source = la_magna};
const Parameter evaporation{.name = "evaporation",
                            .kind = Parameter::Kind::per_material,
                            .limits = numbers("2.789e-3", 0, 1e6),
                            .meaning = "K of J_ev",
                            .source = la_magna};
const Parameter activation{.name = "activation_energy",
                           .kind = Parameter::Kind::per_material,
                           .dimension = Dimension::energy,
                           .limits = energies("0.168 eV"),
                           .meaning = "E_a of J_ev",
                           .source = la_magna};
const Parameter temperature{.name = "temperature",
                            .dimension = Dimension::temperature,
                            .limits = {.fallback = "300 K", .minimum = 1, .maximum = 5000},
                            .meaning = "T of the wafer"};
const Parameter ion_flux{.name = "ion.flux",
                         .dimension = Dimension::flux,
                         .limits = fluxes("5.6e16 /cm2/s"),
                         .meaning = "J_i of an open flat wafer",
                         .source = "probe: ion current / charge"};

std::span<const Parameter> parameters() {
  static const std::vector<Parameter> rows =
      parameter_rows(etchant_flux, polymer_flux, polymer, etchant_sticking, polymer_sticking,
                     etches, enhanced_amplitude, enhanced_threshold, sputter_amplitude,
                     sputter_threshold, sputter_b, removal_amplitude, removal_threshold,
                     evaporation, activation, temperature, ion_flux, ion_parameters());
  return rows;
}

AngleTable cosine() {
  return AngleTable([](double theta) { return std::max(0.0, std::cos(theta)); });
}

class Reader {
 public:
  Reader(const RecipeTable& step, const StepScope& scope)
      : step_(step),
        scope_(scope),
        polymer_(step.material(polymer.name, scope.materials, polymer.limits.fallback)) {}

  StepModel read() {
    Fluorocarbon::Values values;
    values.etchant_flux = read_value(step_, etchant_flux);
    values.polymer_flux = read_value(step_, polymer_flux);
    values.polymer = polymer_;
    values.surfaces.resize(scope_.materials.size());
    read_surfaces(values);
    values.species = {neutral("etchant", values, &Fluorocarbon::Surface::etchant_sticking),
                      neutral("polymer_former", values, &Fluorocarbon::Surface::polymer_sticking)};
    read_yields(values.surfaces);
    values.ions = PlasmaIons(step_, scope_, ion_flux, yields_.laws(), values.species);
    return {std::make_shared<Fluorocarbon>(std::move(values)), polymer_};
  }

 private:
  std::vector<float> per_material(const Parameter& parameter) const {
    return read_per_material(step_, parameter, scope_, polymer_);
  }

  void read_surfaces(Fluorocarbon::Values& values) const {
    const std::vector<float> of_etchant = per_material(etchant_sticking);
    const std::vector<float> of_polymer = per_material(polymer_sticking);
    const std::vector<float> factor = per_material(evaporation);
    const std::vector<float> barrier = per_material(activation);
    const double thermal = boltzmann * read_value(step_, temperature);
    for (std::size_t m = 0; m < values.surfaces.size(); ++m) {
      values.surfaces[m] = {
          .density = scope_.materials[static_cast<MaterialId>(m)].density,
          .etchant_sticking = of_etchant[m],
          .polymer_sticking = of_polymer[m],
          .evaporation = factor[m] * portable_exp(-barrier[m] / thermal) * values.etchant_flux};
    }
  }

  void read_yields(std::vector<Fluorocarbon::Surface>& surfaces) {
    yields_.tally_of({.name = "removal",
                      .amplitude = read_value(step_, removal_amplitude),
                      .threshold = read_value(step_, removal_threshold),
                      .factor = cosine()},
                     cosine_shape);
    const std::vector<float> a_ie = per_material(enhanced_amplitude);
    const std::vector<float> least_ie = per_material(enhanced_threshold);
    const std::vector<float> a_sp = per_material(sputter_amplitude);
    const std::vector<float> least_sp = per_material(sputter_threshold);
    const std::vector<float> b = per_material(sputter_b);
    const std::vector<MaterialId> etched = read_material_list(step_, etches, scope_);
    for (const MaterialId m : met_by(scope_, polymer_)) {
      if (m == polymer_) continue;  // ions take it off by its removal
      const std::string& name = scope_.materials[m].name;
      surfaces[m].sputter_yield = tally_of({.name = "sputter_" + name,
                                            .amplitude = a_sp[m],
                                            .threshold = least_sp[m],
                                            .factor = sputter_factor(b[m])},
                                           b[m]);
      if (std::ranges::find(etched, m) == etched.end()) continue;
      surfaces[m].enhanced_yield = tally_of({.name = "enhanced_" + name,
                                             .amplitude = a_ie[m],
                                             .threshold = least_ie[m],
                                             .factor = cosine()},
                                            cosine_shape);
    }
  }

  int tally_of(const YieldLaw& law, double shape) {
    return static_cast<int>(yields_.tally_of(law, shape));
  }

  Species neutral(std::string_view name, const Fluorocarbon::Values& values,
                  double Fluorocarbon::Surface::*its_sticking) const {
    Species species;
    species.name = name;
    species.sticking.clear();
    for (const Fluorocarbon::Surface& surface : values.surfaces)
      species.sticking.push_back(static_cast<float>(surface.*its_sticking));
    return species;
  }

  const RecipeTable& step_;
  const StepScope& scope_;
  MaterialId polymer_;
  SharedYields yields_;
};

StepModel read(const RecipeTable& step, const StepScope& scope) {
  return Reader(step, scope).read();
}

}  // namespace

// Nothing covers what does not arrive, whatever leaves.
Fluorocarbon::Site Fluorocarbon::site_at(MaterialId material,
                                         std::span<const std::span<const float>> flux,
                                         std::size_t point) const {
  const Surface& surface = values_.surfaces[material];
  const double arrives = values_.etchant_flux * std::max(0.0F, flux[etchant][point]);
  const double sticks =
      surface.polymer_sticking * values_.polymer_flux * std::max(0.0F, flux[former][point]);
  const double removed = values_.ions.rate(flux, removal, point);
  Site site;
  const double on_polymer = arrives * values_.surfaces[values_.polymer].etchant_sticking;
  if (on_polymer > 0) site.on_polymer = on_polymer / (on_polymer + removed);
  site.net_polymer = sticks - removed * site.on_polymer;
  site.polymer = sticks / (removed * site.on_polymer + delta);
  const double on_site = arrives * surface.etchant_sticking;
  if (material == values_.polymer || site.polymer >= 1 || on_site == 0) return site;
  const double leaves =
      surface.enhanced_yield < 0
          ? 0
          : atoms_per_product *
                (values_.ions.rate(flux, static_cast<std::size_t>(surface.enhanced_yield), point) +
                 surface.evaporation);
  site.etchant = on_site * (1 - site.polymer) / (leaves + on_site);
  return site;
}

std::vector<std::string> Fluorocarbon::coverage_names() const {
  return {"etchant", "polymer", "polymer_with_etchant"};
}

std::vector<std::vector<float>> Fluorocarbon::steady_coverages(
    const SurfacePoints& points, std::span<const std::span<const float>> flux) const {
  std::vector<std::vector<float>> coverages(3, std::vector<float>(points.material.size()));
  for (std::size_t p = 0; p < points.material.size(); ++p) {
    const Site site = site_at(points.material[p], flux, p);
    const double under = points.material[p] == values_.polymer ? 1.0 : std::min(1.0, site.polymer);
    coverages[by_etchant][p] = static_cast<float>(site.etchant);
    coverages[by_polymer][p] = static_cast<float>(under * (1 - site.on_polymer));
    coverages[by_polymer_with_etchant][p] = static_cast<float>(under * site.on_polymer);
  }
  return coverages;
}

std::vector<std::vector<float>> Fluorocarbon::covered_sticking(
    const SurfacePoints& points, std::span<const std::vector<float>> coverages) const {
  std::vector<std::vector<float>> sticking(values_.species.size());
  sticking[etchant].resize(points.material.size());
  const double to_polymer = values_.surfaces[values_.polymer].etchant_sticking;
  for (std::size_t p = 0; p < points.material.size(); ++p) {
    double bare = 1;
    for (const std::vector<float>& coverage : coverages) bare -= coverage[p];
    const double to_site = values_.surfaces[points.material[p]].etchant_sticking;
    sticking[etchant][p] =
        static_cast<float>(to_site * std::max(0.0, bare) + to_polymer * coverages[by_polymer][p]);
  }
  return sticking;
}

std::vector<float> Fluorocarbon::speeds(const SurfacePoints& points,
                                        std::span<const std::span<const float>> flux) const {
  std::vector<float> speeds(points.material.size());
  const double polymer_density = values_.surfaces[values_.polymer].density;
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    const MaterialId material = points.material[p];
    const Surface& surface = values_.surfaces[material];
    const Site site = site_at(material, flux, p);
    double speed = 0;
    if (site.polymer >= 1) {
      speed = site.net_polymer / polymer_density;
    } else if (material == values_.polymer) {
      speed = std::min(site.net_polymer, 0.0) / polymer_density;
    } else if (surface.sputter_yield >= 0) {
      const double sputtered =
          values_.ions.rate(flux, static_cast<std::size_t>(surface.sputter_yield), p);
      double atoms = sputtered;
      if (surface.enhanced_yield >= 0) {
        const double etched =
            values_.ions.rate(flux, static_cast<std::size_t>(surface.enhanced_yield), p);
        atoms = site.etchant * (surface.evaporation + etched) + (1 - site.etchant) * sputtered;
      }
      speed = -atoms / surface.density;
    }
    speeds[p] = static_cast<float>(speed);
  }
  return speeds;
}

ModelDescription fluorocarbon_description() {
  return {
      .name = "fluorocarbon",
      .summary = "oxide, nitride and silicon in a fluorocarbon plasma that etches or grows polymer",
      .equation = equation,
      .symbols = symbols,
      .limits =
          "Coverages follow at once what arrives. Molecules meet walls and not each other (mean "
          "free "
          "path above ten widths). What etches and what grows polymer are one radical each; the "
          "numbers of the materials are examples and no calibration. Where polymer sets in the "
          "speed "
          "jumps by delta / rho_p, 0.5 nm/s. Polymer on what is etched thins out by ions alone.",
      .source =
          "A. La Magna, G. Garozzo, J. Electrochem. Soc. 150, F178 (2003); G. Kokkoris et al. "
          "(2004)",
      .parameters = parameters(),
      .read = read,
      .takes_blanket_rates = true};
}

}  // namespace scarp

#include "models/catalogue/cf4_o2.h"

#include <algorithm>
#include <memory>

#include "flux/sampling/portable_math.h"
#include "models/source_parameters.h"

namespace scarp {

namespace {

constexpr std::string_view source = "ViennaPS; silicon: Belen et al. 2005";

// k_x = k exp(this x).
constexpr double germanium_exponent = 0.4675;

constexpr Limits fluxes(std::string_view fallback) {
  return {.fallback = fallback, .minimum = 0, .maximum = 1e10};
}
constexpr Limits parts(std::string_view fallback) {
  return {.fallback = fallback, .minimum = 0, .maximum = 1};
}
constexpr Limits numbers(std::string_view fallback, double minimum, double maximum) {
  return {.fallback = fallback, .minimum = minimum, .maximum = maximum};
}
constexpr Limits energies(std::string_view fallback) {
  return {.fallback = fallback, .minimum = 0, .maximum = 1e6};
}

Parameter flux_row(std::string_view name, std::string_view fallback, std::string_view meaning) {
  return {.name = name,
          .dimension = Dimension::flux,
          .limits = fluxes(fallback),
          .meaning = meaning,
          .source = "reactor: p / sqrt(2 pi m k T)"};
}

Parameter sticking_row(std::string_view name, std::string_view fallback, std::string_view meaning) {
  return {.name = name,
          .kind = Parameter::Kind::per_material,
          .limits = parts(fallback),
          .meaning = meaning,
          .source = source};
}

const Parameter fluorine_flux =
    flux_row("fluorine_flux", "5e17 /cm2/s", "J_F of an open flat wafer");
const Parameter oxygen_flux = flux_row("oxygen_flux", "5e16 /cm2/s", "J_O of an open flat wafer");
const Parameter carbon_flux = flux_row("carbon_flux", "5e15 /cm2/s", "J_C of an open flat wafer");
const Parameter fluorine_sticking =
    sticking_row("fluorine_sticking", "0.7", "g_F: probability that F sticks to a bare surface");
const Parameter oxygen_sticking =
    sticking_row("oxygen_sticking", "1", "g_O: probability that O sticks to a bare surface");
const Parameter carbon_sticking =
    sticking_row("carbon_sticking", "1", "g_C: probability that C sticks to a bare surface");
const Parameter fluorine_on_oxygen{.name = "fluorine_on_oxygen",
                                   .limits = parts("0.3"),
                                   .meaning = "g_FO: probability that F sticks to oxygen",
                                   .source = source};
const Parameter oxygen_on_carbon{.name = "oxygen_on_carbon",
                                 .limits = parts("0.3"),
                                 .meaning = "g_OC: probability that O sticks to carbon",
                                 .source = source};
const Parameter carbon_on_oxygen{.name = "carbon_on_oxygen",
                                 .limits = parts("0.3"),
                                 .meaning = "g_CO: probability that C sticks to oxygen",
                                 .source = source};
const Parameter sticking_in_balance{.name = "sticking_in_balance",
                                    .kind = Parameter::Kind::flag,
                                    .limits = {.fallback = "false"},
                                    .meaning = "true: g_F, g_O and g_C count in the balance, too",
                                    .source = source};
const Parameter fluorine_desorption{.name = "fluorine_desorption",
                                    .dimension = Dimension::flux,
                                    .limits = fluxes("3e17 /cm2/s"),
                                    .meaning = "k: what leaves covered silicon without ions",
                                    .source = source};
const Parameter oxygen_desorption{.name = "oxygen_desorption",
                                  .dimension = Dimension::flux,
                                  .limits = fluxes("4e13 /cm2/s"),
                                  .meaning = "b_s: what leaves a covered surface without ions",
                                  .source = source};
const Parameter etches{.name = "etches",
                       .kind = Parameter::Kind::material_list,
                       .limits = {.fallback = "[\"Si\", \"polySi\", \"SiGe\"]"},
                       .meaning = "what fluorine reacts with; all else is sputtered only",
                       .source = "the process"};
const Parameter germanium{.name = "germanium",
                          .kind = Parameter::Kind::per_material,
                          .limits = parts("{ SiGe = 0.3, default = 0 }"),
                          .meaning = "x: part of germanium in what is etched",
                          .source = "the material; its density 5.02 - 0.6 x, in 1e22 /cm3"};
const Parameter sputter_amplitude{
    .name = "sputter_amplitude",
    .kind = Parameter::Kind::per_material,
    .limits = numbers("{ Si = 0.0337, polySi = 0.0337, SiGe = 0.03, default = 0.0139 }", 0, 1e6),
    .meaning = "A of Y_sp, per square root of an eV",
    .source = source};
const Parameter sputter_threshold{.name = "sputter_threshold",
                                  .kind = Parameter::Kind::per_material,
                                  .dimension = Dimension::energy,
                                  .limits = energies("{ SiGe = \"18 eV\", default = \"20 eV\" }"),
                                  .meaning = "energy below which nothing is sputtered",
                                  .source = source};
const Parameter sputter_b{.name = "sputter_factor",
                          .kind = Parameter::Kind::per_material,
                          .limits = numbers("9.3", -1, 1000),
                          .meaning = "B of sputtering",
                          .source = "9.3 for oxide and Si"};
const Parameter enhanced_amplitude{.name = "enhanced_amplitude",
                                   .kind = Parameter::Kind::per_material,
                                   .limits = numbers("{ SiGe = 6.5, default = 7 }", 0, 1e6),
                                   .meaning = "A of Y_ie of what is etched",
                                   .source = source};
const Parameter enhanced_threshold{.name = "enhanced_threshold",
                                   .kind = Parameter::Kind::per_material,
                                   .dimension = Dimension::energy,
                                   .limits = energies("{ SiGe = \"14 eV\", default = \"15 eV\" }"),
                                   .meaning = "energy below which ions etch no site with fluorine",
                                   .source = source};
const Parameter oxygen_removal_amplitude{.name = "oxygen_removal_amplitude",
                                         .limits = numbers("3", 0, 1e6),
                                         .meaning = "A of Y_O: what an ion takes off of the oxygen",
                                         .source = source};
const Parameter oxygen_removal_threshold{.name = "oxygen_removal_threshold",
                                         .dimension = Dimension::energy,
                                         .limits = energies("10 eV"),
                                         .meaning = "energy below which it takes off none",
                                         .source = source};
const Parameter carbon_removal_amplitude{.name = "carbon_removal_amplitude",
                                         .limits = numbers("3", 0, 1e6),
                                         .meaning = "A of Y_C: what an ion takes off of the carbon",
                                         .source = source};
const Parameter carbon_removal_threshold{.name = "carbon_removal_threshold",
                                         .dimension = Dimension::energy,
                                         .limits = energies("10 eV"),
                                         .meaning = "energy below which it takes off none",
                                         .source = source};
const Parameter ion_flux{.name = "ion.flux",
                         .dimension = Dimension::flux,
                         .limits = fluxes("1.2e16 /cm2/s"),
                         .meaning = "J_i of an open flat wafer",
                         .source = "probe: ion current / charge"};

std::span<const Parameter> parameters() {
  static const std::vector<Parameter> rows = parameter_rows(
      fluorine_flux, oxygen_flux, carbon_flux, fluorine_sticking, oxygen_sticking, carbon_sticking,
      fluorine_on_oxygen, oxygen_on_carbon, carbon_on_oxygen, sticking_in_balance,
      fluorine_desorption, oxygen_desorption, etches, germanium, sputter_amplitude,
      sputter_threshold, sputter_b, enhanced_amplitude, enhanced_threshold,
      oxygen_removal_amplitude, oxygen_removal_threshold, carbon_removal_amplitude,
      carbon_removal_threshold, ion_flux, ion_parameters());
  return rows;
}

class Reader {
 public:
  Reader(const RecipeTable& step, const StepScope& scope) : step_(step), scope_(scope) {}

  StepModel read() {
    Cf4O2::Values values{.flux = {read_value(step_, fluorine_flux), read_value(step_, oxygen_flux),
                                  read_value(step_, carbon_flux)},
                         .fluorine_desorption = read_value(step_, fluorine_desorption),
                         .oxygen_desorption = read_value(step_, oxygen_desorption),
                         .oxidised_sticking = read_value(step_, fluorine_on_oxygen),
                         .passivated_sticking = read_value(step_, oxygen_on_carbon),
                         .carbon_sticking = read_value(step_, carbon_on_oxygen),
                         .sticking_in_balance = read_flag(step_, sticking_in_balance)};
    read_surfaces(values.surfaces);
    for (const std::string_view name : {"F", "O", "C"}) {
      // Follows what covers the surface.
      values.species.push_back({.name = std::string(name),
                                .sticking = std::vector<float>(scope_.materials.size(), 1.0F)});
    }
    read_yields(values);
    if (step_.has("ion")) {
      values.ions = PlasmaIons(step_, scope_, ion_flux, yields_.laws(), values.species);
    } else {
      require_etch(values);
    }
    return {std::make_shared<Cf4O2>(std::move(values))};
  }

 private:
  std::vector<float> per_material(const Parameter& parameter) const {
    return read_per_material(step_, parameter, scope_, std::nullopt);
  }

  // Without ions fluorine takes what `etches` names, and nothing else goes.
  void require_etch(const Cf4O2::Values& values) const {
    require_one(
        step_, scope_, etches, [&](MaterialId m) { return values.surfaces[m].is_etched; },
        "is nothing that",
        "and there are no ions, so cf4_o2 etches nothing; name a material that is there");
    if (step_.ok(fluorine_flux.name) && values.flux.front() == 0)
      step_.error(fluorine_flux.name,
                  "is 0, and there are no ions, so cf4_o2 etches nothing; give one of them");
  }

  void read_surfaces(std::vector<Cf4O2::Surface>& surfaces) const {
    const std::vector<float> of_fluorine = per_material(fluorine_sticking);
    const std::vector<float> of_oxygen = per_material(oxygen_sticking);
    const std::vector<float> of_carbon = per_material(carbon_sticking);
    const std::vector<float> x = per_material(germanium);
    for (std::size_t m = 0; m < scope_.materials.size(); ++m)
      surfaces.push_back({.sticking = {of_fluorine[m], of_oxygen[m], of_carbon[m]},
                          .germanium = x[m],
                          .density = scope_.materials[static_cast<MaterialId>(m)].density});
    for (const MaterialId m : read_material_list(step_, etches, scope_))
      surfaces[m].is_etched = true;
  }

  void read_yields(Cf4O2::Values& values) {
    values.oxygen_yield =
        yields_.tally_of({.name = "oxygen_removal",
                          .amplitude = read_value(step_, oxygen_removal_amplitude),
                          .threshold = read_value(step_, oxygen_removal_threshold),
                          .factor = enhanced_factor()},
                         enhanced_shape);
    values.carbon_yield =
        yields_.tally_of({.name = "carbon_removal",
                          .amplitude = read_value(step_, carbon_removal_amplitude),
                          .threshold = read_value(step_, carbon_removal_threshold),
                          .factor = enhanced_factor()},
                         enhanced_shape);
    const std::vector<float> a_ie = per_material(enhanced_amplitude);
    const std::vector<float> least_ie = per_material(enhanced_threshold);
    const std::vector<float> a_sp = per_material(sputter_amplitude);
    const std::vector<float> least_sp = per_material(sputter_threshold);
    const std::vector<float> b = per_material(sputter_b);
    for (const MaterialId m : scope_.reachable) {
      Cf4O2::Surface& surface = values.surfaces[m];
      const std::string& name = scope_.materials[m].name;
      surface.sputter_yield = yields_.tally_of({.name = "sputter_" + name,
                                                .amplitude = a_sp[m],
                                                .threshold = least_sp[m],
                                                .factor = sputter_factor(b[m])},
                                               b[m]);
      if (!surface.is_etched) continue;
      surface.enhanced_yield = yields_.tally_of({.name = "enhanced_" + name,
                                                 .amplitude = a_ie[m],
                                                 .threshold = least_ie[m],
                                                 .factor = enhanced_factor()},
                                                enhanced_shape);
    }
  }

  const RecipeTable& step_;
  const StepScope& scope_;
  SharedYields yields_;
};

StepModel read(const RecipeTable& step, const StepScope& scope) {
  return Reader(step, scope).read();
}

double rate_with_germanium(double k, double x) { return k * portable_exp(germanium_exponent * x); }

}  // namespace

double Cf4O2::ions_of(std::size_t yield, std::span<const std::span<const float>> flux,
                      std::size_t point) const {
  return yield == 0 ? 0 : values_.ions.rate(flux, yield, point);
}

// Coverages are to each other and to the bare sites as arrivals over what leaves, and 1; with
// denominators cleared.
Cf4O2::Coverage Cf4O2::coverage_at(const Surface& surface,
                                   std::span<const std::span<const float>> flux,
                                   std::size_t point) const {
  Coverage arrives{};
  for (std::size_t gas = 0; gas < gas_count; ++gas)
    arrives[gas] = values_.flux[gas] * std::max(0.0F, flux[gas][point]);
  Coverage leaves{rate_with_germanium(values_.fluorine_desorption, surface.germanium) +
                      2 * ions_of(surface.enhanced_yield, flux, point),
                  values_.oxygen_desorption + ions_of(values_.oxygen_yield, flux, point) +
                      (surface.germanium > 0 ? arrives[fluorine] : 0),
                  ions_of(values_.carbon_yield, flux, point) + arrives[oxygen]};
  double stuck = 0;  // what arrives of gases of which nothing leaves
  for (std::size_t gas = 0; gas < gas_count; ++gas) {
    if (values_.sticking_in_balance) arrives[gas] *= surface.sticking[gas];
    if (arrives[gas] == 0) leaves[gas] = 1;
    if (leaves[gas] == 0) stuck += arrives[gas];
  }
  Coverage theta{};
  for (std::size_t gas = 0; gas < gas_count; ++gas) {
    if (stuck > 0) {
      theta[gas] = leaves[gas] == 0 ? arrives[gas] / stuck : 0;
      continue;
    }
    const double others = leaves[(gas + 1) % gas_count] * leaves[(gas + 2) % gas_count];
    theta[gas] = arrives[gas] * others;
  }
  if (stuck > 0) return theta;
  double all = leaves[fluorine] * leaves[oxygen] * leaves[carbon];
  for (const double part : theta) all += part;
  for (double& part : theta) part /= all;
  return theta;
}

std::vector<std::vector<float>> Cf4O2::steady_coverages(
    const SurfacePoints& points, std::span<const std::span<const float>> flux) const {
  std::vector<std::vector<float>> coverages(gas_count, std::vector<float>(points.material.size()));
  for (std::size_t p = 0; p < points.material.size(); ++p) {
    const Coverage theta = coverage_at(values_.surfaces[points.material[p]], flux, p);
    for (std::size_t gas = 0; gas < gas_count; ++gas)
      coverages[gas][p] = static_cast<float>(theta[gas]);
  }
  return coverages;
}

std::vector<std::vector<float>> Cf4O2::covered_sticking(
    const SurfacePoints& points, std::span<const std::vector<float>> coverages) const {
  std::vector<std::vector<float>> sticking(values_.species.size());
  for (std::size_t gas = 0; gas < gas_count; ++gas) sticking[gas].resize(points.material.size());
  for (std::size_t p = 0; p < points.material.size(); ++p) {
    const double on_oxygen = coverages[oxygen][p];
    const double on_carbon = coverages[carbon][p];
    const double bare = std::max(0.0, 1 - coverages[fluorine][p] - on_oxygen - on_carbon);
    const Surface& surface = values_.surfaces[points.material[p]];
    const Coverage covered{values_.oxidised_sticking * on_oxygen,
                           values_.passivated_sticking * on_carbon,
                           values_.carbon_sticking * on_oxygen};
    for (std::size_t gas = 0; gas < gas_count; ++gas)
      sticking[gas][p] =
          static_cast<float>(std::min(1.0, surface.sticking[gas] * bare + covered[gas]));
  }
  return sticking;
}

// k of the speed.
double Cf4O2::desorption(const Surface& surface, const Coverage& theta) const {
  const double k = values_.fluorine_desorption;
  if (surface.germanium == 0) return k;
  const double oxidised = rate_with_germanium(k, 1);
  if (theta[oxygen] > 0.5 * theta[fluorine]) return oxidised;
  return (theta[fluorine] - theta[oxygen]) * rate_with_germanium(k, surface.germanium) +
         theta[oxygen] * oxidised;
}

std::vector<float> Cf4O2::speeds(const SurfacePoints& points,
                                 std::span<const std::span<const float>> flux) const {
  std::vector<float> speeds(points.material.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    const Surface& surface = values_.surfaces[points.material[p]];
    double atoms = ions_of(surface.sputter_yield, flux, p);
    if (surface.is_etched) {
      const Coverage theta = coverage_at(surface, flux, p);
      atoms += theta[fluorine] *
               (desorption(surface, theta) / 4 + ions_of(surface.enhanced_yield, flux, p));
    }
    if (atoms > 0) speeds[p] = static_cast<float>(-atoms / surface.density);
  }
  return speeds;
}

ModelDescription cf4_o2_description() {
  return {
      .name = "cf4_o2",
      .summary = "silicon-germanium etched selectively against silicon in CF4/O2",
      .equation =
          "v = -(k theta_F / 4 + R_sp + theta_F R_ie) / rho of what is etched, "
          "v = -R_sp / rho of all else",
      .symbols =
          "v is the speed along the outward normal. theta_F, theta_O and theta_C are the parts of "
          "the sites that hold fluorine, oxygen and carbon, b = 1 - theta_F - theta_O - theta_C is "
          "bare; in balance with what arrives J_F F_F b = (k_x + 2 R_ie) theta_F, J_O F_O b = (b_s "
          "+ R_O + [x > 0] J_F F_F) theta_O and J_C F_C b = (R_C + J_O F_O) theta_C: fluorine "
          "takes oxygen off silicon-germanium, oxygen takes off carbon. k_x = k exp(0.4675 x) for "
          "a part x of germanium. The k of the speed is k_0 on silicon; on silicon-germanium it is "
          "k_1 where theta_O > theta_F / 2, and (theta_F - theta_O) k_x + theta_O k_1 elsewhere. F "
          "is what arrives of a gas, first and later arrivals together, relative to an open flat "
          "wafer; it leaves the source with a density cos(theta) per solid angle. F sticks with "
          "probability g_F b + g_FO theta_O, O with g_O b + g_OC theta_C, C with g_C b + g_CO "
          "theta_O, or is re-emitted by the cosine law. R is the flux of ions times their yield, "
          "Y(E, theta) = A max(0, sqrt(E) - sqrt(threshold)) f(theta): R_sp with f = cos(theta) (1 "
          "+ B sin^2(theta)), R_ie, R_O and R_C with f = 1 up to 60 deg and from there linear to 0 "
          "at 90 deg. rho is the density of the material. Without [[step.ion]] tables there are no "
          "ions.",
      .limits =
          "Coverages follow at once what arrives. Molecules meet walls and not each other (mean "
          "free path above ten widths). Carbon covers, it grows no film. The rates of "
          "silicon-germanium are those of one simulator, not a calibration; its k jumps where "
          "theta_O = theta_F / 2.",
      .source = "ViennaPS; R. J. Belen et al., J. Vac. Sci. Technol. A 23, 99 (2005) for silicon",
      .parameters = parameters(),
      .read = read,
      .takes_blanket_rates = true};
}

}  // namespace scarp

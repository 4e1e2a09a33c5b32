#include "models/catalogue/multi_particle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/error.h"
#include "models/ion_parameters.h"
#include "models/source_parameters.h"

namespace scarp {

namespace {

constexpr Column yield_column{"yield", Dimension::number, {.minimum = 0, .maximum = 1e6}};
constexpr std::array factor_by_angle{
    angle_column, Column{"factor", Dimension::number, {.minimum = 0, .maximum = 1e6}}};
constexpr std::array yield_by_energy{energy_column, yield_column};
constexpr std::array yield_by_both{energy_column, angle_column, yield_column};

const Parameter rate{.name = "rate",
                     .kind = Parameter::Kind::formula,
                     .meaning = "speed as a formula of the names below; growth is positive",
                     .source = "blanket wafers"};
const Parameter deposited{.name = "material",
                          .kind = Parameter::Kind::material,
                          .needed = "when a rate can be positive",
                          .meaning = "what is deposited"};
const Parameter neutral_name{
    .name = "neutral.name", .kind = Parameter::Kind::text, .meaning = "of its flux in formulas"};
const Parameter neutral_sticking{.name = "neutral.sticking",
                                 .kind = Parameter::Kind::per_material,
                                 .limits = {.fallback = "1", .minimum = 0, .maximum = 1},
                                 .meaning = "probability that it stays where it arrives"};
const Parameter neutral_power = source_power_parameter("neutral.source_power");
const Parameter neutral_table = source_table_parameter("neutral.source_table");
const Parameter neutral_map = source_map_parameter("neutral.source_map");
const Parameter neutral_tilt = tilt_parameter("neutral.tilt");
const Parameter neutral_azimuth = azimuth_parameter("neutral.azimuth");
const Parameter neutral_rotating = rotating_parameter("neutral.rotating");
const Parameter ion_name{
    .name = "ion.name", .kind = Parameter::Kind::text, .meaning = "of its flux in formulas"};
const Parameter yield_name{.name = "ion.yield.name",
                           .kind = Parameter::Kind::text,
                           .meaning = "of the arrivals times the yield in formulas"};
const Parameter yield_amplitude{.name = "ion.yield.amplitude",
                                .limits = {.minimum = 0, .maximum = 1e6},
                                .meaning = "A of the yield, per square root of an eV",
                                .source = "SF6/O2: Si 0.0337 sputtered, 7 with F"};
const Parameter yield_threshold{.name = "ion.yield.threshold",
                                .dimension = Dimension::energy,
                                .limits = {.fallback = "0 eV", .minimum = 0, .maximum = 1e6},
                                .meaning = "energy below which there is no yield",
                                .source = "SF6/O2: Si 20 eV sputtered, 15 eV with F"};
const Parameter yield_angular{.name = "ion.yield.angular",
                              .kind = Parameter::Kind::text,
                              .limits = {.fallback = "cosine"},
                              .meaning = "cosine, sputter or enhanced: f(theta) below",
                              .source = "Chang, Sawin 1997; Belen et al. 2005"};
const Parameter yield_sputter{.name = "ion.yield.sputter_factor",
                              .limits = {.fallback = "9.3", .minimum = -1, .maximum = 1000},
                              .meaning = "B of sputter",
                              .source = "9.3 for oxide and Si, 8.5 for polymer"};
const Parameter yield_energy_table{.name = "ion.yield.energy_table",
                                   .kind = Parameter::Kind::table,
                                   .columns = yield_by_energy,
                                   .needed = "none",
                                   .meaning = "a yield by energy in place of A and threshold",
                                   .source = "experiment or molecular dynamics",
                                   .replaces = {"amplitude", "threshold"}};
const Parameter yield_angular_table{.name = "ion.yield.angular_table",
                                    .kind = Parameter::Kind::table,
                                    .columns = factor_by_angle,
                                    .needed = "none",
                                    .meaning = "f by angle of incidence in place of angular",
                                    .source = "experiment or molecular dynamics",
                                    .replaces = {"angular", "sputter_factor"}};
const Parameter yield_table{.name = "ion.yield.table",
                            .kind = Parameter::Kind::table,
                            .columns = yield_by_both,
                            .needed = "none",
                            .meaning = "the yield by energy and angle in place of all these",
                            .source = "experiment or molecular dynamics",
                            .replaces = {"amplitude", "threshold", "angular", "sputter_factor",
                                         "energy_table", "angular_table"}};

std::span<const Parameter> parameters() {
  static const std::vector<Parameter> rows =
      parameter_rows(rate, deposited, neutral_name, neutral_sticking, neutral_power, neutral_table,
                     neutral_map, neutral_tilt, neutral_azimuth, neutral_rotating, ion_name,
                     ion_parameters(), yield_name, yield_amplitude, yield_threshold, yield_angular,
                     yield_sputter, yield_energy_table, yield_angular_table, yield_table);
  return rows;
}

class Reader {
 public:
  Reader(const RecipeTable& step, const StepScope& scope) : step_(step), scope_(scope) {}

  StepModel read() {
    if (step_.has("material")) deposited_ = step_.material("material", scope_.materials);
    for (const RecipeTable& table : step_.tables("neutral")) read_neutral(table);
    for (const RecipeTable& table : step_.tables("ion")) read_ion(table);
    if (values_.species.empty() && step_.ok("neutral") && step_.ok("ion")) {
      step_.error("", "nothing arrives; add a [[step.neutral]] or a [[step.ion]] table");
    }
    read_rates();
    return {std::make_shared<MultiParticle>(std::move(values_)), deposited_};
  }

 private:
  std::string read_name(const RecipeTable& table) {
    std::string name = table.text("name");
    if (!table.ok("name")) {
      names_are_right_ = false;
      return name;
    }
    if (!is_formula_name(name)) {
      table.error("name",
                  "has to be a word of letters, digits and _ that begins with a letter "
                  "and is not the name of a function");
    } else if (std::find(names_.begin(), names_.end(), name) != names_.end()) {
      table.error("name", "there is another " + name + " in this step");
    }
    names_are_right_ = names_are_right_ && table.ok("name");
    names_.push_back(name);
    return name;
  }

  void read_neutral(const RecipeTable& table) {
    Species species;
    species.name = read_name(table);
    species.sticking = read_per_material(table, inner(neutral_sticking), scope_, deposited_);
    species.source = read_source(table, neutral_power, scope_);
    values_.species.push_back(std::move(species));
  }

  void read_ion(const RecipeTable& table) {
    std::string name = read_name(table);
    Species species = read_ions(table, scope_);
    species.name = std::move(name);
    for (const RecipeTable& inside : table.tables("yield")) {
      species.yields.push_back(read_yield(inside));
      check_yield(inside, species.yields.back(), species.ions->energy.largest());
    }
    stop_without_yield(species);
    values_.species.push_back(std::move(species));
  }

  YieldLaw read_yield(const RecipeTable& table) {
    YieldLaw law{.name = read_name(table)};
    const Parameter by_both = inner(yield_table);
    if (stands_in(table, by_both)) {
      law.table = read_yields(table, by_both);
      return law;
    }
    law.factor = read_angular_factor(table);
    const Parameter by_energy = inner(yield_energy_table);
    if (!stands_in(table, by_energy)) {
      law.amplitude = read_value(table, inner(yield_amplitude));
      law.threshold = read_value(table, inner(yield_threshold));
    } else if (const auto rows = table.number_table(by_energy.name, by_energy.columns)) {
      for (const std::vector<double>& row : rows->values)
        law.table.push_back({row[0], AngleTable::sum({&law.factor, 1}, {&row[1], 1})});
    }
    return law;
  }

  AngleTable read_angular_factor(const RecipeTable& table) const {
    enum class Angular { cosine, sputter, enhanced };
    const Parameter by_angle = inner(yield_angular_table);
    if (stands_in(table, by_angle)) return read_angle_table(table, by_angle);
    const auto angular = table.choice<Angular>("angular",
                                               {{"cosine", Angular::cosine},
                                                {"sputter", Angular::sputter},
                                                {"enhanced", Angular::enhanced}},
                                               yield_angular.limits.fallback);
    const double b = read_value(table, inner(yield_sputter));
    if (angular == Angular::sputter) return sputter_factor(b);
    if (angular == Angular::enhanced) return enhanced_factor();
    return AngleTable([](double theta) { return std::max(0.0, std::cos(theta)); });
  }

  // Rows of energy, angle and yield; those of one energy are a table by angle.
  std::vector<YieldLaw::AtEnergy> read_yields(const RecipeTable& table,
                                              const Parameter& parameter) const {
    std::vector<YieldLaw::AtEnergy> yields;
    const auto rows = table.number_table(parameter.name, parameter.columns);
    for (std::size_t first = 0; rows && first < rows->values.size();) {
      const double energy = rows->values[first][0];
      std::vector<double> angles;
      std::vector<double> values;
      std::size_t end = first;
      for (; end < rows->values.size() && rows->values[end][0] == energy; ++end) {
        angles.push_back(rows->values[end][1]);
        values.push_back(rows->values[end][2]);
      }
      try {
        yields.push_back({energy, AngleTable::tabulated(angles, values)});
      } catch (const InputError& error) {
        table.row_error(parameter.name, *rows, first,
                        "of " + format_quantity(energy, Dimension::energy) + ": " + error.what());
      }
      first = end;
    }
    return yields;
  }

  static void check_yield(const RecipeTable& table, const YieldLaw& law, double largest_energy) {
    if (!table.ok()) return;
    const std::string_view key = table.has("table")          ? "table"
                                 : table.has("energy_table") ? "energy_table"
                                                             : "";
    try {
      law.check(largest_energy);
    } catch (const InputError& error) {
      table.error(key, error.what());
    }
  }

  void read_rates() {
    std::map<std::string, std::optional<RateFormula>> formulas;
    const auto texts = read_per_material_text(step_, rate, scope_, deposited_);
    if (!names_are_right_) return;  // formulas would seem wrong that use them
    for (const std::string& text : texts) {
      const auto [known, is_new] = formulas.try_emplace(text);
      if (is_new && !text.empty()) known->second = compiled(text);
      values_.rate.push_back(known->second);
    }
  }

  std::optional<RateFormula> compiled(const std::string& text) const {
    try {
      return RateFormula(text, names_);
    } catch (const InputError& error) {
      constexpr std::size_t longest_quote = 200;
      const std::string place = text.size() <= longest_quote ? "in \"" + text + "\", " : "";
      step_.error(rate.name, place + error.what());
      return std::nullopt;
    }
  }

  const RecipeTable& step_;
  const StepScope& scope_;
  std::optional<MaterialId> deposited_;
  std::vector<std::string> names_;  // in the order of the tallies
  bool names_are_right_ = true;
  MultiParticle::Values values_;
};

StepModel read(const RecipeTable& step, const StepScope& scope) {
  return Reader(step, scope).read();
}

}  // namespace

std::vector<float> MultiParticle::speeds(const SurfacePoints& points,
                                         std::span<const std::span<const float>> flux) const {
  std::vector<float> speeds(points.material.size());
  std::vector<float> values(flux.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    const auto& formula = values_.rate[points.material[p]];
    if (!formula) continue;
    for (std::size_t k = 0; k < flux.size(); ++k) values[k] = flux[k][p];
    speeds[p] = formula->at(values);
  }
  return speeds;
}

std::string MultiParticle::formula(MaterialId material) const {
  return values_.rate[material] ? values_.rate[material]->text() : "";
}

ModelDescription multi_particle_description() {
  return {
      .name = "multi_particle",
      .summary = "neutrals and ions, and a rate that is a formula of what arrives",
      .equation = "v = rate(material; names of neutrals, ions and yields)",
      .symbols =
          "v is the speed along the outward normal. In a formula the name of a neutral or an "
          "ion is its arrivals, first and later ones together, relative to an open flat wafer; "
          "the name of a yield is the arrivals of its ion, each times Y(E, theta) = amplitude "
          "max(0, sqrt(E) - sqrt(threshold)) f(theta) of its energy E and its angle theta to "
          "the normal. f is cos(theta) for cosine, cos(theta) (1 + B sin^2(theta)) for sputter, "
          "and for enhanced 1 up to 60 deg and from there linear to 0 at 90 deg. Tables may "
          "give f, or the yield by energy, or Y by both, linear between their rows. Formulas "
          "know + - * / ^ ( ), min, max, sqrt, exp, numbers and rates with their unit: \"-200 "
          "nm/s * F^0.5 * etch - 1 nm/s\". Particles leave the source with a density "
          "cos^n(theta) per solid angle about its axis, among those that cross a plane, or with "
          "the one of a table, linear in theta and 0 outside. A source_map is taken relative to "
          "its mean. The energies of ions are normally distributed, or with the density 1 / "
          "sqrt(1 - x^2) in x = 2 (E - energy) / energy_width, or with that of a table, linear "
          "in E and 0 outside. Neutrals that do not stick are re-emitted by the cosine law. "
          "Ions that do not stick leave near the specular direction, in a cone of half opening "
          "90 deg - min(theta, narrowest_at), with the part e of their energy: normal with "
          "deviation 0.1 about A (theta / inflection)^energy_power, above the inflection on the "
          "line from A to 1. One with less energy than any of its yields needs stays where it "
          "arrives.",
      .limits =
          "Rates depend on the fluxes at the same place and time: no coverages that need time. "
          "Sticking does not depend on flux or energy.",
      .source =
          "R. J. Belen et al., J. Vac. Sci. Technol. A 23, 99 (2005), for ions; Ch. Steinbruechel, "
          "Appl. Phys. Lett. 55, 1960 (1989), for yields",
      .parameters = parameters(),
      .read = read};
}

}  // namespace scarp

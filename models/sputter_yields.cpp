#include "models/sputter_yields.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "flux/sampling/portable_math.h"
#include "models/ion_parameters.h"

namespace scarp {

namespace {

constexpr std::array factor_by_angle{
    angle_column, Column{"factor", Dimension::number, {.minimum = 0, .maximum = 1e6}}};
constexpr std::array coefficient_by_power{
    Column{"power", Dimension::number, {.minimum = 0, .maximum = 100}},
    Column{"coefficient", Dimension::number, {.minimum = -1e6, .maximum = 1e6}}};

const Parameter threshold{.name = "threshold",
                          .kind = Parameter::Kind::per_material,
                          .dimension = Dimension::energy,
                          .limits = {.fallback = "20 eV", .minimum = 0, .maximum = 1e6},
                          .meaning = "energy below which nothing is sputtered",
                          .source = "Si, oxide 15-25 eV"};
const Parameter sputter_factor_row{.name = "sputter_factor",
                                   .kind = Parameter::Kind::per_material,
                                   .limits = {.fallback = "9.3", .minimum = -1, .maximum = 1000},
                                   .meaning = "B of f(theta)",
                                   .source = "9.3 for oxide and Si, 8.5 for polymer"};
const Parameter angular_polynomial{
    .name = "angular_polynomial",
    .kind = Parameter::Kind::table,
    .columns = coefficient_by_power,
    .needed = "none",
    .meaning = "f as a sum of powers of cos(theta), 0 where it is negative, in place of B",
    .source = "milling: 1.075, -1.55, 0.65 for powers 1, 2, 3 (10.1109/SISPAD62626.2024.10733316)",
    .replaces = {"sputter_factor"}};
const Parameter angular_table{.name = "angular_table",
                              .kind = Parameter::Kind::table,
                              .columns = factor_by_angle,
                              .needed = "none",
                              .meaning = "f by angle of incidence in place of B",
                              .source = "experiment or molecular dynamics",
                              .replaces = {"sputter_factor", "angular_polynomial"}};

double power_sum(const NumberTable& rows, double cosine) {
  double sum = 0;
  for (const std::vector<double>& row : rows.values)
    sum += row[1] * (row[0] == 0 ? 1 : portable_power(cosine, row[0]));
  return std::max(0.0, sum);
}

// The factor of all materials, over its value at normal incidence; nothing without one.
std::optional<AngleTable> read_factor(const RecipeTable& step) {
  const auto normalised = [&](const AngleTable& factor,
                              const Parameter& row) -> std::optional<AngleTable> {
    const double at_normal = factor.at(0);
    if (!step.ok(row.name)) return AngleTable();
    if (!(at_normal > 0)) {
      step.error(row.name, "is 0 for ions along the normal, to which it is relative");
      return AngleTable();
    }
    const double scale = 1 / at_normal;
    return AngleTable::sum({&factor, 1}, {&scale, 1});
  };
  if (stands_in(step, angular_table))
    return normalised(read_angle_table(step, angular_table), angular_table);
  if (!stands_in(step, angular_polynomial)) return std::nullopt;
  const auto rows = step.number_table(angular_polynomial.name, angular_polynomial.columns);
  if (!rows) return AngleTable();
  return normalised(AngleTable([&](double theta) { return power_sum(*rows, std::cos(theta)); }),
                    angular_polynomial);
}

}  // namespace

std::span<const Parameter> sputter_yield_parameters() {
  static const std::array rows{threshold, sputter_factor_row, angular_polynomial, angular_table};
  return rows;
}

SputterYields read_sputter_yields(const RecipeTable& step, const StepScope& scope,
                                  std::optional<MaterialId> deposited) {
  const std::vector<float> least = read_per_material(step, threshold, scope, deposited);
  const std::optional<AngleTable> factor = read_factor(step);
  const std::vector<float> b = factor
                                   ? std::vector<float>(least.size())
                                   : read_per_material(step, sputter_factor_row, scope, deposited);
  const std::vector<MaterialId> met = met_by(scope, deposited);
  SputterYields yields{.law_of = std::vector<std::size_t>(least.size())};
  for (const MaterialId m : met) {
    const auto same = std::ranges::find_if(
        met, [&](MaterialId other) { return least[other] == least[m] && b[other] == b[m]; });
    if (*same == m) {
      yields.law_of[m] = yields.laws.size();
      yields.laws.push_back({.name = "sputter_" + scope.materials[m].name,
                             .amplitude = 1,
                             .threshold = least[m],
                             .factor = factor ? *factor : sputter_factor(b[m])});
    }
    yields.law_of[m] = yields.law_of[*same];
  }
  return yields;
}

Species read_sputtering_ions(const RecipeTable& table, const StepScope& scope,
                             const std::vector<YieldLaw>& laws, std::size_t index,
                             std::size_t count) {
  const std::string number = count > 1 ? '_' + std::to_string(index + 1) : "";
  Species ions = read_ions(table, scope);
  ions.name = "ion" + number;
  for (const YieldLaw& law : laws) {
    ions.yields.push_back(law);
    ions.yields.back().name += number;
  }
  stop_without_yield(ions);
  return ions;
}

std::optional<Species> axis_of(const Species& ions, const Frame& frame) {
  if (ions.source.rotating && !ions.source.is_upright()) return std::nullopt;
  const Vec3d direction = frame.in_section(ions.source.direction);
  Species axis{.name = "axis_of_" + ions.name,
               .source = {.kind = SourceLobe::Kind::beam, .direction = normalized(direction)}};
  axis.sticking.assign(ions.sticking.size(), 1.0F);
  return axis;
}

Species sputtered_atoms(const std::vector<float>& sticking) {
  return {.name = "sputtered", .source = {.kind = SourceLobe::Kind::none}, .sticking = sticking};
}

}  // namespace scarp

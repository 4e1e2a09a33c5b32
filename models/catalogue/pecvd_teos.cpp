#include "models/catalogue/pecvd_teos.h"

#include <memory>
#include <vector>

#include "models/catalogue/teos.h"
#include "models/ion_parameters.h"
#include "models/source_parameters.h"

namespace scarp {

namespace {

const Parameter deposited{
    .name = "material", .kind = Parameter::Kind::material, .meaning = "what is deposited"};
const Parameter radical_rate = precursor_rate_parameter(
    "radical_growth_rate", "R_r: part of the radicals in the growth of an open flat wafer");
const Parameter radical_order = precursor_order_parameter("radical_order");
const Parameter radical_sticking{.name = "radical_sticking",
                                 .kind = Parameter::Kind::per_material,
                                 .limits = {.fallback = "0.1", .minimum = 0, .maximum = 1},
                                 .meaning = "s_r: probability that a radical stays",
                                 .source = "step coverage"};
const Parameter source_power = source_power_parameter("source_power");
const Parameter ion_rate = precursor_rate_parameter(
    "ion.growth_rate", "R_i: part of the ions in the growth of an open flat wafer");
const Parameter ion_order = precursor_order_parameter("ion.order");

std::span<const Parameter> parameters() {
  static const std::vector<Parameter> rows =
      parameter_rows(deposited, radical_rate, radical_order, radical_sticking, source_power,
                     source_table_parameter("source_table"), source_map_parameter("source_map"),
                     ion_rate, ion_order, ion_parameters());
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  const MaterialId film = step.material(deposited.name, scope.materials);
  std::vector<Teos::Precursor> precursors(1);
  Teos::Precursor& radical = precursors.front();
  radical.species.name = "radical";
  radical.species.source = read_upright_source(step, source_power, scope);
  radical.species.sticking = read_per_material(step, radical_sticking, scope, film);
  radical.rate = read_value(step, radical_rate);
  radical.order = read_value(step, radical_order);
  const std::vector<RecipeTable> tables = step.tables_or_one("ion");
  for (const RecipeTable& table : tables) {
    Teos::Precursor ion{.species = read_ions(table, scope),
                        .rate = read_value(table, inner(ion_rate)),
                        .order = read_value(table, inner(ion_order))};
    ion.species.name = "ion";
    if (tables.size() > 1) ion.species.name += '_' + std::to_string(precursors.size());
    precursors.push_back(std::move(ion));
  }
  return {std::make_shared<Teos>(std::move(precursors)), film};
}

}  // namespace

ModelDescription pecvd_teos_description() {
  return {
      .name = "pecvd_teos",
      .summary = "oxide from TEOS in a plasma: radicals, and ions that fall steeply",
      .equation = "v = R_r F_r^m_r + sum_i R_i F_i^m_i",
      .symbols =
          "v is the speed along the outward normal. F_r and F_i are what arrives of radicals and "
          "of "
          "ions of kind i, first and later arrivals together, relative to an open flat wafer, "
          "where "
          "the film grows at R_r + sum_i R_i. Radicals that do not stick are re-emitted by the "
          "cosine law; of an order other than 1 their sticking follows what they cover, as in "
          "teos. "
          "Ions that do not stick leave near the specular direction with a part of their energy, "
          "as "
          "in multi_particle.",
      .limits =
          "Molecules meet walls and not each other (mean free path above ten widths). Ions add to "
          "the film by their number, whatever their energy, and sputter nothing.",
      .source = "ViennaPS, whose rates are no constants of the process but fits",
      .parameters = parameters(),
      .read = read};
}

}  // namespace scarp

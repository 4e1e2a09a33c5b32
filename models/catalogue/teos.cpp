#include "models/catalogue/teos.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "flux/sampling/portable_math.h"
#include "models/source_parameters.h"

namespace scarp {

namespace {

const Parameter deposited = [] {
  Parameter row = deposited_parameter("growth_rate");
  row.needed = "required";
  return row;
}();
const Parameter rate = precursor_rate_parameter("precursor.growth_rate",
                                                "R: its part of the growth of an open flat wafer");
const Parameter order = precursor_order_parameter("precursor.order");
const Parameter sticking{.name = "precursor.sticking",
                         .kind = Parameter::Kind::per_material,
                         .limits = {.fallback = "0.1", .minimum = 0, .maximum = 1},
                         .meaning = "s: probability that it stays on a covered surface",
                         .source = "TEOS 0.03-0.1; a second precursor 1e-4"};
const Parameter source_power = source_power_parameter("precursor.source_power");
const Parameter source_table = source_table_parameter("precursor.source_table");
const Parameter source_map = source_map_parameter("precursor.source_map");

std::span<const Parameter> parameters() {
  static const std::array rows{deposited,    rate,         sticking,  order,
                               source_power, source_table, source_map};
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  const MaterialId film = step.material(deposited.name, scope.materials);
  const std::vector<RecipeTable> tables = step.tables_or_one("precursor");
  std::vector<Teos::Precursor> precursors;
  for (const RecipeTable& table : tables) {
    Teos::Precursor precursor;
    precursor.species.name = "precursor";
    if (tables.size() > 1) precursor.species.name += '_' + std::to_string(precursors.size() + 1);
    precursor.species.sticking = read_per_material(table, inner(sticking), scope, film);
    precursor.species.source = read_upright_source(table, source_power, scope);
    precursor.rate = read_value(table, inner(rate));
    precursor.order = read_value(table, inner(order));
    precursors.push_back(std::move(precursor));
  }
  return {std::make_shared<Teos>(std::move(precursors)), film};
}

// What is left of the sticking where a part theta is covered. None is covered: growth of an order
// above 1 takes nothing, of one below 1 all; what sticks nowhere never does.
double sticking_at(double s, double theta, double order) {
  if (s == 0) return 0;
  if (theta > 0) return std::min(1.0, s * portable_power(theta, order - 1));
  return order < 1 ? 1 : 0;
}

std::vector<Species> species_of(std::span<const Teos::Precursor> precursors) {
  std::vector<Species> species;
  for (const Teos::Precursor& each : precursors) species.push_back(each.species);
  return species;
}

bool covers(const Teos::Precursor& precursor) {
  return precursor.order != 1 && !precursor.species.ions;
}

}  // namespace

Parameter precursor_rate_parameter(std::string_view name, std::string_view meaning) {
  return {.name = name,
          .dimension = Dimension::rate,
          .limits = rate_limits,
          .meaning = meaning,
          .source = "blanket wafers and step coverage"};
}

// Beyond 2 the flux would change by more than the sticking that it follows from.
Parameter precursor_order_parameter(std::string_view name) {
  return {.name = name,
          .limits = {.fallback = "1", .minimum = 0.01, .maximum = 2},
          .meaning = "m: order of the reaction",
          .source = "1 where adsorption limits it, 0.5 where molecules dissociate"};
}

Teos::Teos(std::vector<Precursor> precursors)
    : SurfaceModel(species_of(precursors),
                   {.balance = std::ranges::any_of(precursors, covers) ? this : nullptr}),
      precursors_(std::move(precursors)) {
  for (std::size_t k = 0; k < precursors_.size(); ++k)
    if (covers(precursors_[k])) covering_.push_back(k);
}

std::vector<float> Teos::speeds(const SurfacePoints& points,
                                std::span<const std::span<const float>> flux) const {
  std::vector<float> speeds(points.material.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    double sum = 0;
    for (std::size_t k = 0; k < precursors_.size(); ++k) {
      const double arrives = std::max(0.0F, flux[k][p]);
      const double order = precursors_[k].order;
      sum += precursors_[k].rate * (order == 1 ? arrives : portable_power(arrives, order));
    }
    speeds[p] = static_cast<float>(sum);
  }
  return speeds;
}

std::vector<std::string> Teos::coverage_names() const {
  std::vector<std::string> names;
  for (const std::size_t k : covering_) names.push_back(precursors_[k].species.name);
  return names;
}

std::vector<std::vector<float>> Teos::steady_coverages(
    const SurfacePoints& points, std::span<const std::span<const float>> flux) const {
  std::vector<std::vector<float>> coverages;
  for (const std::size_t k : covering_) {
    std::vector<float>& theta = coverages.emplace_back(points.material.size());
    for (std::size_t p = 0; p < theta.size(); ++p) theta[p] = std::clamp(flux[k][p], 0.0F, 1.0F);
  }
  return coverages;
}

std::vector<std::vector<float>> Teos::covered_sticking(
    const SurfacePoints& points, std::span<const std::vector<float>> coverages) const {
  std::vector<std::vector<float>> sticking(precursors_.size());
  for (std::size_t c = 0; c < covering_.size(); ++c) {
    const Precursor& precursor = precursors_[covering_[c]];
    for (std::size_t p = 0; p < points.material.size(); ++p) {
      const double s = precursor.species.sticking[points.material[p]];
      sticking[covering_[c]].push_back(
          static_cast<float>(sticking_at(s, coverages[c][p], precursor.order)));
    }
  }
  return sticking;
}

ModelDescription teos_description() {
  return {
      .name = "teos",
      .summary = "oxide from TEOS: one precursor or several, each with an order of its own",
      .equation = "v = sum_k R_k F_k^m_k",
      .symbols =
          "v is the speed along the outward normal. F_k is what arrives of precursor k, first and "
          "later arrivals together, relative to an open flat wafer, where the film grows at the "
          "sum "
          "of the R_k. Of an order other than 1 the sticking follows the part theta = min(F, 1) of "
          "the surface that it covers: it is s theta^(m - 1), at most 1. What does not stick is "
          "re-emitted by the cosine law. Step coverages of wide and of narrow trenches ask for two "
          "precursors, one that sticks and one that hardly does.",
      .limits =
          "Molecules meet walls and not each other (mean free path above ten widths). Coverages "
          "follow at once what arrives; no temperature, no by-products.",
      .source =
          "J. C. Rey, J. P. McVittie, K. C. Saraswat (1990) for one sticking probability; A. Shiga "
          "et al. for two; orders as in ViennaPS",
      .parameters = parameters(),
      .read = read};
}

}  // namespace scarp

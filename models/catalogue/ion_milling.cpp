#include "models/catalogue/ion_milling.h"

#include <array>
#include <memory>
#include <string>

#include "models/ion_parameters.h"
#include "models/source_parameters.h"
#include "models/sputter_yields.h"
#include "models/sputtering.h"

namespace scarp {

namespace {

const Parameter etch_rate{.name = "etch_rate",
                          .kind = Parameter::Kind::per_material,
                          .dimension = Dimension::rate,
                          .limits = rate_limits,
                          .meaning = "speed of etching of an open flat wafer by all ions together",
                          .source = "blanket wafer"};
const Parameter redeposited{.name = "material",
                            .kind = Parameter::Kind::material,
                            .needed = "none",
                            .meaning = "what atoms become that settle; without it none do"};
const Parameter redeposition_sticking{.name = "redeposition_sticking",
                                      .kind = Parameter::Kind::per_material,
                                      .limits = {.fallback = "1", .minimum = 1e-3, .maximum = 1},
                                      .meaning = "probability that a sputtered atom settles",
                                      .source = "1 for metals and semiconductors"};
const Parameter share{.name = "ion.share",
                      .limits = {.fallback = "1", .minimum = 0, .exclusive = true},
                      .meaning = "part of the etch rate relative to that of other ions"};

std::span<const Parameter> parameters() {
  static const std::vector<Parameter> rows =
      parameter_rows(etch_rate, sputter_yield_parameters(), redeposited, redeposition_sticking,
                     share, ion_parameters());
  return rows;
}

class Reader {
 public:
  Reader(const RecipeTable& step, const StepScope& scope) : step_(step), scope_(scope) {}

  StepModel read() {
    if (step_.has("material")) film_ = step_.material("material", scope_.materials);
    const std::vector<float> rate = read_per_material(step_, etch_rate, scope_, film_);
    const SputterYields yields = read_sputter_yields(step_, scope_, film_);
    Sputtering::Values values;
    values.surfaces.resize(rate.size());
    for (std::size_t m = 0; m < rate.size(); ++m)
      values.surfaces[m].density = scope_.materials[static_cast<MaterialId>(m)].density;
    read_ions(yields, values);
    share_out(rate, yields, values);
    settle(rate, values);
    return {std::make_shared<Sputtering>(std::move(values)), film_};
  }

 private:
  void read_ions(const SputterYields& yields, Sputtering::Values& values) {
    double sum = 0;
    const std::vector<RecipeTable> tables = step_.tables_or_one("ion");
    for (const RecipeTable& table : tables) {
      shares_.push_back(read_value(table, inner(share)));
      sum += shares_.back();
      values.ions.push_back(
          read_sputtering_ions(table, scope_, yields.laws, values.ions.size(), tables.size()));
      values.axes.push_back(axis_of(values.ions.back(), scope_.frame));
    }
    for (double& part : shares_) part /= sum;
  }

  // What a unit of the yield takes away, so that an open flat wafer shows the rate.
  void share_out(const std::vector<float>& rate, const SputterYields& yields,
                 Sputtering::Values& values) {
    for (std::size_t i = 0; i < values.ions.size(); ++i) {
      std::vector<double> flat;
      values.factors.emplace_back();
      for (const YieldLaw& law : values.ions[i].yields) {
        const OpenResponse response(values.ions[i], law);
        flat.push_back(response.flat());
        values.factors.back().push_back(response.factor());
      }
      // Others may have a rate as well, but have no yields.
      for (const MaterialId m : met_by(scope_, film_)) {
        if (rate[m] == 0) continue;
        Sputtering::Surface& surface = values.surfaces[m];
        const std::size_t law = yields.law_of[m];
        if (flat[law] <= 0) {
          const std::string its = "etch rate of " + scope_.materials[m].name;
          step_.error("threshold",
                      shares_.size() == 1
                          ? "no ion has as much energy, so none makes the " + its +
                                "; lower it or raise ion.energy"
                          : "ion[" + std::to_string(i) +
                                "] never has as much energy, so its share of the " + its +
                                " cannot be made; lower it, raise its energy or leave it out");
          return;
        }
        surface.by_ion.push_back(
            {.yield = law, .atoms = shares_[i] * surface.density * rate[m] / flat[law]});
      }
    }
  }

  // Fluxes of sputtered atoms are relative to what the fastest material sends out.
  void settle(const std::vector<float>& rate, Sputtering::Values& values) const {
    const std::vector<float> sticking =
        read_per_material(step_, redeposition_sticking, scope_, film_);
    if (!film_) return;
    double most = 0;
    for (const MaterialId m : met_by(scope_, film_))
      most = std::max(most, rate[m] * values.surfaces[m].density);
    for (std::size_t m = 0; m < rate.size(); ++m) values.surfaces[m].settling = sticking[m];
    values.film_density = values.surfaces[*film_].density;
    values.sputtered_unit = most > 0 ? most : 1;
    values.sputtered = sputtered_atoms(sticking);
  }

  const RecipeTable& step_;
  const StepScope& scope_;
  std::optional<MaterialId> film_;
  std::vector<double> shares_;
};

StepModel read(const RecipeTable& step, const StepScope& scope) {
  return Reader(step, scope).read();
}

}  // namespace

ModelDescription ion_milling_description() {
  return {
      .name = "ion_milling",
      .summary = "etching by ions alone, with redeposition of what they sputter",
      .equation = "v = (s_r J_r F_r - S) / rho, S = rho_m etch_rate sum_i share_i R_i / R_i(flat)",
      .symbols =
          "v is the speed along the outward normal. R_i is the flux of ions of kind i times their "
          "yield, Y(E, theta) = max(0, sqrt(E) - sqrt(threshold)) f(theta), with theta the angle "
          "to "
          "the normal; f = cos(theta) (1 + B sin^2(theta)), or a polynomial in cos(theta) or a "
          "table, "
          "over its value at 0. R_i(flat) is that of an open flat wafer under the same ions, "
          "tilted "
          "and spread as they are: there the etch rate is what the recipe says. rho_m is the "
          "density "
          "of the material. Sputtered atoms, S per area and time, leave by the cosine law, fly "
          "straight, settle where they arrive with probability s_r and are re-emitted otherwise; "
          "J_r F_r is what arrives of them. Where more settles than leaves a film of `material` "
          "grows, and rho is its density, elsewhere it is rho_m. All that is sputtered settles or "
          "escapes. Ions that do not stick leave near the specular direction with a part of their "
          "energy, as in multi_particle. A yield that is largest at a slant makes facets.",
      .limits =
          "Ions and atoms meet walls and not each other. Atoms of all materials settle as one "
          "film, "
          "and leave by the cosine law also where ions come at a slant. Layers do not mix.",
      .source =
          "yields: C. Steinbruechel, Appl. Phys. Lett. 55, 1960 (1989), J. P. Chang, H. H. Sawin, "
          "J. Vac. Sci. Technol. A 15, 610 (1997); redeposition: S. Yamauchi, T. Yachi, T. Wada "
          "(1984)",
      .parameters = parameters(),
      .read = read};
}

}  // namespace scarp

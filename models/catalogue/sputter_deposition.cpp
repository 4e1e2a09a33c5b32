#include "models/catalogue/sputter_deposition.h"

#include <memory>

#include "models/ion_parameters.h"
#include "models/source_parameters.h"
#include "models/sputter_yields.h"
#include "models/sputtering.h"

namespace scarp {

namespace {

const Parameter growth_rate{
    .name = "growth_rate",
    .dimension = Dimension::rate,
    .limits = {.minimum = 0, .maximum = fastest_rate, .exclusive = true},
    .meaning = "speed of growth of an open flat wafer without ions, on what is deposited",
    .source = "blanket wafer"};
const Parameter deposited{
    .name = "material", .kind = Parameter::Kind::material, .meaning = "what is deposited"};
const Parameter sticking{.name = "sticking",
                         .kind = Parameter::Kind::per_material,
                         .limits = {.fallback = "1", .minimum = 1e-3, .maximum = 1},
                         .meaning = "probability that an atom stays where it arrives",
                         .source = "metals 0.9-1"};
const Parameter source_power = source_power_parameter("source_power");
const Parameter resputter_amplitude{.name = "resputter_amplitude",
                                    .kind = Parameter::Kind::per_material,
                                    .limits = {.minimum = 0, .maximum = 1e6},
                                    .needed = "with ions",
                                    .meaning = "A of the yield, per square root of an eV",
                                    .source = "Ar on metals 0.02-0.1"};
const Parameter ion_flux{.name = "ion.flux",
                         .dimension = Dimension::flux,
                         .limits = {.fallback = "1e15 /cm2/s", .minimum = 0, .maximum = 1e10},
                         .meaning = "J_i of an open flat wafer",
                         .source = "probe: ion current / charge"};

std::span<const Parameter> parameters() {
  static const std::vector<Parameter> rows = parameter_rows(
      growth_rate, deposited, sticking, source_power, source_table_parameter("source_table"),
      source_map_parameter("source_map"), tilt_parameter("tilt"), azimuth_parameter("azimuth"),
      rotating_parameter("rotating"), resputter_amplitude, sputter_yield_parameters(), ion_flux,
      ion_parameters());
  return rows;
}

class Reader {
 public:
  Reader(const RecipeTable& step, const StepScope& scope)
      : step_(step), scope_(scope), film_(step.material("material", scope.materials)) {}

  StepModel read() {
    Sputtering::Values values;
    read_atoms(values);
    const SputterYields yields = read_sputter_yields(step_, scope_, film_);
    const std::vector<RecipeTable> tables = step_.tables("ion");
    if (!tables.empty()) read_ions(tables, yields, values);
    return {std::make_shared<Sputtering>(std::move(values)), film_};
  }

 private:
  void read_atoms(Sputtering::Values& values) const {
    const double rate = read_value(step_, growth_rate);
    Species atoms{.name = "atom", .source = read_source(step_, source_power, scope_)};
    atoms.sticking = read_per_material(step_, sticking, scope_, film_);
    values.surfaces.resize(atoms.sticking.size());
    for (std::size_t m = 0; m < values.surfaces.size(); ++m) {
      Sputtering::Surface& surface = values.surfaces[m];
      surface.density = scope_.materials[static_cast<MaterialId>(m)].density;
      surface.atom_sticking = surface.settling = atoms.sticking[m];
    }
    const Sputtering::Surface& film = values.surfaces[film_];
    values.film_density = film.density;
    // An impossible sticking is an error that was noted.
    values.atom_flux = film.density * rate / std::max(1e-3, film.atom_sticking);
    values.atoms = std::move(atoms);
  }

  void read_ions(const std::vector<RecipeTable>& tables, const SputterYields& yields,
                 Sputtering::Values& values) const {
    const std::vector<float> amplitude =
        read_per_material(step_, resputter_amplitude, scope_, film_);
    for (const RecipeTable& table : tables) {
      const double flux = read_value(table, inner(ion_flux));
      values.ions.push_back(
          read_sputtering_ions(table, scope_, yields.laws, values.ions.size(), tables.size()));
      const Species& ions = values.ions.back();
      values.axes.push_back(axis_of(ions, scope_.frame));
      values.factors.emplace_back();
      for (const YieldLaw& law : ions.yields)
        values.factors.back().push_back(OpenResponse(ions, law).factor());
      for (std::size_t m = 0; m < amplitude.size(); ++m)
        values.surfaces[m].by_ion.push_back(
            {.yield = yields.law_of[m], .atoms = flux * amplitude[m]});
    }
    values.sputtered_unit = values.atom_flux;
    values.sputtered = sputtered_atoms(values.atoms->sticking);
  }

  const RecipeTable& step_;
  const StepScope& scope_;
  MaterialId film_;
};

StepModel read(const RecipeTable& step, const StepScope& scope) {
  return Reader(step, scope).read();
}

}  // namespace

ModelDescription sputter_deposition_description() {
  return {
      .name = "sputter_deposition",
      .summary = "atoms from a target, and ions that sputter what is deposited",
      .equation = "v = (s J_a (F_a + F_r) - S) / rho, S = sum_i J_i A R_i",
      .symbols =
          "v is the speed along the outward normal. F_a is what arrives of the atoms of the "
          "target, "
          "relative to an open flat wafer, J_a their flux there: the growth rate times the density "
          "of the film over its sticking. They leave the source with a density cos^n(theta) per "
          "solid angle about its axis, n = 1 for a wide target, 5 to 20 with long throw or a "
          "collimator, above 100 where they are ionised, or with the one of a table; and with a "
          "map "
          "more of them come from one place than from another. R_i is the arrivals of ions of kind "
          "i "
          "times max(0, sqrt(E) - sqrt(threshold)) f(theta), with f as in ion_milling. What they "
          "sputter, S per area and time, leaves by the cosine law and settles where it arrives, "
          "J_a F_r, as other atoms do. Where more settles than leaves the film grows and rho is "
          "its "
          "density, elsewhere that of the material.",
      .limits =
          "Atoms and ions meet walls and not each other. Atoms of all materials settle as one "
          "film. "
          "No diffusion on the surface, no heating.",
      .source =
          "kinetic theory; yields: C. Steinbruechel, Appl. Phys. Lett. 55, 1960 (1989), J. P. "
          "Chang, "
          "H. H. Sawin, J. Vac. Sci. Technol. A 15, 610 (1997)",
      .parameters = parameters(),
      .read = read};
}

}  // namespace scarp

#include "models/sf6_o2.h"

#include "models/plasma_etch.h"

namespace scarp {

namespace {

constexpr PlasmaChemistry chemistry{
    .etchant = "F",
    .passivation = "O",
    .etchant_sticking = "0.7",
    .passivation_sticking = "1",
    .sputter_amplitude =
        "{ Si = 0.0337, polySi = 0.0337, mask = 0.0139, SiO2 = 0.0139, Si3N4 = 0.0139 }",
    .sputter_threshold =
        "{ Si = \"20 eV\", polySi = \"20 eV\", mask = \"20 eV\", SiO2 = \"18 eV\", "
        "Si3N4 = \"18 eV\" }",
    .enhanced_amplitude = "7",
    .source = "Belen et al. 2005; oxide, nitride: La Magna, Garozzo 2003"};

std::span<const Parameter> parameters() {
  static const std::vector<Parameter> rows = plasma_etch_parameters(chemistry);
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  return read_plasma_etch(step, scope, chemistry);
}

}  // namespace

ModelDescription sf6_o2_description() {
  return {
      .name = "sf6_o2",
      .summary = "silicon in SF6/O2: ions, fluorine, and oxygen that keeps walls from being etched",
      .equation = plasma_etch_equation,
      .symbols = plasma_etch_symbols,
      .limits = plasma_etch_limits,
      .source =
          "R. J. Belen, S. Gomez, M. Kiehlbauch, D. Cooperberg, E. S. Aydil, J. Vac. Sci. Technol. "
          "A 23, 99 (2005)",
      .parameters = parameters(),
      .read = read};
}

}  // namespace scarp

#include "models/catalogue/sf6_c4f8.h"

#include "models/catalogue/plasma_etch.h"

namespace scarp {

namespace {

constexpr PlasmaChemistry chemistry{
    .name = "sf6_c4f8",
    .summary = "the etch of a Bosch process: ions clear a film of polymer, fluorine etches silicon",
    .equations_source =
        "equations: R. J. Belen, S. Gomez, M. Kiehlbauch, D. Cooperberg, E. S. Aydil, J. Vac. "
        "Sci. Technol. A 23, 99 (2005), without the second gas; the values of the polymer are "
        "those of ViennaPS, not a measurement",
    .etchant = "F",
    .etchant_sticking = "{ Si = 0.7, polySi = 0.7, default = 0.02 }",
    .sputter_amplitude =
        "{ Si = 0.0337, polySi = 0.0337, polymer = 0.02, mask = 0.0139, "
        "SiO2 = 0.0139, Si3N4 = 0.0139 }",
    .sputter_threshold =
        "{ Si = \"20 eV\", polySi = \"20 eV\", polymer = \"15 eV\", mask = \"20 eV\", "
        "SiO2 = \"18 eV\", Si3N4 = \"18 eV\" }",
    .sputter_factor = "{ polymer = 8.5, default = 9.3 }",
    .enhanced_amplitude = "7",
    .values_source = "Belen et al. 2005; polymer: ViennaPS; oxide, nitride: La Magna 2003"};

}  // namespace

ModelDescription sf6_c4f8_description() { return plasma_etch_description<chemistry>(); }

}  // namespace scarp

#include "models/catalogue/hbr_o2.h"

#include "models/catalogue/plasma_etch.h"

namespace scarp {

namespace {

constexpr PlasmaChemistry chemistry{
    .name = "hbr_o2",
    .summary = "silicon in HBr/O2: ions, bromine, and oxygen that keeps walls from being etched",
    .equations_source =
        "equations: R. J. Belen, S. Gomez, M. Kiehlbauch, D. Cooperberg, E. S. Aydil, J. Vac. "
        "Sci. Technol. A 23, 99 (2005); the values are those of ViennaPS, not a measurement",
    .etchant = "Br",
    .passivation = "O",
    .etchant_sticking = "0.1",
    .passivation_sticking = "1",
    .sputter_amplitude = "{ Si = 0.5, polySi = 0.5, mask = 0.0139, SiO2 = 0.0139, Si3N4 = 0.0139 }",
    .sputter_threshold =
        "{ Si = \"30 eV\", polySi = \"30 eV\", mask = \"20 eV\", SiO2 = \"18 eV\", "
        "Si3N4 = \"18 eV\" }",
    .enhanced_amplitude = "5",
    .values_source = "ViennaPS; oxide, nitride: La Magna, Garozzo 2003"};

}  // namespace

ModelDescription hbr_o2_description() { return plasma_etch_description<chemistry>(); }

}  // namespace scarp

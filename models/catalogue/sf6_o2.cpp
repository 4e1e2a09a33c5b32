#include "models/catalogue/sf6_o2.h"

#include "models/catalogue/plasma_etch.h"

namespace scarp {

namespace {

constexpr PlasmaChemistry chemistry{
    .name = "sf6_o2",
    .summary = "silicon in SF6/O2: ions, fluorine, and oxygen that keeps walls from being etched",
    .equations_source =
        "R. J. Belen, S. Gomez, M. Kiehlbauch, D. Cooperberg, E. S. Aydil, J. Vac. Sci. Technol. "
        "A 23, 99 (2005)",
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
    .values_source = "Belen et al. 2005; oxide, nitride: La Magna, Garozzo 2003"};

}  // namespace

ModelDescription sf6_o2_description() { return plasma_etch_description<chemistry>(); }

}  // namespace scarp

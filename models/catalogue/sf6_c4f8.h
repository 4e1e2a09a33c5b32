#pragma once

#include "models/model_description.h"

namespace scarp {

/// Etching of silicon in a plasma of SF6 between two films of C4F8, see PlasmaEtch.
ModelDescription sf6_c4f8_description();

}  // namespace scarp

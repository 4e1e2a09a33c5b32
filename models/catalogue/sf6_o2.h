#pragma once

#include "models/model_description.h"

namespace scarp {

/// Etching of silicon in a plasma of SF6 and O2, see PlasmaEtch.
ModelDescription sf6_o2_description();

}  // namespace scarp

#pragma once

#include "models/model_description.h"

namespace scarp {

/// Etching of silicon in a plasma of HBr and O2, see PlasmaEtch.
ModelDescription hbr_o2_description();

}  // namespace scarp

#pragma once

#include "models/model_description.h"

namespace scarp {

/// Deposition of atoms from a target, with ions that may sputter them again, see Sputtering.
ModelDescription sputter_deposition_description();

}  // namespace scarp

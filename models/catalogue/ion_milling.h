#pragma once

#include "models/model_description.h"

namespace scarp {

/// Etching by ions alone, whose atoms may settle again, see Sputtering.
ModelDescription ion_milling_description();

}  // namespace scarp

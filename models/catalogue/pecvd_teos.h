#pragma once

#include "models/model_description.h"

namespace scarp {

/// Oxide from TEOS in a plasma: radicals, and ions that help, see Teos.
ModelDescription pecvd_teos_description();

}  // namespace scarp

#pragma once

#include "models/model_description.h"

namespace scarp {

/// Wet etching of silicon by the rates of its planes, see Crystal.
ModelDescription koh_etch_description();

}  // namespace scarp

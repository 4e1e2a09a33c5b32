#pragma once

#include "models/model_description.h"

namespace scarp {

/// Gas that is filled up to a plane, see Fill.
ModelDescription fill_description();

}  // namespace scarp

#pragma once

#include "models/model_description.h"

namespace scarp {

/// A material that is taken away wholly, see Strip.
ModelDescription strip_description();

}  // namespace scarp

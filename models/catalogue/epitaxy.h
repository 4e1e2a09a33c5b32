#pragma once

#include "models/model_description.h"

namespace scarp {

/// Selective growth of a crystal by the rates of its planes, see Crystal.
ModelDescription epitaxy_description();

}  // namespace scarp

#pragma once

#include "models/model_description.h"

namespace scarp {

/// Chemical-mechanical polishing, as a cut: all solid above a plane goes, see Planarise.
ModelDescription planarise_description();

}  // namespace scarp

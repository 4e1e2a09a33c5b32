#pragma once

#include "models/model_description.h"

namespace scarp {

/// Growth of a film of the same thickness everywhere, as geometry: see ConformalFilm.
ModelDescription conformal_description();

}  // namespace scarp

#pragma once

#include "models/model_description.h"

namespace scarp {

/// A resist or a hard mask with openings on what is there, see MaskFilm.
ModelDescription mask_description();

}  // namespace scarp

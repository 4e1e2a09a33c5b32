#pragma once

#include <string_view>

namespace scarp {

/// The script that shows the scenes of a page (apps/viewer/src).
std::string_view viewer_script();

}  // namespace scarp

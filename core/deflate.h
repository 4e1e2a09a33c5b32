#pragma once

#include <string>
#include <string_view>

namespace scarp {

/// Bytes as a zlib stream (RFC 1950), as small as it gets.
std::string deflated(std::string_view bytes);

}  // namespace scarp

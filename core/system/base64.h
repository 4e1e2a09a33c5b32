#pragma once

#include <string>
#include <string_view>

namespace scarp {

/// Bytes as text that may stand anywhere (RFC 4648, with padding).
std::string base64(std::string_view bytes);

}  // namespace scarp

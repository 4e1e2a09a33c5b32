#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace scarp {

/// Bytes as a zlib stream (RFC 1950), as small as it gets.
std::string deflated(std::string_view bytes);

/// What a zlib stream holds; nothing if it is damaged or holds another number of bytes than size.
std::optional<std::string> inflated(std::string_view stream, std::size_t size);

}  // namespace scarp

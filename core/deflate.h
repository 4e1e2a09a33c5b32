#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace scarp {

/// Bytes as a zlib stream (RFC 1950), as small as it gets.
std::string deflated(std::string_view bytes);

/// What a zlib or a gzip stream holds.
///
/// Throws: InputError that says what is wrong, without a name: the stream is damaged or ends early,
///         or holds more than the given number of bytes.
std::string inflated(std::string_view bytes, std::size_t most);

}  // namespace scarp

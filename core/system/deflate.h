#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace scarp {

/// Bytes as a zlib stream (RFC 1950), as small as it gets.
std::string deflated(std::string_view bytes);

/// What a gzip file (RFC 1952) holds.
///
/// Throws: InputError that says what is wrong, without a name: the stream is damaged or ends early,
///         or holds more than the given number of bytes.
std::string gunzipped(std::string_view bytes, std::size_t most);

/// What a zlib stream holds; nothing if it is damaged or holds another number of bytes than size.
std::optional<std::string> inflated(std::string_view stream, std::size_t size);

}  // namespace scarp

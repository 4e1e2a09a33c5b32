#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace scarp {

/// An amount of memory as users write it: "512 MB", "2 GB", "2GB", of 1024 * 1024 and of 1024 times
/// as many bytes.
///
/// Units:   bytes.
/// Returns: nothing for other texts, and for less than 1 MB and more than 1e15 bytes.
std::optional<std::uint64_t> parse_memory(std::string_view text);

}  // namespace scarp

#pragma once

#include <span>
#include <string>
#include <string_view>

namespace scarp {

/// The candidate that was probably meant by a misspelt name; empty if none is near.
///
/// Near is one edit in three letters, upper and lower case alike; of two that are as near, the
/// one with the longer common start wins, then the first.
std::string nearest_name(std::string_view name, std::span<const std::string> candidates);

/// " (did you mean X?)", or nothing: to be put behind a message about a name.
std::string suggestion(std::string_view name, std::span<const std::string> candidates);

}  // namespace scarp

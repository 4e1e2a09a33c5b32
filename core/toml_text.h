#pragma once

#include <string>
#include <string_view>

namespace scarp {

/// A TOML string with its quotes.
std::string toml_string(std::string_view text);

/// A TOML key: bare where that is allowed, else with quotes.
std::string toml_key(std::string_view key);

}  // namespace scarp

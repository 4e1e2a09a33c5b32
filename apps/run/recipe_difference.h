#pragma once

#include <string>
#include <string_view>

namespace scarp {

/// Where one resolved recipe differs from another first, in the order of the first one, for
/// messages: "step[0].sticking is 0.2, there 0.1". Empty if all is the same.
///
/// Throws: InputError if one of them is not TOML.
std::string first_difference(std::string_view recipe, std::string_view there);

}  // namespace scarp

#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace scarp {

/// A place in a recipe: names of keys and, from 0, places in lists.
using RecipePath = std::vector<std::variant<std::string, std::size_t>>;

/// Reads `step[0].duration`. Throws InputError if the text is not a path.
RecipePath parse_recipe_path(std::string_view text);

/// Writes it as messages do: `step[0].duration`.
std::string format_recipe_path(const RecipePath& path);

/// True for the same place and for places within it.
bool is_within(std::string_view path, std::string_view outer);

}  // namespace scarp

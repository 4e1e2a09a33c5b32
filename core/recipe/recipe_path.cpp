#include "core/recipe/recipe_path.h"

#include <charconv>

#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/toml.h"

namespace scarp {

namespace {

[[noreturn]] void throw_not_a_path(std::string_view text) {
  throw InputError(in_quotes(text) +
                   " is not a path; write for example domain.spacing or step[0].duration");
}

}  // namespace

RecipePath parse_recipe_path(std::string_view text) {
  RecipePath path;
  std::string_view rest = text;
  while (true) {
    const std::string_view name = rest.substr(0, rest.find_first_of(".["));
    if (name.empty() || name.find_first_of("] \t\n\r\"'=") != std::string_view::npos) {
      throw_not_a_path(text);
    }
    path.emplace_back(std::string(name));
    rest.remove_prefix(name.size());
    while (rest.starts_with('[')) {
      std::size_t index = 0;
      const char* const end = rest.data() + rest.size();
      const auto result = std::from_chars(rest.data() + 1, end, index);
      if (result.ec != std::errc{} || result.ptr == end || *result.ptr != ']') {
        throw_not_a_path(text);
      }
      path.emplace_back(index);
      rest.remove_prefix(static_cast<std::size_t>(result.ptr + 1 - rest.data()));
    }
    if (path.size() > max_toml_depth) throw_not_a_path(text);
    if (rest.empty()) return path;
    if (!rest.starts_with('.')) throw_not_a_path(text);
    rest.remove_prefix(1);
  }
}

std::string format_recipe_path(const RecipePath& path) {
  std::string text;
  for (const auto& part : path) {
    if (const auto* const name = std::get_if<std::string>(&part)) {
      if (!text.empty()) text += '.';
      text += repeated(*name);
    } else {
      text.append("[").append(std::to_string(std::get<std::size_t>(part))).append("]");
    }
  }
  return text;
}

bool is_within(std::string_view path, std::string_view outer) {
  if (outer.empty() || path == outer) return true;
  return path.starts_with(outer) && (path[outer.size()] == '.' || path[outer.size()] == '[');
}

}  // namespace scarp

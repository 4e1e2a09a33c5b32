#include "apps/run/recipe_difference.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "core/recipe/recipe_path.h"
#include "core/recipe/toml.h"

namespace scarp {

namespace {

struct Difference {
  RecipePath path;
  const TomlValue* here;  // null where there is none
  const TomlValue* there;
};

std::optional<Difference> difference(const RecipePath& path, const TomlValue* here,
                                     const TomlValue* there);

// Keys of both, those of the first one in its order.
std::optional<Difference> difference_of_tables(const RecipePath& path, const TomlValue& here,
                                               const TomlValue& there) {
  const auto look = [&](const std::string& key) {
    RecipePath inner = path;
    inner.emplace_back(key);
    return difference(inner, here.find(key), there.find(key));
  };
  for (const TomlValue& entry : here.entries)
    if (auto found = look(entry.key)) return found;
  for (const TomlValue& entry : there.entries)
    if (auto found = look(entry.key)) return found;
  return std::nullopt;
}

std::optional<Difference> difference_of_lists(const RecipePath& path, const TomlValue& here,
                                              const TomlValue& there) {
  const auto at = [](const TomlValue& list, std::size_t n) {
    return n < list.entries.size() ? &list.entries[n] : nullptr;
  };
  for (std::size_t n = 0; n < std::max(here.entries.size(), there.entries.size()); ++n) {
    RecipePath inner = path;
    inner.emplace_back(n);
    if (auto found = difference(inner, at(here, n), at(there, n))) return found;
  }
  return std::nullopt;
}

std::optional<Difference> difference(const RecipePath& path, const TomlValue* here,
                                     const TomlValue* there) {
  if (here != nullptr && there != nullptr && here->kind == there->kind) {
    if (here->is_table()) return difference_of_tables(path, *here, *there);
    if (here->is_list()) return difference_of_lists(path, *here, *there);
    if (format_toml(*here) == format_toml(*there)) return std::nullopt;
  }
  return Difference{path, here, there};
}

std::string text_of(const TomlValue* value) {
  return value == nullptr ? "missing" : described(*value);
}

// What is not a value: the contents of files, which stand behind their names as comments.
std::string difference_of_lines(std::string_view here, std::string_view there) {
  const auto [a, b] = std::ranges::mismatch(here, there);
  if (a == here.end() && b == there.end()) return "";
  const auto at = static_cast<std::size_t>(a - here.begin());
  const std::size_t before = here.substr(0, at).rfind('\n');
  const std::size_t begin = before == std::string_view::npos ? 0 : before + 1;
  return fmt::format("a file has changed: {}", here.substr(begin, here.find('\n', at) - begin));
}

}  // namespace

std::string first_difference(std::string_view recipe, std::string_view there) {
  const TomlValue here = parse_toml(recipe, "recipe");
  const TomlValue other = parse_toml(there, "recipe.toml");
  const auto found = difference({}, &here, &other);
  if (!found) return difference_of_lines(recipe, there);
  return fmt::format("{} is {}, there {}", format_recipe_path(found->path), text_of(found->here),
                     text_of(found->there));
}

}  // namespace scarp

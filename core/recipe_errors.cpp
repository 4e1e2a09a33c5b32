#include "core/recipe_errors.h"

#include <algorithm>
#include <tuple>

#include "core/recipe_path.h"

namespace scarp {

namespace {

std::string formatted(const TomlPlace& place, const std::string& file) {
  if (!place.source.empty()) return place.source + ": ";
  return file + ':' + std::to_string(place.line) + ':' + std::to_string(place.column) + ": ";
}

}  // namespace

void RecipeErrors::add(Entry entry) {
  const auto same = [&](const Entry& other) {
    return other.path == entry.path && other.text == entry.text;
  };
  if (std::none_of(entries_.begin(), entries_.end(), same)) entries_.push_back(std::move(entry));
}

void RecipeErrors::forget_missing(std::string_view path) {
  std::erase_if(entries_, [&](const Entry& entry) {
    return std::find(entry.missing.begin(), entry.missing.end(), path) != entry.missing.end();
  });
}

bool RecipeErrors::ok(std::string_view path) const {
  return std::none_of(entries_.begin(), entries_.end(),
                      [&](const Entry& entry) { return is_within(entry.path, path); });
}

std::string RecipeErrors::text() const {
  std::vector<Entry> sorted = entries_;
  const auto key = [](const Entry& entry) {
    return std::tuple(entry.place.source, entry.place.line, entry.place.column);
  };
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](const Entry& a, const Entry& b) { return key(a) < key(b); });
  std::string lines;
  for (const Entry& entry : sorted) {
    if (!lines.empty()) lines += '\n';
    lines += formatted(entry.place, file_);
    if (!entry.path.empty()) lines += entry.path + ": ";
    lines += entry.text;
  }
  return lines;
}

}  // namespace scarp

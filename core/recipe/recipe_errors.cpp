#include "core/recipe/recipe_errors.h"

#include <algorithm>
#include <span>
#include <tuple>

#include "core/printable.h"
#include "core/recipe/recipe_path.h"

namespace scarp {

namespace {

constexpr std::size_t most_lines = 100;

std::string formatted(const TomlPlace& place, const std::string& file) {
  if (!place.source.empty()) return place.source;
  return file + ':' + std::to_string(place.line) + ':' + std::to_string(place.column);
}

}  // namespace

void RecipeErrors::add(Entry entry) {
  if (known_.insert({entry.path, entry.text}).second) entries_.push_back(std::move(entry));
}

void RecipeErrors::forget_missing(const std::set<std::string>& paths) {
  std::erase_if(entries_, [&](const Entry& entry) {
    const bool forgotten =
        std::any_of(entry.missing.begin(), entry.missing.end(),
                    [&](const std::string& path) { return paths.contains(path); });
    if (forgotten) known_.erase({entry.path, entry.text});
    return forgotten;
  });
}

bool RecipeErrors::ok(std::string_view path) const {
  if (path.empty()) return entries_.empty();
  // In the order of the set, what is within a path stands in up to three runs behind it.
  for (const char* const next : {"", ".", "["}) {
    const std::string start = std::string(path) + next;
    const auto first = known_.lower_bound({start, ""});
    if (first != known_.end() && is_within(first->first, path)) return false;
  }
  return true;
}

std::vector<Problem> RecipeErrors::problems() const {
  std::vector<Entry> sorted = entries_;
  const auto key = [](const Entry& entry) {
    return std::tuple(entry.place.source, entry.place.line, entry.place.column);
  };
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](const Entry& a, const Entry& b) { return key(a) < key(b); });
  std::vector<Problem> problems;
  for (const Entry& entry : std::span(sorted).first(std::min(sorted.size(), most_lines))) {
    const std::string path = entry.path.empty() ? "" : ": " + repeated(entry.path);
    problems.push_back(problem_at(formatted(entry.place, file_) + path, entry.text));
  }
  if (sorted.size() > most_lines)
    problems.push_back({.place = "",
                        .what = "... and " + std::to_string(sorted.size() - most_lines) + " more",
                        .remedy = ""});
  return problems;
}

}  // namespace scarp

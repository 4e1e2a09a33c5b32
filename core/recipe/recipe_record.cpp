#include "core/recipe/recipe_record.h"

#include <algorithm>

#include "core/recipe/toml.h"
#include "core/toml_text.h"

namespace scarp {

namespace {

template <class Entries>
auto find(Entries& entries, std::string_view key) {
  return std::find_if(entries.begin(), entries.end(),
                      [&](const auto& entry) { return entry.first == key; });
}

}  // namespace

void RecipeRecord::set(std::string_view key, std::string value) {
  const auto entry = find(values_, key);
  if (entry != values_.end()) {
    entry->second = std::move(value);
  } else {
    values_.emplace_back(key, std::move(value));
  }
}

RecipeRecord& RecipeRecord::table(std::string_view key) {
  const auto entry = find(tables_, key);
  if (entry != tables_.end()) return *entry->second;
  return *tables_.emplace_back(key, std::make_unique<RecipeRecord>()).second;
}

RecipeRecord& RecipeRecord::append(std::string_view key) {
  auto entry = find(arrays_, key);
  if (entry == arrays_.end()) {
    arrays_.emplace_back(key, std::vector<std::unique_ptr<RecipeRecord>>());
    entry = arrays_.end() - 1;
  }
  return *entry->second.emplace_back(std::make_unique<RecipeRecord>());
}

std::string RecipeRecord::toml() const {
  std::string out;
  write(out, "");
  return out;
}

void RecipeRecord::write(std::string& out, const std::string& path) const {
  const auto header = [&](const std::string& text) {
    if (!out.empty()) out += '\n';
    out.append(text).append("\n");
  };
  const auto inner_path = [&](const std::string& key) {
    return path.empty() ? toml_key(key) : path + '.' + toml_key(key);
  };
  for (const auto& [key, value] : values_) {
    out.append(toml_key(key)).append(" = ").append(value).append("\n");
  }
  for (const auto& [key, table] : tables_) {
    if (!table->values_.empty()) header('[' + inner_path(key) + ']');
    table->write(out, inner_path(key));
  }
  for (const auto& [key, array] : arrays_) {
    for (const auto& entry : array) {
      header("[[" + inner_path(key) + "]]");
      entry->write(out, inner_path(key));
    }
  }
}

}  // namespace scarp

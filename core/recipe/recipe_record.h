#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace scarp {

/// What was read from a recipe, defaults included, as a tree that writes itself as TOML.
class RecipeRecord {
 public:
  /// The value is TOML already: `"4 um"` with its quotes, `0.1`, `["x", "y"]`. The last one counts.
  void set(std::string_view key, std::string value);
  RecipeRecord& table(std::string_view key);
  /// One more entry of an array of tables.
  RecipeRecord& append(std::string_view key);

  /// In the order in which things were read: values, then tables, then arrays of tables.
  std::string toml() const;

 private:
  void write(std::string& out, const std::string& path) const;

  std::vector<std::pair<std::string, std::string>> values_;
  std::vector<std::pair<std::string, std::unique_ptr<RecipeRecord>>> tables_;
  std::vector<std::pair<std::string, std::vector<std::unique_ptr<RecipeRecord>>>> arrays_;
};

}  // namespace scarp

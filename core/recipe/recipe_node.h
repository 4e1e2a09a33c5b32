#pragma once

#include <deque>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/recipe/recipe_errors.h"
#include "core/recipe/recipe_record.h"
#include "core/recipe/recipe_source.h"
#include "core/recipe/toml.h"

// What stands behind RecipeFile and RecipeTable; only their sources include it.
namespace scarp::detail {

struct RecipeContent;

/// A table that a reader asks, and what it asked.
struct RecipeNode {
  RecipeContent* content = nullptr;
  RecipeRecord* record = nullptr;
  std::string path{};
  const TomlValue* toml = nullptr;  ///< null when the recipe has no such table
  TomlPlace place{};                ///< of its header, or of the table around it
  bool missing_is_noted = true;     ///< false when something that is no table stands in its place
  bool rest_accepted = false;
  std::vector<std::string> asked{};
  std::map<std::string, std::vector<RecipeNode*>, std::less<>> inner{};
};

struct RecipeContent {
  TomlValue toml;
  std::filesystem::path folder;
  LoadFile load_file;
  RecipeErrors errors;
  RecipeErrors warnings;
  RecipeRecord record;
  std::deque<RecipeNode> nodes;  ///< grows without moving what handles point at
};

/// A file by the name that a recipe gives it, from its folder if that is where they are.
std::string content_of(const RecipeContent& content, const std::string& name);

/// "step[0].duration"
inline std::string inner_path(const RecipeNode& node, std::string_view key) {
  if (node.path.empty() || key.empty()) return node.path + std::string(key);
  return node.path + '.' + std::string(key);
}

/// "a, b, c"
std::string joined(const std::vector<std::string>& names);

}  // namespace scarp::detail

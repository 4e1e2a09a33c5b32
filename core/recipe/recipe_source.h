// A public header: installed as scarp/core/recipe/recipe_source.h.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace scarp {

/// The content of a file that a recipe names, by the name that the recipe gives it.
using LoadFile = std::function<std::string(const std::string& name)>;

/// A recipe as text, what is changed in it, and where the files are that it names.
struct RecipeSource {
  std::string text{};
  std::string name = "recipe.toml";      ///< stands for the file in messages
  std::vector<std::string> overrides{};  ///< PATH=VALUE with VALUE in TOML
  std::filesystem::path folder{};        ///< that files are named relative to
  LoadFile load_file{};                  ///< in place of reading them from the folder
};

/// A recipe in a file, which names others relative to its folder.
///
/// Throws: InputError if the file cannot be read.
RecipeSource recipe_in(const std::filesystem::path& file, std::vector<std::string> overrides = {});

}  // namespace scarp

#include "core/recipe/recipe_source.h"

#include "core/system/read_file.h"

namespace scarp {

RecipeSource recipe_in(const std::filesystem::path& file, std::vector<std::string> overrides) {
  return {.text = read_file(file),
          .name = file.string(),
          .overrides = std::move(overrides),
          .folder = file.parent_path()};
}

}  // namespace scarp

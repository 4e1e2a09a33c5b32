#pragma once

#include <fstream>
#include <string>

#include "apps/recipe.h"
#include "core/temporary_folder.h"

namespace scarp {

/// A recipe that stands in a test.
inline Recipe read_text(const std::string& text) {
  const TemporaryFolder folder;
  std::ofstream(folder / "r.toml") << text;
  return read_recipe(folder / "r.toml", {});
}

}  // namespace scarp

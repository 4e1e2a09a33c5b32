// Every number of a recipe, one after the other, as what is no number or overflows.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <regex>
#include <set>
#include <string>

#include "apps/simulator/recipe.h"
#include "core/error.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

class RecipeNumbers : public testing::TestWithParam<const char*> {};

/// Whether reading it fails as a wrong recipe does.
bool is_refused(const std::string& text) {
  try {
    read_text(text);
    return false;
  } catch (const InputError&) {
    return true;
  }
}

// Every key once: what recipes have in common is read by the same code.
TEST_P(RecipeNumbers, AreRefusedWhereTheyAreNone) {
  std::set<std::string> known;
  for (const fs::path& file : fs::directory_iterator(fs::path(SCARP_SOURCE_DIR) / "configs")) {
    if (file.extension() != ".toml") continue;
    // With what it leaves to defaults.
    const std::string text = read_recipe(recipe_in(file)).resolved;
    const std::regex number(R"re((= |\[|, |")(-?[0-9][0-9.e+-]*)(?=[ ",\]%}\n]|$))re");
    for (auto found = std::sregex_iterator(text.begin(), text.end(), number);
         found != std::sregex_iterator(); ++found) {
      const auto place = static_cast<std::size_t>(found->position(2));
      const std::size_t begin = text.rfind('\n', place) + 1;
      std::string key = text.substr(begin, place - begin);
      std::erase_if(key, [](unsigned char c) { return std::isdigit(c) != 0; });
      if (!known.insert(key).second) continue;
      std::string changed = text;
      changed.replace(place, static_cast<std::size_t>(found->length(2)), GetParam());
      EXPECT_TRUE(is_refused(changed))
          << file.filename() << ": " << changed.substr(begin, changed.find('\n', begin) - begin);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, RecipeNumbers,
                         testing::Values("nan", "inf", "-inf", "1e308", "-1e308"));

}  // namespace
}  // namespace scarp

#pragma once

#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/recipe/toml.h"

namespace scarp {

/// What is wrong with a recipe, or doubtful, gathered to be reported together.
class RecipeErrors {
 public:
  struct Entry {
    std::string path;  ///< `step[0].sticking`
    TomlPlace place;
    std::string text;
    std::vector<std::string> missing{};  ///< paths of keys of which one has to be there
  };

  explicit RecipeErrors(std::string file) : file_(std::move(file)) {}

  void add(Entry entry);
  /// Forgets that keys are missing, because they are there misspelt.
  void forget_missing(const std::set<std::string>& paths);

  bool empty() const { return entries_.empty(); }
  /// No error at the path nor within it.
  bool ok(std::string_view path) const;

  /// By line of the file, those of the command line last. Of very many, the
  /// first hundred and how many there are.
  std::vector<Problem> problems() const;

 private:
  std::string file_;
  std::vector<Entry> entries_;
  std::set<std::pair<std::string, std::string>> known_;  ///< path and text of each entry
};

}  // namespace scarp

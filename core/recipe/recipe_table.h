#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/limits.h"
#include "core/material.h"
#include "core/recipe/number_table.h"
#include "core/recipe/quantity.h"
#include "core/recipe/recipe_source.h"

namespace scarp {

/// How many entries a list may have. A list with a fallback and without a key gets maximum entries.
struct ListSize {
  std::size_t minimum = 1;
  std::size_t maximum = std::numeric_limits<std::size_t>::max();
  std::string_view why{};  ///< what asks for so many, to end a message with
};

/// The materials that a recipe knows, and those that have to get a value.
struct MaterialScope {
  const Materials& materials;
  std::span<const MaterialId> reachable;
};

/// The names that a key may have, and what they stand for.
template <class T>
using Choices = std::vector<std::pair<std::string_view, T>>;

namespace detail {
struct RecipeContent;
struct RecipeNode;
}  // namespace detail

/// A table of a recipe, asked key by key: a small handle that lives as long as its RecipeFile.
///
/// Nothing throws while a recipe is read: what is wrong is noted in the file, the reader gets the
/// fallback or some allowed value and goes on, and RecipeFile::finish() throws all errors at once.
/// A key that nobody asked for is an error, too. A table that the recipe does not have is asked
/// like one that is there and empty.
///
/// Units: what is returned is in the unit of the inside (core/recipe/quantity.h).
class RecipeTable {
 public:
  double length(std::string_view key, const Limits& limits = {}) const;
  double time(std::string_view key, const Limits& limits = {}) const;
  double energy(std::string_view key, const Limits& limits = {}) const;
  double angle(std::string_view key, const Limits& limits = {}) const;
  double rate(std::string_view key, const Limits& limits = {}) const;
  double number(std::string_view key, const Limits& limits = {}) const;
  /// A number in [0, 1].
  double fraction(std::string_view key, std::string_view fallback = {}) const;
  double quantity(std::string_view key, Dimension dimension, const Limits& limits = {}) const;
  std::int64_t integer(std::string_view key, const Limits& limits = {}) const;
  bool flag(std::string_view key, std::optional<bool> fallback = {}) const;
  /// true or false; nothing for a word that leaves it open.
  std::optional<bool> flag_or(std::string_view word, std::string_view key, bool fallback) const;
  std::string text(std::string_view key, std::optional<std::string_view> fallback = {}) const;

  /// A length, or a number that counts a given length ("in grid spacings"). Limits hold for the
  /// number. Units: nm.
  double length_or_multiple(std::string_view key, double unit_length,
                            const Limits& limits = {}) const;

  /// A list of quantities: extent = ["10 um", "10 um"].
  std::vector<double> quantities(std::string_view key, Dimension dimension, ListSize size = {},
                                 const Limits& limits = {}) const;
  /// Polygons of at least three points, each up to a metre away: one, [["0 um", "0 um"], ...], or a
  /// list of such lists.
  std::vector<std::vector<std::array<double, 2>>> polygons(std::string_view key) const;
  /// The lower and the upper corner of a box: [["0 um", "0 um"], ["1 um", "1 um"]].
  std::array<std::array<double, 2>, 2> corners(std::string_view key) const;
  /// The name of a file; of one in a folder its absolute path, so that the resolved recipe finds it
  /// from anywhere.
  std::string file(std::string_view key) const;
  /// What such a file holds. Its hash is recorded as a comment behind the name: with another
  /// content the resolved recipe is another one. Throws: InputError if it cannot be read.
  std::string content(std::string_view key, const std::string& file) const;
  std::vector<std::string> texts(std::string_view key, ListSize size = {}) const;

  /// A table of numbers: a list of rows, [["0 deg", 1], ["90 deg", 0]], or the name of a CSV file,
  /// whose first line is csv_head(). Recorded as rows, so that the
  /// resolved recipe needs no file.
  ///
  /// Rows ascend by their first number, those with the same by their second, and so on; no two
  /// agree in all but the last. Nothing if there is no such key, or something is wrong with it.
  std::optional<NumberTable> number_table(std::string_view key,
                                          std::span<const Column> columns) const;
  /// Notes that a row of it is wrong.
  void row_error(std::string_view key, const NumberTable& table, std::size_t row,
                 std::string_view text) const;

  template <class T>
  T choice(std::string_view key, const Choices<std::type_identity_t<T>>& choices,
           std::string_view fallback = {}) const;
  template <class T>
  std::vector<T> choices(std::string_view key, const Choices<std::type_identity_t<T>>& choices,
                         ListSize size = {}, std::string_view fallback = {}) const;

  MaterialId material(std::string_view key, const Materials& materials,
                      std::string_view fallback = {}) const;
  /// A material; nothing for the word that stands for none of them, which is the fallback.
  std::optional<MaterialId> material_or(std::string_view word, std::string_view key,
                                        const Materials& materials) const;
  /// Materials; a fallback is written as a list, ["Si", "polySi"].
  std::vector<MaterialId> material_list(std::string_view key, const Materials& materials,
                                        ListSize size = {}, std::string_view fallback = {}) const;
  /// Some materials; an empty list for the word that stands for all of them, which is the fallback.
  std::vector<MaterialId> material_list_or(std::string_view word, std::string_view key,
                                           const Materials& materials) const;

  /// One value for all materials, or a table { Si = ..., default = ... } that lists at least the
  /// reachable ones. A fallback may be such a table, whose rows fill in for those that the recipe's
  /// table does not list, unless it has a default.
  ///
  /// Shape: one per material; 0 for those that are not listed and cannot be reached.
  std::vector<double> per_material(std::string_view key, Dimension dimension,
                                   const MaterialScope& scope, const Limits& limits = {}) const;

  /// One text for all materials, or a table of texts, with the same rules; none may be empty.
  ///
  /// Shape: one per material; empty for those that are not listed and cannot be reached.
  std::vector<std::string> per_material_text(std::string_view key,
                                             const MaterialScope& scope) const;

  RecipeTable table(std::string_view key) const;
  /// The entries of an array of tables, [[key]]; none if there is no such key.
  std::vector<RecipeTable> tables(std::string_view key) const;
  /// The same, but one empty entry if there is no such key: its fallbacks are recorded.
  std::vector<RecipeTable> tables_or_one(std::string_view key) const;

  bool has(std::string_view key) const;
  /// What the recipe has in this table, in the order of the file. Does not count as asking for it.
  std::vector<std::string> keys() const;
  /// The rows of a value that is a table, { Si = ..., default = ... }, in the same way.
  std::vector<std::string> rows(std::string_view key) const;

  /// Notes that the value of a key (or of `key[2]`; of the table, when empty) is wrong.
  void error(std::string_view key, std::string_view text) const;
  /// Notes that it is doubtful, with the same keys; see RecipeFile::warnings().
  void warning(std::string_view key, std::string_view text) const;
  /// Notes that one of some keys has to be there; forgotten when one is there misspelt.
  void missing(std::span<const std::string_view> keys, std::string_view text) const;
  /// No error was noted for the key (for anything in the table, when empty).
  bool ok(std::string_view key = {}) const;
  /// Keys that nobody asked for are no errors here: for a reader that gives up early.
  void accept_rest() const;

  /// "step[1].step[0]"; empty for the whole recipe.
  const std::string& path() const;

 private:
  friend class RecipeFile;
  explicit RecipeTable(detail::RecipeNode& node) : node_(&node) {}

  /// The rows of a table by material, each read by read(entry); nothing if the key has no table.
  template <class Value, class Read>
  std::optional<std::vector<Value>> by_material(std::string_view key, const MaterialScope& scope,
                                                std::string_view fallback, const Read& read) const;
  /// The key has the word, or is not there: then the word is recorded.
  bool is_word(std::string_view key, std::string_view word) const;
  std::size_t choice_index(std::string_view key, std::span<const std::string_view> names,
                           std::string_view fallback) const;
  std::vector<std::size_t> choice_indices(std::string_view key,
                                          std::span<const std::string_view> names, ListSize size,
                                          std::string_view fallback) const;

  detail::RecipeNode* node_;
};

/// A recipe as it stands in its file, with what was changed on the command line.
class RecipeFile {
 public:
  /// Throws: InputError with file:line:column if the text is not TOML, or an override is not what
  /// it should be.
  explicit RecipeFile(const RecipeSource& source);
  ~RecipeFile();
  RecipeFile(RecipeFile&&) noexcept;
  RecipeFile& operator=(RecipeFile&&) noexcept;

  RecipeTable root() const;

  /// True while nothing is wrong; keys that nobody asked for are found by finish() only.
  bool ok() const;

  /// Call it when all has been read. Throws: InputError with all problems, by line of file.
  void finish() const;

  /// What is allowed and doubtful, a line each, by line of file.
  std::vector<std::string> warnings() const;

  /// What was read, defaults written out, as TOML that reads the same to the last bit.
  std::string resolved() const;

 private:
  std::unique_ptr<detail::RecipeContent> content_;
};

template <class T>
T RecipeTable::choice(std::string_view key, const Choices<std::type_identity_t<T>>& choices,
                      std::string_view fallback) const {
  std::vector<std::string_view> names;
  for (const auto& [name, value] : choices) names.push_back(name);
  return choices[choice_index(key, names, fallback)].second;
}

template <class T>
std::vector<T> RecipeTable::choices(std::string_view key,
                                    const Choices<std::type_identity_t<T>>& choices, ListSize size,
                                    std::string_view fallback) const {
  std::vector<std::string_view> names;
  for (const auto& [name, value] : choices) names.push_back(name);
  std::vector<T> values;
  for (const std::size_t index : choice_indices(key, names, size, fallback)) {
    values.push_back(choices[index].second);
  }
  return values;
}

}  // namespace scarp

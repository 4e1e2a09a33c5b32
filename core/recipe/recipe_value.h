#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/limits.h"
#include "core/material.h"
#include "core/recipe/number_table.h"
#include "core/recipe/quantity.h"
#include "core/recipe/recipe_errors.h"
#include "core/recipe/recipe_node.h"
#include "core/recipe/recipe_table.h"
#include "core/recipe/toml.h"

// Single values of a recipe, as RecipeTable reads them; only its source includes this. Readers note
// what is wrong and give nothing then.
namespace scarp::detail {

/// A value that the recipe has: what, and where.
struct Item {
  RecipeErrors& errors;
  const TomlValue& value;
  std::string path;
};

/// Adds an error about an item.
void note(const Item& item, std::string text);

/// "layers[2]"
std::string indexed(const std::string& path, std::size_t index);

bool is_allowed(double value, const Limits& limits);

/// " is below 5 nm": how a value that is not allowed misses its limits.
std::string outside(double value, const Limits& limits, Dimension dimension);

/// A fallback that is a TOML table or list; nothing if it is one value.
std::optional<TomlValue> compound(std::string_view fallback);

/// An allowed value for a reader that goes on although the recipe has none.
double stand_in(const Limits& limits, Dimension dimension);

/// An allowed value as a recipe would have it, for messages.
std::string example(const Limits& limits, Dimension dimension);

/// The value, if it is allowed.
std::optional<double> checked(const Item& item, std::optional<double> value, Dimension dimension,
                              const Limits& limits);

/// A text as a quantity of any size.
std::optional<double> parse_noted(const Item& item, Dimension dimension);

std::optional<double> read_quantity(const Item& item, Dimension dimension, const Limits& limits);
std::optional<std::int64_t> read_integer(const Item& item);
std::optional<std::string> read_text(const Item& item);
std::optional<MaterialId> read_material(const Item& item, const Materials& materials);

/// Which of the names it is.
std::optional<std::size_t> read_choice(const Item& item, const std::vector<std::string>& names);

/// The entries of a list of the right size; none, and an error, if it is not one.
std::vector<Item> read_list(const Item& item, ListSize size);

std::vector<std::array<double, 2>> read_polygon(const Item& item);

/// The same of a list of that size.
std::vector<std::array<double, 2>> read_points(const Item& item, ListSize size);

/// Rows of numbers that stand in the recipe, and those of the CSV file that it names.
std::optional<NumberTable> read_rows(const Item& item, std::span<const Column> columns);
std::optional<NumberTable> read_csv_noted(const Item& item, std::span<const Column> columns,
                                          const RecipeContent& content);

/// The rows as a recipe would hold them.
std::string format_rows(const NumberTable& table, std::span<const Column> columns);

/// "energy, then by angle": what rows ascend by.
std::string sort_text(std::span<const Column> columns);

}  // namespace scarp::detail

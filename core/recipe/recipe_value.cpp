#include "core/recipe/recipe_value.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/recipe_node.h"
#include "core/suggestion.h"
#include "core/toml_text.h"

namespace scarp::detail {

void note(const Item& item, std::string text) {
  item.errors.add({item.path, item.value.place, std::move(text)});
}

std::string indexed(const std::string& path, std::size_t index) {
  return path + '[' + std::to_string(index) + ']';
}

bool is_allowed(double value, const Limits& limits) {
  if (std::abs(value) > largest_number) return false;
  if (limits.exclusive) return value > limits.minimum && value < limits.maximum;
  return value >= limits.minimum && value <= limits.maximum;
}

std::string outside(double value, const Limits& limits, Dimension dimension) {
  const auto shown = [&](double limit) {
    return limit == 0 ? "0" : format_quantity(limit, dimension);
  };
  const bool is_one_sided = std::isinf(limits.minimum) || std::isinf(limits.maximum);
  if (is_one_sided && std::abs(value) > largest_number)
    return " is beyond what may be, " +
           format_quantity(std::copysign(largest_number, value), dimension);
  if (std::isinf(limits.maximum)) {
    return (limits.exclusive ? " is not above " : " is below ") + shown(limits.minimum);
  }
  if (std::isinf(limits.minimum)) {
    return (limits.exclusive ? " is not below " : " is above ") + shown(limits.maximum);
  }
  return std::string(" is outside ") + (limits.exclusive ? '(' : '[') + shown(limits.minimum) +
         ", " + shown(limits.maximum) + (limits.exclusive ? ')' : ']');
}

std::optional<TomlValue> compound(std::string_view fallback) {
  if (fallback.empty() || (fallback.front() != '{' && fallback.front() != '[')) return std::nullopt;
  return parse_toml("fallback = " + std::string(fallback), "fallback").entries.front();
}

double stand_in(const Limits& limits, Dimension dimension) {
  if (!limits.fallback.empty() && !compound(limits.fallback))
    return parse_quantity(limits.fallback, dimension);
  if (is_allowed(1, limits)) return 1;
  if (std::isinf(limits.maximum)) return limits.minimum + std::max(1.0, std::abs(limits.minimum));
  if (std::isinf(limits.minimum)) return limits.maximum - std::max(1.0, std::abs(limits.maximum));
  return limits.minimum + 0.5 * (limits.maximum - limits.minimum);
}

std::string example(const Limits& limits, Dimension dimension) {
  if (dimension == Dimension::number) return format_number(stand_in(limits, dimension));
  return toml_string(quantity_example(dimension));
}

std::optional<std::int64_t> read_integer(const Item& item) {
  constexpr double largest_exact = 9007199254740992.0;  // 2^53
  if (item.value.kind == TomlValue::Kind::integer) return item.value.integer;
  // 1e6 is a float in TOML, and the natural way to write a number of rays.
  const double decimal = item.value.decimal;
  if (item.value.kind == TomlValue::Kind::decimal && std::abs(decimal) <= largest_exact &&
      decimal == std::trunc(decimal)) {
    return static_cast<std::int64_t>(decimal);
  }
  note(item, described(item.value) + " is not a whole number");
  return std::nullopt;
}

std::optional<double> checked(const Item& item, std::optional<double> value, Dimension dimension,
                              const Limits& limits) {
  if (!value || is_allowed(*value, limits)) return value;
  note(item, described(item.value) + outside(*value, limits, dimension));
  return std::nullopt;
}

std::optional<double> parse_noted(const Item& item, Dimension dimension) {
  try {
    return parse_quantity(item.value.text, dimension);
  } catch (const InputError& error) {
    note(item, error.what());
    return std::nullopt;
  }
}

namespace {

std::string counted(std::size_t count, std::string_view one, std::string_view many) {
  return std::to_string(count) + ' ' + std::string(count == 1 ? one : many);
}

std::optional<double> read_number(const Item& item) {
  if (item.value.kind == TomlValue::Kind::integer) return static_cast<double>(item.value.integer);
  if (std::isfinite(item.value.decimal)) return item.value.decimal;
  note(item, described(item.value) + " is not a finite number");
  return std::nullopt;
}

}  // namespace

std::optional<double> read_quantity(const Item& item, Dimension dimension, const Limits& limits) {
  const bool is_number = item.value.is_number();
  if (dimension == Dimension::number && is_number) {
    return checked(item, read_number(item), dimension, limits);
  }
  if (dimension != Dimension::number && item.value.kind == TomlValue::Kind::text) {
    return checked(item, parse_noted(item, dimension), dimension, limits);
  }
  if (dimension == Dimension::number && item.value.kind == TomlValue::Kind::text) {
    note(item, described(item.value) + " is a text; a number is wanted, for example " +
                   example(limits, dimension));
  } else {
    const bool lacks_unit = is_number && std::isfinite(item.value.decimal);
    note(item,
         described(item.value) +
             (lacks_unit ? " has no unit" : " is not " + std::string(dimension_name(dimension))) +
             "; write for example " +
             (lacks_unit ? toml_string(quantity_example(dimension, described(item.value)))
                         : example(limits, dimension)));
  }
  return std::nullopt;
}

std::optional<std::string> read_text(const Item& item) {
  if (item.value.kind != TomlValue::Kind::text) {
    note(item, described(item.value) + " is not a text; write it in quotes");
    return std::nullopt;
  }
  if (has_control_characters(item.value.text)) {
    note(item, in_quotes(item.value.text) + " has a control character; leave it out");
    return std::nullopt;
  }
  return item.value.text;
}

std::optional<std::size_t> read_choice(const Item& item, const std::vector<std::string>& names) {
  const std::optional<std::string> text = read_text(item);
  if (!text) return std::nullopt;
  const auto name = std::find(names.begin(), names.end(), *text);
  if (name != names.end()) return static_cast<std::size_t>(name - names.begin());
  note(item, toml_string(*text) + " is not one of " + joined(names) + suggestion(*text, names));
  return std::nullopt;
}

std::optional<MaterialId> read_material(const Item& item, const Materials& materials) {
  const std::optional<std::string> name = read_text(item);
  if (!name) return std::nullopt;
  try {
    return materials.id(*name);
  } catch (const InputError& error) {
    note(item, error.what());
    return std::nullopt;
  }
}

std::vector<Item> read_list(const Item& item, ListSize size) {
  if (!item.value.is_list()) {
    note(item, described(item.value) + " is not a list; write it in brackets, [...]");
    return {};
  }
  if (item.value.entries.size() < size.minimum || item.value.entries.size() > size.maximum) {
    std::string wanted = std::to_string(size.minimum);
    if (size.maximum == ListSize{}.maximum) {
      wanted += " or more";
    } else if (size.maximum != size.minimum) {
      wanted += " to " + std::to_string(size.maximum);
    }
    note(item, "has " + counted(item.value.entries.size(), "entry", "entries") + "; " + wanted +
                   (wanted == "1" ? " is wanted" : " are wanted") + std::string(size.why));
    return {};
  }
  std::vector<Item> entries;
  for (const TomlValue& entry : item.value.entries) {
    entries.push_back({item.errors, entry, indexed(item.path, entries.size())});
  }
  return entries;
}

std::vector<std::array<double, 2>> read_polygon(const Item& item) {
  return read_points(item, {.minimum = 3});
}

std::vector<std::array<double, 2>> read_points(const Item& item, ListSize size) {
  constexpr Limits limits{.minimum = -longest_length, .maximum = longest_length};
  std::vector<std::array<double, 2>> points;
  for (const Item& point : read_list(item, size)) {
    const std::vector<Item> coordinates = read_list(point, {2, 2});
    if (coordinates.empty()) continue;
    points.push_back({read_quantity(coordinates[0], Dimension::length, limits).value_or(0),
                      read_quantity(coordinates[1], Dimension::length, limits).value_or(0)});
  }
  return points;
}

namespace {

constexpr std::size_t most_rows = 100'000;

/// A row that stands in the recipe.
std::optional<std::vector<double>> read_row(const Item& item, std::span<const Column> columns) {
  const std::vector<Item> entries = read_list(item, {columns.size(), columns.size()});
  std::vector<double> row;
  for (std::size_t c = 0; c < entries.size(); ++c) {
    const auto value = read_quantity(entries[c], columns[c].dimension, columns[c].limits);
    if (value) row.push_back(*value);
  }
  if (row.size() < columns.size()) return std::nullopt;
  return row;
}

}  // namespace

std::optional<NumberTable> read_rows(const Item& item, std::span<const Column> columns) {
  NumberTable table;
  bool ok = true;
  for (const Item& entry : read_list(item, {.minimum = 2, .maximum = most_rows})) {
    std::optional<std::vector<double>> row = read_row(entry, columns);
    ok = ok && row;
    if (ok) table.values.push_back(std::move(*row));
  }
  if (!ok || table.values.empty()) return std::nullopt;
  return table;
}

std::optional<NumberTable> read_csv_noted(const Item& item, std::span<const Column> columns,
                                          const RecipeContent& content) {
  try {
    const std::string& name = item.value.text;
    NumberTable table =
        read_csv((content.folder / name).string(), content_of(content, name), columns);
    if (table.values.size() >= 2 && table.values.size() <= most_rows) return table;
    note(item, table.file + ": has " + counted(table.values.size(), "row", "rows") +
                   " of numbers; 2 to " + std::to_string(most_rows) + " are wanted");
  } catch (const InputError& error) {
    note(item, error.what());
  }
  return std::nullopt;
}

std::string format_rows(const NumberTable& table, std::span<const Column> columns) {
  std::string text;
  for (const std::vector<double>& row : table.values) {
    text += text.empty() ? "[" : ", [";
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const Dimension dimension = columns[c].dimension;
      const std::string value = format_quantity(row[c], dimension);
      text += (c > 0 ? ", " : "") + (dimension == Dimension::number ? value : toml_string(value));
    }
    text += ']';
  }
  return '[' + text + ']';
}

std::string sort_text(std::span<const Column> columns) {
  std::string text;
  for (const Column& column : columns.first(columns.size() - 1)) {
    text.append(text.empty() ? "" : ", then by ").append(column.name);
  }
  return text;
}

}  // namespace scarp::detail

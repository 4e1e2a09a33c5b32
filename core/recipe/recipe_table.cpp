#include "core/recipe/recipe_table.h"

#include <algorithm>

#include "core/error.h"
#include "core/recipe/recipe_node.h"
#include "core/recipe/recipe_path.h"
#include "core/recipe/recipe_value.h"
#include "core/recipe/toml.h"
#include "core/suggestion.h"
#include "core/system/hash.h"
#include "core/toml_text.h"

namespace scarp {

namespace {

using namespace detail;

/// A path as headers of TOML have it: "step.beam" for "step[0].beam".
std::string without_indices(const std::string& path) {
  std::string text;
  bool inside = false;
  for (const char c : path) {
    if (c == '[') inside = true;
    if (!inside) text += c;
    if (c == ']') inside = false;
  }
  return text;
}

std::optional<Item> find(RecipeNode& node, std::string_view key) {
  if (std::find(node.asked.begin(), node.asked.end(), key) == node.asked.end()) {
    node.asked.emplace_back(key);
  }
  const TomlValue* const value = node.toml == nullptr ? nullptr : node.toml->find(key);
  if (value == nullptr) return std::nullopt;
  return Item{node.content->errors, *value, inner_path(node, key)};
}

void note_missing(const RecipeNode& node, std::string_view key, const std::string& text) {
  if (!node.missing_is_noted) return;
  node.content->errors.add(
      {inner_path(node, key), node.place, "missing; " + text, {inner_path(node, key)}});
}

/// A fallback as TOML.
std::string format_fallback(std::string_view fallback, Dimension dimension) {
  return dimension == Dimension::number ? std::string(fallback) : toml_string(fallback);
}

/// The rows of a table of the recipe, and those of the fallback that it leaves open.
TomlValue merged(const TomlValue* given, const std::optional<TomlValue>& fallback) {
  TomlValue rows;
  if (fallback && (given == nullptr || given->find("default") == nullptr)) {
    for (const TomlValue& row : fallback->entries)
      if (given == nullptr || given->find(row.key) == nullptr) rows.entries.push_back(row);
  }
  if (given != nullptr)
    rows.entries.insert(rows.entries.end(), given->entries.begin(), given->entries.end());
  return rows;
}

/// A list of lists of points rather than of points.
bool holds_polygons(const TomlValue& value) {
  const auto first_is_list = [](const TomlValue& list) {
    return list.is_list() && !list.entries.empty() && list.entries[0].is_list();
  };
  return first_is_list(value) && first_is_list(value.entries[0]);
}

/// The table that an item is; an empty one for an item that is not there or is no table.
RecipeNode& make_node(const RecipeNode& parent, RecipeRecord& record, std::string path,
                      const std::optional<Item>& item) {
  RecipeNode& node = parent.content->nodes.emplace_back();
  node.content = parent.content;
  node.record = &record;
  node.path = std::move(path);
  node.place = item ? item->value.place : parent.place;
  node.missing_is_noted = parent.missing_is_noted;
  if (item && item->value.is_table()) {
    node.toml = &item->value;
  } else if (item) {
    node.missing_is_noted = false;
    note(*item, described(item->value) + " is not a table");
  }
  return node;
}

/// The value at a path from a table on, if there is one.
const TomlValue* value_at(const TomlValue* value, const RecipePath& path) {
  for (const auto& part : path) {
    if (value == nullptr) return nullptr;
    if (const auto* key = std::get_if<std::string>(&part)) {
      value = value->find(*key);
    } else {
      const std::size_t index = std::get<std::size_t>(part);
      value = value->is_list() && index < value->entries.size() ? &value->entries[index] : nullptr;
    }
  }
  return value;
}

/// Nothing for what is no table.
std::vector<std::string> keys_of(const TomlValue* table) {
  std::vector<std::string> keys;
  if (table == nullptr || !table->is_table()) return keys;
  keys.reserve(table->entries.size());
  for (const TomlValue& entry : table->entries) keys.push_back(entry.key);
  return keys;
}

/// A message about a key, or about the whole table.
RecipeErrors::Entry entry_at(const RecipeNode& node, std::string_view key, std::string_view text) {
  const TomlValue* const value =
      key.empty() ? nullptr : value_at(node.toml, parse_recipe_path(key));
  return {inner_path(node, key), value != nullptr ? value->place : node.place, std::string(text)};
}

}  // namespace

double RecipeTable::quantity(std::string_view key, Dimension dimension,
                             const Limits& limits) const {
  const auto item = find(*node_, key);
  if (item) {
    const auto value = read_quantity(*item, dimension, limits);
    if (value) node_->record->set(key, format_toml(item->value));
    return value ? *value : stand_in(limits, dimension);
  }
  if (limits.fallback.empty()) {
    note_missing(*node_, key,
                 "write for example " + std::string(key) + " = " + example(limits, dimension));
  } else {
    node_->record->set(key, format_fallback(limits.fallback, dimension));
  }
  return stand_in(limits, dimension);
}

double RecipeTable::length(std::string_view key, const Limits& limits) const {
  return quantity(key, Dimension::length, limits);
}
double RecipeTable::time(std::string_view key, const Limits& limits) const {
  return quantity(key, Dimension::time, limits);
}
double RecipeTable::energy(std::string_view key, const Limits& limits) const {
  return quantity(key, Dimension::energy, limits);
}
double RecipeTable::angle(std::string_view key, const Limits& limits) const {
  return quantity(key, Dimension::angle, limits);
}
double RecipeTable::rate(std::string_view key, const Limits& limits) const {
  return quantity(key, Dimension::rate, limits);
}
double RecipeTable::number(std::string_view key, const Limits& limits) const {
  return quantity(key, Dimension::number, limits);
}
double RecipeTable::fraction(std::string_view key, std::string_view fallback) const {
  return quantity(key, Dimension::number, {.fallback = fallback, .minimum = 0, .maximum = 1});
}

std::int64_t RecipeTable::integer(std::string_view key, const Limits& limits) const {
  const auto item = find(*node_, key);
  if (!item) return static_cast<std::int64_t>(quantity(key, Dimension::number, limits));
  const std::optional<std::int64_t> value = read_integer(*item);
  if (value && checked(*item, static_cast<double>(*value), Dimension::number, limits)) {
    node_->record->set(key, std::to_string(*value));
    return *value;
  }
  return static_cast<std::int64_t>(stand_in(limits, Dimension::number));
}

bool RecipeTable::flag(std::string_view key, std::optional<bool> fallback) const {
  const auto item = find(*node_, key);
  bool value = fallback.value_or(false);
  if (item && item->value.kind == TomlValue::Kind::flag) {
    value = item->value.flag;
  } else if (item) {
    note(*item, described(item->value) + " is not true or false");
  } else if (!fallback) {
    note_missing(*node_, key, "write true or false");
  }
  node_->record->set(key, value ? "true" : "false");
  return value;
}

std::optional<bool> RecipeTable::flag_or(std::string_view word, std::string_view key,
                                         bool fallback) const {
  const auto item = find(*node_, key);
  if (item && item->value.kind == TomlValue::Kind::text && item->value.text == word) {
    node_->record->set(key, toml_string(word));
    return std::nullopt;
  }
  bool value = fallback;
  if (item && item->value.kind == TomlValue::Kind::flag) {
    value = item->value.flag;
  } else if (item) {
    note(*item, described(item->value) + " is not true, false or " + toml_string(word));
  }
  node_->record->set(key, value ? "true" : "false");
  return value;
}

std::string RecipeTable::text(std::string_view key,
                              std::optional<std::string_view> fallback) const {
  const auto item = find(*node_, key);
  if (!item && !fallback) {
    note_missing(*node_, key, "write " + std::string(key) + " = \"...\"");
  }
  std::string result =
      (item ? read_text(*item) : std::nullopt).value_or(std::string(fallback.value_or("")));
  node_->record->set(key, toml_string(result));
  return result;
}

double RecipeTable::length_or_multiple(std::string_view key, double unit_length,
                                       const Limits& limits) const {
  const auto item = find(*node_, key);
  if (!item || item->value.kind != TomlValue::Kind::text) {
    return quantity(key, Dimension::number, limits) * unit_length;
  }
  const auto length = parse_noted(*item, Dimension::length);
  if (!length) return stand_in(limits, Dimension::number) * unit_length;
  if (!is_allowed(*length / unit_length, limits)) {
    note(*item, described(item->value) + ", " + format_number(*length / unit_length) + " times " +
                    format_quantity(unit_length, Dimension::length) + "," +
                    outside(*length / unit_length, limits, Dimension::number));
  }
  node_->record->set(key, format_toml(item->value));
  return *length;
}

std::vector<double> RecipeTable::quantities(std::string_view key, Dimension dimension,
                                            ListSize size, const Limits& limits) const {
  const auto item = find(*node_, key);
  std::vector<double> values;
  if (item) {
    for (const Item& entry : read_list(*item, size)) {
      values.push_back(
          read_quantity(entry, dimension, limits).value_or(stand_in(limits, dimension)));
    }
    node_->record->set(key, format_toml(item->value));
  } else if (limits.fallback.empty()) {
    note_missing(*node_, key,
                 "write for example " + std::string(key) + " = [" + example(limits, dimension) +
                     (size.minimum > 1 ? ", " + example(limits, dimension) : "") + ']');
  } else {
    std::string text = format_fallback(limits.fallback, dimension);
    for (std::size_t i = 1; i < size.maximum; ++i)
      text += ", " + format_fallback(limits.fallback, dimension);
    node_->record->set(key, '[' + text + ']');
    values.assign(size.maximum, stand_in(limits, dimension));
  }
  if (values.empty()) values.assign(size.minimum, stand_in(limits, dimension));
  return values;
}

std::vector<std::vector<std::array<double, 2>>> RecipeTable::polygons(std::string_view key) const {
  const auto item = find(*node_, key);
  if (!item) {
    note_missing(*node_, key,
                 "write for example " + std::string(key) +
                     R"( = [["0 um", "0 um"], ["1 um", "0 um"], ["1 um", "1 um"]])");
    return {};
  }
  node_->record->set(key, format_toml(item->value));
  if (!holds_polygons(item->value)) return {read_polygon(*item)};
  std::vector<std::vector<std::array<double, 2>>> all;
  for (const Item& entry : read_list(*item, {})) all.push_back(read_polygon(entry));
  return all;
}

std::array<std::array<double, 2>, 2> RecipeTable::corners(std::string_view key) const {
  const auto item = find(*node_, key);
  if (!item) {
    note_missing(
        *node_, key,
        "write for example " + std::string(key) + R"( = [["0 um", "0 um"], ["1 um", "1 um"]])");
    return {};
  }
  node_->record->set(key, format_toml(item->value));
  const std::vector<std::array<double, 2>> points = read_points(*item, {2, 2});
  if (points.size() != 2) return {};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (points[0][axis] < points[1][axis] || !ok(key)) continue;
    error(key, "the first corner has to lie below and left of the second one");
    break;
  }
  return {points[0], points[1]};
}

std::string RecipeTable::file(std::string_view key) const {
  std::string name = text(key);
  if (name.empty() || node_->content->load_file) return name;
  const std::filesystem::path path =
      std::filesystem::absolute(node_->content->folder / name).lexically_normal();
  node_->record->set(key, toml_string(path.string()));
  return path.string();
}

std::string RecipeTable::content(std::string_view key, const std::string& file) const {
  std::string content = detail::content_of(*node_->content, file);
  node_->record->set(key, toml_string(file) + "  # holds " + hash_of(content));
  return content;
}

std::vector<std::string> RecipeTable::texts(std::string_view key, ListSize size) const {
  const auto item = find(*node_, key);
  if (!item) note_missing(*node_, key, "write " + std::string(key) + " = [\"...\"]");
  std::vector<std::string> values;
  for (const Item& entry : item ? read_list(*item, size) : std::vector<Item>()) {
    values.push_back(read_text(entry).value_or(""));
  }
  if (item) node_->record->set(key, format_toml(item->value));
  if (values.empty()) values.resize(size.minimum);
  return values;
}

std::optional<NumberTable> RecipeTable::number_table(std::string_view key,
                                                     std::span<const Column> columns) const {
  const auto item = find(*node_, key);
  if (!item) return std::nullopt;
  std::optional<NumberTable> table;
  if (item->value.kind == TomlValue::Kind::text) {
    table = read_csv_noted(*item, columns, *node_->content);
    if (table) node_->record->set(key, format_rows(*table, columns));
  } else if (item->value.is_list()) {
    table = read_rows(*item, columns);
    node_->record->set(key, format_toml(item->value));
  } else {
    note(*item, described(item->value) +
                    " is not a table; write its rows, [[...], [...]], or the name of a CSV file");
  }
  if (!table) return std::nullopt;
  for (std::size_t r = 0; r < table->lines.size(); ++r) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const double value = table->values[r][c];
      if (is_allowed(value, columns[c].limits)) continue;
      const Dimension dimension = columns[c].dimension;
      row_error(key, *table, r,
                format_quantity(value, dimension) + outside(value, columns[c].limits, dimension));
      return std::nullopt;
    }
  }
  const auto argument = [](const std::vector<double>& row) {
    return std::span(row).first(row.size() - 1);
  };
  for (std::size_t r = 1; r < table->values.size(); ++r) {
    const auto below = argument(table->values[r - 1]);
    const auto here = argument(table->values[r]);
    if (std::lexicographical_compare(below.begin(), below.end(), here.begin(), here.end()))
      continue;
    row_error(key, *table, r, "rows have to ascend by " + sort_text(columns));
    return std::nullopt;
  }
  return table;
}

void RecipeTable::row_error(std::string_view key, const NumberTable& table, std::size_t row,
                            std::string_view text) const {
  if (table.file.empty()) {
    error(indexed(std::string(key), row), text);
  } else {
    error(key, table.file + ':' + std::to_string(table.lines[row]) + ": " + std::string(text));
  }
}

std::size_t RecipeTable::choice_index(std::string_view key, std::span<const std::string_view> names,
                                      std::string_view fallback) const {
  const std::vector<std::string> all(names.begin(), names.end());
  const auto item = find(*node_, key);
  if (!item && fallback.empty()) note_missing(*node_, key, "one of " + joined(all));
  const auto name = std::find(names.begin(), names.end(), fallback);
  std::size_t index = name == names.end() ? 0 : static_cast<std::size_t>(name - names.begin());
  if (item) index = read_choice(*item, all).value_or(index);
  node_->record->set(key, toml_string(names[index]));
  return index;
}

std::vector<std::size_t> RecipeTable::choice_indices(std::string_view key,
                                                     std::span<const std::string_view> names,
                                                     ListSize size,
                                                     std::string_view fallback) const {
  const std::vector<std::string> all(names.begin(), names.end());
  const auto item = find(*node_, key);
  if (!item && fallback.empty()) note_missing(*node_, key, "a list of " + joined(all));
  std::vector<std::size_t> indices;
  for (const Item& entry : item ? read_list(*item, size) : std::vector<Item>()) {
    indices.push_back(read_choice(entry, all).value_or(0));
  }
  if (indices.empty()) {
    const auto name = std::find(names.begin(), names.end(), fallback);
    const bool found = !item && name != names.end();
    indices.assign(found ? size.maximum : size.minimum,
                   found ? static_cast<std::size_t>(name - names.begin()) : 0);
  }
  std::string text;
  for (const std::size_t index : indices) {
    text += (text.empty() ? "" : ", ") + toml_string(names[index]);
  }
  node_->record->set(key, '[' + text + ']');
  return indices;
}

MaterialId RecipeTable::material(std::string_view key, const Materials& materials,
                                 std::string_view fallback) const {
  const auto item = find(*node_, key);
  if (!item && fallback.empty()) {
    note_missing(*node_, key, "write for example " + std::string(key) + " = \"Si\"");
  }
  std::optional<MaterialId> id = item ? read_material(*item, materials) : std::nullopt;
  if (!id) id = fallback.empty() ? MaterialId{0} : materials.id(fallback);
  node_->record->set(key, toml_string(materials[*id].name));
  return *id;
}

bool RecipeTable::is_word(std::string_view key, std::string_view word) const {
  const auto item = find(*node_, key);
  if (item && !(item->value.kind == TomlValue::Kind::text && item->value.text == word))
    return false;
  node_->record->set(key, toml_string(word));
  return true;
}

std::optional<MaterialId> RecipeTable::material_or(std::string_view word, std::string_view key,
                                                   const Materials& materials) const {
  if (is_word(key, word)) return std::nullopt;
  return material(key, materials);
}

std::vector<MaterialId> RecipeTable::material_list_or(std::string_view word, std::string_view key,
                                                      const Materials& materials) const {
  if (is_word(key, word)) return {};
  return material_list(key, materials);
}

std::vector<MaterialId> RecipeTable::material_list(std::string_view key, const Materials& materials,
                                                   ListSize size, std::string_view fallback) const {
  const auto item = find(*node_, key);
  std::vector<MaterialId> ids;
  if (!item && !fallback.empty()) {
    node_->record->set(key, std::string(fallback));
    const std::optional<TomlValue> list = compound(fallback);
    for (const TomlValue& entry : list->entries) ids.push_back(materials.id(entry.text));
    return ids;
  }
  if (!item) note_missing(*node_, key, "write for example " + std::string(key) + " = [\"Si\"]");
  for (const Item& entry : item ? read_list(*item, size) : std::vector<Item>()) {
    ids.push_back(read_material(entry, materials).value_or(MaterialId{0}));
  }
  if (item) node_->record->set(key, format_toml(item->value));
  return ids;
}

template <class Value, class Read>
std::optional<std::vector<Value>> RecipeTable::by_material(std::string_view key,
                                                           const MaterialScope& scope,
                                                           std::string_view fallback,
                                                           const Read& read) const {
  const auto item = find(*node_, key);
  const std::optional<TomlValue> rows_for_all = compound(fallback);
  if (item ? !item->value.is_table() : !rows_for_all) return std::nullopt;
  std::vector<std::optional<Value>> values(scope.materials.size());
  std::optional<Value> rest;
  std::vector<std::string> names = scope.materials.names();
  names.emplace_back("default");
  const TomlValue rows = merged(item ? &item->value : nullptr, rows_for_all);
  const std::string path = inner_path(*node_, key);
  RecipeErrors& errors = node_->content->errors;
  for (const TomlValue& row : rows.entries) {
    const Item entry{errors, row, path + '.' + row.key};
    const auto known = std::find(names.begin(), names.end(), row.key);
    if (known == names.end()) {
      errors.add({entry.path, row.key_place, "is not a material" + suggestion(row.key, names)});
      continue;
    }
    (row.key == "default" ? rest : values[static_cast<std::size_t>(known - names.begin())]) =
        read(entry);
  }
  node_->record->set(key, format_toml(rows));

  std::vector<std::string> without;
  for (const MaterialId id : scope.reachable) {
    if (!values[id] && !rest) without.push_back(scope.materials[id].name);
  }
  if (!without.empty()) {
    errors.add({path, item ? item->value.place : node_->place,
                "no value for " + joined(without) + ", which this step can reach; add " +
                    (item ? "it, or default = ..."
                          : std::string(key) + " = { " + toml_key(without.front()) + " = ... }")});
  }
  std::vector<Value> result;
  result.reserve(values.size());
  for (const auto& value : values) result.push_back(value.value_or(rest.value_or(Value{})));
  return result;
}

std::vector<double> RecipeTable::per_material(std::string_view key, Dimension dimension,
                                              const MaterialScope& scope,
                                              const Limits& limits) const {
  const auto values = by_material<double>(key, scope, limits.fallback, [&](const Item& entry) {
    return read_quantity(entry, dimension, limits).value_or(stand_in(limits, dimension));
  });
  if (values) return *values;
  return std::vector<double>(scope.materials.size(), quantity(key, dimension, limits));
}

std::vector<std::string> RecipeTable::per_material_text(std::string_view key,
                                                        const MaterialScope& scope) const {
  const auto values = by_material<std::string>(key, scope, {}, [](const Item& entry) {
    const std::optional<std::string> row = read_text(entry);
    if (row && row->empty()) note(entry, "is empty");
    return row.value_or("");
  });
  if (values) return *values;
  const std::string for_all = text(key);
  if (for_all.empty() && ok(key)) error(key, "is empty");
  return std::vector<std::string>(scope.materials.size(), for_all);
}

RecipeTable RecipeTable::table(std::string_view key) const {
  const auto item = find(*node_, key);
  std::vector<RecipeNode*>& known = node_->inner[std::string(key)];
  if (known.empty()) {
    known.push_back(&make_node(*node_, node_->record->table(key), inner_path(*node_, key), item));
  }
  return RecipeTable(*known.front());
}

std::vector<RecipeTable> RecipeTable::tables(std::string_view key) const {
  const auto item = find(*node_, key);
  std::vector<RecipeNode*>& known = node_->inner[std::string(key)];
  const auto append = [&](const TomlValue& value) {
    const std::string path = indexed(item->path, known.size());
    known.push_back(
        &make_node(*node_, node_->record->append(key), path, Item{item->errors, value, path}));
  };
  if (item && known.empty()) {
    if (item->value.is_list()) {
      for (const TomlValue& value : item->value.entries) append(value);
    } else {
      note(*item, (item->value.is_table() ? "is one table; write [["
                                          : described(item->value) + " is not a table; write [[") +
                      without_indices(item->path) + "]]");
      if (item->value.is_table()) append(item->value);
    }
  }
  std::vector<RecipeTable> tables;
  tables.reserve(known.size());
  for (RecipeNode* const node : known) tables.push_back(RecipeTable(*node));
  return tables;
}

std::vector<RecipeTable> RecipeTable::tables_or_one(std::string_view key) const {
  std::vector<RecipeTable> entries = tables(key);
  if (!entries.empty() || find(*node_, key)) return entries;
  std::vector<RecipeNode*>& known = node_->inner[std::string(key)];
  known.push_back(&make_node(*node_, node_->record->append(key),
                             indexed(inner_path(*node_, key), 0), std::nullopt));
  return {RecipeTable(*known.front())};
}

bool RecipeTable::has(std::string_view key) const { return find(*node_, key).has_value(); }

std::vector<std::string> RecipeTable::keys() const { return keys_of(node_->toml); }

std::vector<std::string> RecipeTable::rows(std::string_view key) const {
  return keys_of(node_->toml == nullptr ? nullptr : node_->toml->find(key));
}

void RecipeTable::missing(std::span<const std::string_view> keys, std::string_view text) const {
  if (!node_->missing_is_noted) return;
  std::vector<std::string> paths;
  for (const std::string_view key : keys) {
    find(*node_, key);
    paths.push_back(inner_path(*node_, key));
  }
  node_->content->errors.add({node_->path, node_->place, std::string(text), paths});
}

void RecipeTable::error(std::string_view key, std::string_view text) const {
  // Of what is no table, that is all there is to say.
  if (!node_->missing_is_noted) return;
  node_->content->errors.add(entry_at(*node_, key, text));
}

void RecipeTable::warning(std::string_view key, std::string_view text) const {
  node_->content->warnings.add(entry_at(*node_, key, text));
}

bool RecipeTable::ok(std::string_view key) const {
  return node_->missing_is_noted && node_->content->errors.ok(inner_path(*node_, key));
}

void RecipeTable::accept_rest() const { node_->rest_accepted = true; }

const std::string& RecipeTable::path() const { return node_->path; }

}  // namespace scarp

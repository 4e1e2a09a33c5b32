#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace scarp {

/// Where something stands: in the file, or, when source is not empty, on the command line.
struct TomlPlace {
  std::uint32_t line = 1;
  std::uint32_t column = 1;
  std::string source{};
};

/// A value of a TOML document.
struct TomlValue {
  enum class Kind { text, integer, decimal, flag, list, table, date };

  Kind kind = Kind::table;
  TomlPlace place;
  std::string key{};  ///< of an entry of a table
  TomlPlace key_place{};
  std::string text{};
  std::int64_t integer = 0;
  double decimal = 0;
  bool flag = false;
  std::vector<TomlValue> entries{};  ///< of a list or a table, in the order of the file

  bool is_number() const { return kind == Kind::integer || kind == Kind::decimal; }
  bool is_table() const { return kind == Kind::table; }
  bool is_list() const { return kind == Kind::list; }
  /// The value of a key; null if there is none, or this is no table.
  const TomlValue* find(std::string_view key) const;
  TomlValue* find(std::string_view key);
};

/// Keys of a path, and brackets within brackets, of a document that is read.
constexpr int max_toml_depth = 32;

/// Throws: InputError with name:line:column if the text is not TOML, or is nested deeper than
///         max_toml_depth.
TomlValue parse_toml(std::string_view text, const std::string& name);

/// One value in the words of a message: as TOML, or "a table".
std::string described(const TomlValue& value);

/// The value as TOML on one line, to the last bit.
std::string format_toml(const TomlValue& value);

}  // namespace scarp

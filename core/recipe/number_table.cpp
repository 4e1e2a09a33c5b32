#include "core/recipe/number_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/csv.h"
#include "core/trimmed.h"

namespace scarp {

namespace {

// The unit that the first line has for a column, empty if none; nothing if it is another column.
std::optional<std::string> unit_in_head(std::string_view cell, const Column& column) {
  const std::size_t bracket = std::min(cell.find('['), cell.size());
  if (trimmed(cell.substr(0, bracket)) != column.name) return std::nullopt;
  const bool is_number = column.dimension == Dimension::number;
  if (bracket == cell.size() || is_number) return "";
  if (!cell.ends_with(']')) return std::nullopt;
  return std::string(trimmed(cell.substr(bracket + 1, cell.size() - bracket - 2)));
}

std::vector<std::string> units_in_head(const CsvLine& head, std::span<const Column> columns) {
  std::vector<std::string> units;
  for (std::size_t c = 0; c < std::min(head.cells.size(), columns.size()); ++c) {
    const auto unit = unit_in_head(head.cells[c], columns[c]);
    if (unit) units.push_back(*unit);
  }
  if (units.size() < columns.size() || head.cells.size() > columns.size()) {
    std::string found;
    for (const std::string& cell : head.cells) found.append(found.empty() ? "" : ",").append(cell);
    if (!found.empty()) found = fmt::format("; it is \"{}\"", repeated(found));
    throw InputError(fmt::format("has to name the columns: \"{}\"{}", csv_head(columns), found));
  }
  for (std::size_t c = 0; c < columns.size(); ++c) {
    if (units[c].empty() && columns[c].dimension != Dimension::number) {
      throw InputError(fmt::format(
          "gives no unit for {}; write \"{}\", with the units that the numbers below have",
          columns[c].name, csv_head(columns)));
    }
    parse_quantity("1 " + units[c], columns[c].dimension);
  }
  return units;
}

std::vector<double> row_of(const CsvLine& line, std::span<const Column> columns,
                           std::span<const std::string> units) {
  if (line.cells.size() != columns.size()) {
    throw InputError("has " + std::to_string(line.cells.size()) + " columns; " +
                     std::to_string(columns.size()) + " are wanted");
  }
  std::vector<double> row;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const std::string unit = units[c].empty() ? "" : ' ' + units[c];
    row.push_back(parse_quantity(line.cells[c] + unit, columns[c].dimension));
  }
  return row;
}

}  // namespace

std::string csv_head(std::span<const Column> columns) {
  std::string head;
  for (const Column& column : columns) {
    const bool is_angle = column.dimension == Dimension::angle;
    const std::string_view unit = is_angle ? "deg" : inside_unit(column.dimension);
    head.append(head.empty() ? "" : ",").append(column.name);
    if (!unit.empty()) head.append(" [").append(unit).append("]");
  }
  return head;
}

std::vector<double> NumberTable::column(std::size_t index) const {
  std::vector<double> numbers;
  numbers.reserve(values.size());
  for (const std::vector<double>& row : values) numbers.push_back(row[index]);
  return numbers;
}

NumberTable read_csv(const std::filesystem::path& file, std::string_view content,
                     std::span<const Column> columns) {
  NumberTable table{.values = {}, .file = shown(file)};
  std::vector<CsvLine> lines = parse_csv(content);
  if (lines.empty()) lines.push_back({.number = 1, .cells = {}});
  std::vector<std::string> units;
  for (const CsvLine& line : lines) {
    try {
      if (units.empty()) {
        units = units_in_head(line, columns);
        continue;
      }
      table.values.push_back(row_of(line, columns, units));
      table.lines.push_back(line.number);
    } catch (const InputError& error) {
      throw InputError(table.file + ':' + std::to_string(line.number) + ": " + error.what());
    }
  }
  return table;
}

}  // namespace scarp

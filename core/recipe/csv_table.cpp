#include "core/recipe/csv_table.h"

#include <algorithm>
#include <cstdlib>

#include "core/system/read_file.h"

namespace scarp {

CsvTable::CsvTable(const std::filesystem::path& file) : rows_(parse_csv(read_file(file))) {
  if (rows_.empty()) return;
  columns_ = rows_.front().cells;
  rows_.erase(rows_.begin());
}

std::string CsvTable::text(std::size_t row, std::string_view column) const {
  const auto found = std::ranges::find(columns_, column);
  const auto n = static_cast<std::size_t>(found - columns_.begin());
  return found != columns_.end() && n < rows_[row].cells.size() ? rows_[row].cells[n] : "";
}

std::optional<double> CsvTable::number(std::size_t row, std::string_view column) const {
  const std::string cell = text(row, column);
  char* end = nullptr;
  const double value = std::strtod(cell.c_str(), &end);
  if (cell.empty() || end != cell.c_str() + cell.size()) return std::nullopt;
  return value;
}

}  // namespace scarp

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/recipe/csv.h"

namespace scarp {

/// A CSV file whose first line names its columns.
class CsvTable {
 public:
  /// Throws: InputError if the file cannot be read. A file of one line has no rows.
  explicit CsvTable(const std::filesystem::path& file);

  const std::vector<std::string>& columns() const { return columns_; }
  std::size_t row_count() const { return rows_.size(); }

  /// Empty where a row ends early or there is no such column.
  std::string text(std::size_t row, std::string_view column) const;

  /// Nothing where there is no number.
  std::optional<double> number(std::size_t row, std::string_view column) const;

 private:
  std::vector<std::string> columns_;
  std::vector<CsvLine> rows_;
};

}  // namespace scarp

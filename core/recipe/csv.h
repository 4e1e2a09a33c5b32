#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace scarp {

/// A line of a CSV file that holds something.
struct CsvLine {
  std::size_t number = 0;  ///< in the file, from 1
  std::vector<std::string> cells;
};

/// The cells between commas, without blanks around them. Empty lines, those that begin with # and a
/// byte order mark are left out. A cell in quotes may hold commas, and quotes that are written
/// twice.
std::vector<CsvLine> parse_csv(std::string_view text);

/// A name as a cell: in quotes where it holds a comma or a quote. A row stays one line.
std::string csv_field(std::string text);

}  // namespace scarp

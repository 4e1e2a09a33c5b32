#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/limits.h"
#include "core/recipe/quantity.h"

namespace scarp {

/// A column of a table of numbers. A CSV file names it with its unit, as in `energy [eV]`.
struct Column {
  std::string_view name;
  Dimension dimension = Dimension::number;
  Limits limits{};
};

/// The first line of a CSV file that has these columns: "energy [eV],density".
std::string csv_head(std::span<const Column> columns);

/// The rows of a table of numbers in their order, and where they stand.
///
/// Shape: values has one entry per row, of one number per column. Units: those of the inside.
struct NumberTable {
  std::vector<std::vector<double>> values;
  std::string file{};                ///< empty: the rows stand in a recipe
  std::vector<std::size_t> lines{};  ///< of the file, one per row

  std::vector<double> column(std::size_t index) const;
};

/// Reads CSV whose first line is csv_head(); columns of quantities may have other units of
/// their kind, those of numbers may say in brackets what they are of.
///
/// file is its name in messages. Throws: InputError with file:line. Limits are not looked at.
NumberTable read_csv(const std::filesystem::path& file, std::string_view content,
                     std::span<const Column> columns);

}  // namespace scarp

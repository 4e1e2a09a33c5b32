#pragma once

#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "core/system/read_file.h"

namespace scarp {

/// The columns of a table without quoted cells, by their names.
inline std::map<std::string, std::vector<std::string>> columns_of(
    const std::filesystem::path& file) {
  std::istringstream in(read_file(file));
  std::vector<std::string> names;
  std::map<std::string, std::vector<std::string>> columns;
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line);
    std::size_t column = 0;
    const bool is_head = names.empty();
    for (std::string cell; std::getline(cells, cell, ','); ++column) {
      if (is_head) {
        names.push_back(cell);
      } else {
        columns[names.at(column)].push_back(cell);
      }
    }
  }
  return columns;
}

}  // namespace scarp

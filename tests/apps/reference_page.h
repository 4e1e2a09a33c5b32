#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "core/system/read_file.h"

namespace scarp {

/// Key to value, by table.
using Keys = std::map<std::string, std::map<std::string, std::string>>;

inline std::set<std::string> keys_of(const std::map<std::string, std::string>& table) {
  std::set<std::string> keys;
  for (const auto& [key, value] : table) keys.insert(key);
  return keys;
}

/// The cells of a row of a table: "| a | b |".
inline std::vector<std::string> cells_of(const std::string& row) {
  std::vector<std::string> cells;
  const std::string between = " | ";
  std::size_t begin = 2;
  for (std::size_t end = row.find(between, begin); end != std::string::npos;
       end = row.find(between, begin)) {
    cells.push_back(row.substr(begin, end - begin));
    begin = end + between.size();
  }
  if (begin + 2 < row.size()) cells.push_back(row.substr(begin, row.size() - begin - 2));
  return cells;
}

/// The rows of the tables of a page in docs, each with one of its columns, by heading:
/// "[simplify]", "hole". A key is the first column, without its quotes.
inline Keys reference_page(const std::string& name, std::size_t column = 1) {
  Keys sections;
  std::vector<std::string> headings;
  std::istringstream in(read_file(std::filesystem::path(SCARP_SOURCE_DIR) / "docs" / name));
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("##", 0) == 0) {
      headings.clear();
      std::istringstream names(line.substr(line.find(' ') + 1));
      for (std::string each; std::getline(names >> std::ws, each, ',');) headings.push_back(each);
    }
    if (line.rfind("| `", 0) != 0) continue;
    const std::vector<std::string> cells = cells_of(line);
    const std::string key = cells.front().substr(1, cells.front().find('`', 1) - 1);
    for (const std::string& heading : headings) sections[heading][key] += cells.at(column) + ' ';
  }
  return sections;
}

}  // namespace scarp

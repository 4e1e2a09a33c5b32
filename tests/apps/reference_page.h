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

/// The rows of the tables of a page in docs, each with its last column, by heading: "[simplify]",
/// "hole".
inline Keys reference_page(const std::string& name) {
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
    const std::string key = line.substr(3, line.find('`', 3) - 3);
    const std::size_t last = line.rfind(" | ", line.size() - 3);
    for (const std::string& heading : headings) {
      std::string& text = sections[heading][key];
      text += line.substr(last + 3, line.size() - last - 5) + ' ';
    }
  }
  return sections;
}

}  // namespace scarp

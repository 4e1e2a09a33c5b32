#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "apps/report/comparison.h"

namespace scarp {

// Comparisons as text: docs/compare.md has the keys.

/// The members of compare.json for one comparison.
nlohmann::ordered_json comparison_json(const Comparison& comparison);

/// The verdict with what moved, and what it cost, as lines.
std::string comparison_text(const Comparison& comparison);

/// Where a page comes from.
struct PageOrigin {
  std::string title;
  std::string recipe;  ///< as TOML; empty where there is none
};

/// A comparison on a page.
struct PageEntry {
  const Comparison& comparison;
  std::string scene{};  ///< an element that shows it in space; may be empty
};

/// report.html: verdicts, surfaces side by side, profiles over each other, flux, tables.
std::string comparison_page(std::span<const PageEntry> entries, const PageOrigin& origin);

}  // namespace scarp

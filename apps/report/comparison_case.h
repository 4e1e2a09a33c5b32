#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/report/comparison.h"

namespace scarp {

/// What is compared with what, as compare.json keeps it: scarp report does it again.
struct ComparisonCase {
  std::string first;                                ///< names of the groups
  std::string second;                               ///< empty with a contour
  std::vector<std::filesystem::path> first_runs{};  ///< folders of runs, or states
  std::vector<std::filesystem::path> second_runs{};
  std::filesystem::path contour{};  ///< in place of the second runs
  std::string line{};               ///< where the contour was measured, as for parse_section
  Tolerances tolerances{};
};

/// Throws: as compare and compare_with_contour.
Comparison compare(const ComparisonCase& wanted);

/// Paths are relative to the folder of the file.
nlohmann::ordered_json case_json(const ComparisonCase& wanted, const std::filesystem::path& folder);

/// The inverse of case_json.
///
/// Throws: nlohmann::json::exception if it is none.
ComparisonCase read_case(const nlohmann::ordered_json& json, const std::filesystem::path& folder);

/// The page of comparisons, with the surfaces of their first runs side by side and the distance of
/// each facet's middle to the other surface; with the recipe of the first run.
///
/// Shape: a comparison for each case.
std::string comparison_page(std::span<const ComparisonCase> cases,
                            std::span<const Comparison> comparisons, const std::string& title);

}  // namespace scarp

#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace scarp::bench {

/// Which grids the stated errors of lowest points and micro-trenches are tried on.
///
/// Units: spacings across the opening.
struct FootErrorSettings {
  std::vector<std::string> processes{};  ///< names; all without any
  std::vector<double> across{6, 10, 20, 40};
  /// Two grids, the coarser one first, by whose values those of no spacing are extrapolated.
  std::vector<double> reference{40, 80};
  std::vector<double> places{0, 0.25, 0.5};  ///< of the middle of a trench between two nodes
};

/// Their names.
std::vector<std::string> foot_error_processes();

/// Errors of lowest points and micro-trenches against extrapolated values, beside what metrology
/// states: of trenches and holes, under ions of several lobes and yields, alone and with neutrals.
///
/// Shape: `rows`, one per process, opening and spacing; `runs`, of which those are; `within`, the
///        part of all runs whose errors are not larger than stated.
nlohmann::ordered_json foot_errors(const FootErrorSettings& settings);

void print_foot_errors(const nlohmann::ordered_json& found);

}  // namespace scarp::bench

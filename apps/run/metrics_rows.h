#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace scarp {

/// The rows of metrics.csv that are whole and in order, a line each without its end.
///
/// Shape: lines[n] is of time step begin + n; a file that was lost has begun anew with a later time
///        step than the first one of its run.
struct MetricsRows {
  std::vector<std::string> lines{};
  std::uint32_t begin = 0;

  std::uint32_t end() const { return begin + static_cast<std::uint32_t>(lines.size()); }
  std::span<const std::string> before(std::uint32_t time_step) const;
};

/// Reads metrics.csv up to the first row that does not end with the number of its time step.
///
/// first is the first time step of the run, head the first line of the file with its end.
/// Throws: InputError if the file cannot be read or has another head.
MetricsRows read_metrics_rows(const std::filesystem::path& file, const std::string& head,
                              std::uint32_t first);

/// The lines of a text that have an end, of Windows too: one without it was being written when the
/// process died.
std::vector<std::string> whole_lines(const std::string& text);

}  // namespace scarp

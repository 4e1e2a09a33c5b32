#include "apps/run/metrics_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "core/error.h"
#include "core/printable.h"
#include "core/system/read_file.h"

namespace scarp {

std::span<const std::string> MetricsRows::before(std::uint32_t time_step) const {
  const std::size_t count = time_step > begin ? time_step - begin : 0;
  return std::span(lines).first(std::min(count, lines.size()));
}

MetricsRows read_metrics_rows(const std::filesystem::path& file, const std::string& head,
                              std::uint32_t first) {
  MetricsRows rows{.begin = first};
  std::vector<std::string> lines = whole_lines(read_file(file));
  if (lines.empty() || lines.front() + '\n' != head) {
    throw InputError(fmt::format(
        "{}: its first line is not that of this run: the file is damaged, or of another version of "
        "scarp; move it away, and the run continues without its rows",
        shown(file)));
  }
  lines.erase(lines.begin());
  if (!lines.empty()) {
    const std::size_t last_cell = lines.front().rfind(',') + 1;
    const auto number = static_cast<std::uint32_t>(std::atoll(lines.front().c_str() + last_cell));
    rows.begin = std::max(rows.begin, number);
  }
  for (std::string& line : lines) {
    if (!line.ends_with(fmt::format(",{}", rows.end()))) break;
    rows.lines.push_back(std::move(line));
  }
  return rows;
}

std::vector<std::string> whole_lines(const std::string& text) {
  std::vector<std::string> lines;
  std::size_t start = 0;
  for (std::size_t end = 0; (end = text.find('\n', start)) != std::string::npos; start = end + 1) {
    lines.push_back(text.substr(start, end - start));
    if (lines.back().ends_with('\r')) lines.back().pop_back();
  }
  return lines;
}

}  // namespace scarp

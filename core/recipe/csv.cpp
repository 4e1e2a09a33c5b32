#include "core/recipe/csv.h"

#include <algorithm>

#include "core/trimmed.h"

namespace scarp {

namespace {

// Calls visit with each line of a text.
template <class Visit>
void for_each_line(std::string_view text, const Visit& visit) {
  for (;;) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    visit(text.substr(0, end));
    if (end == text.size()) return;
    text.remove_prefix(end + 1);
  }
}

// The cells of a line: commas between quotes do not end one.
std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells;
  std::string cell;
  bool is_quoted = false;   // now
  bool was_quoted = false;  // blanks between quotes belong to the cell
  const auto finish = [&] {
    cells.emplace_back(was_quoted ? std::string_view(cell) : trimmed(cell));
    cell.clear();
    was_quoted = false;
  };
  for (std::size_t n = 0; n < line.size(); ++n) {
    const char c = line[n];
    if (c == '"' && is_quoted && n + 1 < line.size() && line[n + 1] == '"') {
      cell += line[++n];
    } else if (c == '"' && (is_quoted || trimmed(cell).empty())) {
      if (!is_quoted) cell.clear();
      is_quoted = !is_quoted;
      was_quoted = true;
    } else if (c == ',' && !is_quoted) {
      finish();
    } else if (!was_quoted || is_quoted || c != ' ') {
      cell += c;
    }
  }
  finish();
  return cells;
}

}  // namespace

std::vector<CsvLine> parse_csv(std::string_view text) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  std::vector<CsvLine> lines;
  std::size_t number = 0;
  for_each_line(text, [&](std::string_view line) {
    ++number;
    const std::string_view body = trimmed(line);
    if (body.empty() || body.starts_with('#')) return;
    lines.push_back({.number = number, .cells = cells_of(body)});
  });
  return lines;
}

std::string csv_field(std::string text) {
  for (char& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c;
    if (c == '"') quoted += '"';
  }
  return quoted + '"';
}

}  // namespace scarp

#include "core/csv.h"

#include <algorithm>

#include "core/trimmed.h"

namespace scarp {

namespace {

// Calls visit with each part of a text between separators.
template <class Visit>
void split(std::string_view text, char separator, const Visit& visit) {
  for (;;) {
    const std::size_t end = std::min(text.find(separator), text.size());
    visit(text.substr(0, end));
    if (end == text.size()) return;
    text.remove_prefix(end + 1);
  }
}

}  // namespace

std::vector<CsvLine> parse_csv(std::string_view text) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  std::vector<CsvLine> lines;
  std::size_t number = 0;
  split(text, '\n', [&](std::string_view line) {
    ++number;
    const std::string_view body = trimmed(line);
    if (body.empty() || body.starts_with('#')) return;
    CsvLine& parsed = lines.emplace_back(CsvLine{.number = number, .cells = {}});
    split(body, ',', [&](std::string_view cell) { parsed.cells.emplace_back(trimmed(cell)); });
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

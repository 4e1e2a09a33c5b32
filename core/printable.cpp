#include "core/printable.h"

#include <fmt/format.h>

namespace scarp {

namespace {

/// How many bytes at the start of a text are a control character: two for C1 in UTF-8.
std::size_t control_length(std::string_view text) {
  const auto byte = [&](std::size_t n) { return static_cast<unsigned char>(text[n]); };
  if (byte(0) < 0x20 || byte(0) == 0x7f) return 1;
  return text.size() > 1 && byte(0) == 0xc2 && byte(1) >= 0x80 && byte(1) < 0xa0 ? 2 : 0;
}

bool is_layout(char c) { return c == '\n' || c == '\t'; }

void append_escaped(std::string_view control, std::string& out) {
  out += fmt::format("\\x{:02x}", static_cast<unsigned char>(control.back()));
}

/// On one line, up to a number of characters.
std::string first_characters(std::string_view text, std::size_t most) {
  std::string result;
  std::size_t count = 0;
  while (!text.empty()) {
    const bool begins = (static_cast<unsigned char>(text[0]) & 0xc0) != 0x80;
    if (begins && count++ == most) return result + "...";
    const std::size_t length = control_length(text);
    if (is_layout(text[0])) {
      result += text[0] == '\n' ? "\\n" : "\\t";
    } else if (length > 0) {
      append_escaped(text.substr(0, length), result);
    } else {
      result += text[0];
    }
    text.remove_prefix(length > 0 ? length : 1);
  }
  return result;
}

}  // namespace

bool has_control_characters(std::string_view text) {
  for (std::size_t n = 0; n < text.size(); ++n)
    if (control_length(text.substr(n)) > 0 && !is_layout(text[n])) return true;
  return false;
}

std::string printable(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t length = control_length(text);
    if (length == 0 || is_layout(text[0])) {
      result += text[0];
      text.remove_prefix(1);
    } else {
      append_escaped(text.substr(0, length), result);
      text.remove_prefix(length);
    }
  }
  return result;
}

std::string repeated(std::string_view text) { return first_characters(text, 100); }

std::string one_line(std::string_view text) { return first_characters(text, std::string::npos); }

std::string shown(const std::filesystem::path& path) { return one_line(path.native()); }

}  // namespace scarp

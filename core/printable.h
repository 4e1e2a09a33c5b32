#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace scarp {

/// Whether a text has control characters (C0, DEL, C1 in UTF-8) besides ends of lines and tabs.
bool has_control_characters(std::string_view text);

/// A text for a terminal: control characters as "\x1b", but for ends of lines and tabs.
std::string printable(std::string_view text);

/// What a message repeats, on one line: ends of lines and tabs as "\n" and "\t" as well, and after
/// 100 characters "...".
std::string repeated(std::string_view text);

/// A text on one line, like that, but whole.
std::string one_line(std::string_view text);

/// A path as messages show it: whole, on one line.
std::string shown(const std::filesystem::path& path);

}  // namespace scarp

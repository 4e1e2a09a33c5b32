#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace scarp {

/// The page that a command leaves in the folder of its results.
inline constexpr const char* report_file = "report.html";

/// The names in a folder that are chosen, in their order.
std::vector<std::filesystem::path> find_files(const std::filesystem::path& folder,
                                              bool (*chosen)(const std::string& name));

/// Whether a file of text is there and begins so: the mark by which a command knows its folder.
bool begins_with(const std::filesystem::path& file, const std::string& text);

/// Throws: InputError where a name that is chosen stands for no file: a folder, a pipe.
void require_files(const std::filesystem::path& folder, bool (*chosen)(const std::string& name));

/// Lets a command replace only what one of its kind has written: where its mark is missing, none of
/// its files may be there, and what is there must be files. writer is "a run", for the message.
///
/// Throws: InputError with the first of them.
void require_own(const std::filesystem::path& folder, const std::string& writer, bool has_mark,
                 bool (*is_output)(const std::string& name));

}  // namespace scarp

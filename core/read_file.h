#pragma once

#include <filesystem>
#include <string>

namespace scarp {

/// The whole content of a file or a pipe.
///
/// Throws: InputError with the name of the file and the reason if it cannot be opened or read to
///         its end, or is a folder or a device.
std::string read_file(const std::filesystem::path& file);

/// As read_file, of a file that scarp has written: a pipe in its place would be waited for.
///
/// Throws: InputError as read_file, and if it is a pipe.
std::string read_kept_file(const std::filesystem::path& file);

}  // namespace scarp

#pragma once

#include <filesystem>
#include <string>

namespace scarp {

/// The whole content of a file.
///
/// Throws: InputError with the name of the file and the reason if it cannot be opened or read to
///         its end, or is a folder, or a pipe or a device, of which some never end.
std::string read_file(const std::filesystem::path& file);

}  // namespace scarp

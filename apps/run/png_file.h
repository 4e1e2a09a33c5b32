#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace scarp {

using Rgb = std::array<std::uint8_t, 3>;

/// Pixels row by row, the uppermost first.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<Rgb> pixels;
};

/// The content of a .png file.
std::string png_bytes(const Image& image);

/// Writes a .png file.
///
/// Throws: as AtomicFile.
void write_png(const std::filesystem::path& file, const Image& image);

}  // namespace scarp

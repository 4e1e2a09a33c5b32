#include "core/read_file.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "core/error.h"

namespace scarp {

// Not by streams: theirs throw an exception of their own where reading fails, and keep the reason.
std::string read_file(const std::filesystem::path& file) {
  const auto fail = [&file](int reason) {
    throw InputError(
        file.string() + ": cannot be read: " +
        (reason == EISDIR ? "it is a folder; give the name of a file" : std::strerror(reason)));
  };
  // Some of them never end.
  std::error_code ignored;
  if (std::filesystem::is_character_file(file, ignored) ||
      std::filesystem::is_block_file(file, ignored)) {
    throw InputError(file.string() + ": cannot be read: it is a device; give the name of a file");
  }
  errno = 0;
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> in(std::fopen(file.c_str(), "rb"),
                                                           &std::fclose);
  if (in == nullptr) fail(errno);
  std::string content;
  std::array<char, 1 << 16> piece;
  for (std::size_t count = piece.size(); count == piece.size();) {
    count = std::fread(piece.data(), 1, piece.size(), in.get());
    content.append(piece.data(), count);
  }
  if (std::ferror(in.get()) != 0) fail(errno);
  return content;
}

std::string read_kept_file(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_fifo(file, ignored))
    throw InputError(file.string() + ": cannot be read: it is a pipe; give the name of a file");
  return read_file(file);
}

}  // namespace scarp

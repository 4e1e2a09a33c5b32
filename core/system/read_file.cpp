#include "core/system/read_file.h"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "core/error.h"
#include "core/printable.h"

namespace scarp {

// Not by streams: theirs throw an exception of their own where reading fails, and keep the reason.
std::string read_file(const std::filesystem::path& file) {
  const auto fail = [&file](int reason) {
    throw InputError(shown(file) + ": cannot be read: " + std::strerror(reason));
  };
  const auto refuse_as = [&file](const char* what) {
    throw InputError(
        fmt::format("{}: cannot be read: it is {}; give the name of a file", shown(file), what));
  };
  // One that nobody writes would be waited for, others never end.
  switch (std::error_code ignored; std::filesystem::status(file, ignored).type()) {
    case std::filesystem::file_type::directory:
      refuse_as("a folder");
      break;
    case std::filesystem::file_type::fifo:
    case std::filesystem::file_type::socket:
      refuse_as("a pipe");
      break;
    case std::filesystem::file_type::character:
    case std::filesystem::file_type::block:
      refuse_as("a device");
      break;
    default:
      break;
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

}  // namespace scarp

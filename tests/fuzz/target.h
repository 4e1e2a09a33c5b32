#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "core/error.h"

/// What libFuzzer calls with each input; replay.cpp calls it with files.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace scarp::fuzz {

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// A file that holds what a reader gets to read, in memory where the system has a place for that.
class InputFile {
 public:
  explicit InputFile(const std::string& ending) {
    const std::filesystem::path memory = "/dev/shm";
    const auto folder =
        std::filesystem::exists(memory) ? memory : std::filesystem::temp_directory_path();
    path_ = folder / ("scarp-fuzz-" + std::to_string(getpid()) + ending);
  }
  ~InputFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  const std::filesystem::path& with(const std::uint8_t* data, std::size_t size) const {
    std::ofstream(path_, std::ios::binary) << text_of(data, size);
    return path_;
  }

 private:
  std::filesystem::path path_;
};

/// Any input is read or refused: nothing else may be thrown.
template <class Read>
int read_or_refuse(const Read& read) {
  try {
    read();
  } catch (const InputError&) {
  }
  return 0;
}

}  // namespace scarp::fuzz

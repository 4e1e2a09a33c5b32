#pragma once

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include "core/error.h"

namespace scarp {

/// A new folder that goes with this object. Several processes may have one at the same time.
///
/// Throws: NumericalError when there is no place for temporary files.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "scarp-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) {
      throw NumericalError(pattern + ": cannot be made: " + std::strerror(errno) +
                           "; name another folder for temporary files in TMPDIR");
    }
    path_ = pattern;
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  operator const std::filesystem::path&() const { return path_; }  // NOLINT: it is the path
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  std::string string() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace scarp

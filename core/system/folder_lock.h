#pragma once

#include <filesystem>

namespace scarp {

/// A folder that one process writes at a time, whatever its command; it is made where it is
/// missing.
///
/// An advisory lock on the empty file .lock in it. The kernel drops it when the process ends,
/// however it ends: none is ever left over. The file stays.
///
/// Throws: InputError when the folder cannot be made or written, or another process holds it;
///         DiskFullError.
class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

  /// Throws: NumericalError when the folder was removed or replaced since, .lock with it: another
  ///         process may be writing there now.
  void require_held() const;

 private:
  std::filesystem::path file_;
  int handle_ = -1;
};

}  // namespace scarp

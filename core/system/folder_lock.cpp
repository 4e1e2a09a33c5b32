#include "core/system/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "core/printable.h"
#include "core/system/atomic_file.h"

namespace scarp {

namespace {

bool is_one_file(const struct stat& a, const struct stat& b) {
  return a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

}  // namespace

FolderLock::FolderLock(const std::filesystem::path& folder) : file_(folder / ".lock") {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw InputError(shown(folder) + ": the result folder cannot be made: " + error.message() +
                     "; choose another with -o");
  }
  handle_ = open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (handle_ < 0) {
    if (errno == ENOSPC || errno == EDQUOT)
      throw DiskFullError(shown(folder) + ": cannot be written: the disk is full; free some space");
    throw InputError(shown(folder) + ": the result folder cannot be written: " +
                     std::strerror(errno) + "; choose another with -o");
  }
  if (flock(handle_, LOCK_EX | LOCK_NB) != 0) {
    close(handle_);
    throw InputError(shown(folder) +
                     ": another scarp is writing here; wait for it or choose another folder with "
                     "-o");
  }
}

FolderLock::~FolderLock() { close(handle_); }

void FolderLock::require_held() const {
  struct stat held {};
  struct stat there {};
  if (fstat(handle_, &held) == 0 && stat(file_.c_str(), &there) == 0 && is_one_file(held, there))
    return;
  throw NumericalError(shown(file_) +
                       ": was removed while a run writes into its folder; nothing more is written "
                       "there, as another run may be using it");
}

}  // namespace scarp

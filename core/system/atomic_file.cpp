#include "core/system/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <streambuf>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/printable.h"

namespace scarp {

namespace {

/// What was being written is gone.
class VanishedError : public NumericalError {
 public:
  using NumericalError::NumericalError;
};

bool is_full_disk(int error) { return error == ENOSPC || error == EDQUOT; }

[[noreturn]] void throw_cannot_write(const std::filesystem::path& target, int error) {
  const std::string place = shown(target) + ": cannot be written: ";
  if (is_full_disk(error)) {
    throw DiskFullError(place + "the disk is full; free some space");
  }
  if (error == EFBIG) {
    throw DiskFullError(place + "it is larger than files may be here; raise the limit (ulimit -f)");
  }
  throw NumericalError(place + std::strerror(error));
}

[[noreturn]] void throw_cannot_create(const std::filesystem::path& target, int error) {
  const std::string place = shown(target) + ": cannot be written: ";
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      throw InputError(place + "there is no folder " + shown(target.parent_path()));
    case EACCES:
    case EPERM:
    case EROFS:
      throw InputError(place + "no permission to write in " + shown(target.parent_path()) +
                       "; choose another folder");
    case EISDIR:
      throw InputError(place + "it is a folder; give the name of a file");
    case ENAMETOOLONG:
      throw InputError(place + "the name is too long");
    default:
      throw_cannot_write(target, error);
  }
}

std::filesystem::path followed(const std::filesystem::path& target) {
  std::error_code ignored;
  const auto real = std::filesystem::canonical(target, ignored);
  return std::filesystem::absolute(real.empty() ? target : real);
}

void sync_folder(const std::filesystem::path& folder) {
  const int handle = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (handle < 0) return;
  fsync(handle);
  close(handle);
}

/// False when the system refuses; errno says why.
bool write_all(int handle, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(handle, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

/// A stream buffer over a file handle that remembers the first error of the system.
class AtomicFile::Buffer : public std::streambuf {
 public:
  explicit Buffer(int handle) : handle_(handle), bytes_(1 << 20) { clear(); }
  ~Buffer() override {
    if (handle_ >= 0) ::close(handle_);
  }

  int error() const { return error_; }

  bool sync_to_disk() {
    // Devices and pipes cannot be synchronised (EINVAL); their bytes are gone already.
    return flush() && (fsync(handle_) == 0 || errno == EINVAL || failed());
  }

  bool close() {
    const int handle = std::exchange(handle_, -1);
    return ::close(handle) == 0 || failed();
  }

 protected:
  int_type overflow(int_type character) override {
    if (!flush()) return traits_type::eof();
    if (!traits_type::eq_int_type(character, traits_type::eof())) {
      *pptr() = traits_type::to_char_type(character);
      pbump(1);
    }
    return traits_type::not_eof(character);
  }

  int sync() override { return flush() ? 0 : -1; }

  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
    if (!flush()) return pos_type(off_type(-1));
    const int whence = from == std::ios_base::beg   ? SEEK_SET
                       : from == std::ios_base::cur ? SEEK_CUR
                                                    : SEEK_END;
    return pos_type(off_type(lseek(handle_, offset, whence)));
  }

  pos_type seekpos(pos_type position, std::ios_base::openmode mode) override {
    return seekoff(off_type(position), std::ios_base::beg, mode);
  }

 private:
  void clear() { setp(bytes_.data(), bytes_.data() + bytes_.size()); }

  bool failed() {
    if (error_ == 0) error_ = errno;
    return false;
  }

  bool flush() {
    if (error_ != 0) return false;
    const std::string_view bytes(pbase(), static_cast<std::size_t>(pptr() - pbase()));
    if (!write_all(handle_, bytes)) return failed();
    clear();
    return true;
  }

  int handle_;
  int error_ = 0;
  std::vector<char> bytes_;
};

AtomicFile::AtomicFile(const std::filesystem::path& target) : target_(followed(target)) {
  std::error_code ignored;
  const auto status = std::filesystem::status(target_, ignored);
  if (std::filesystem::is_directory(status)) throw_cannot_create(target_, EISDIR);

  int handle = -1;
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    handle = open(target_.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    // A name left over from a process that was killed is passed over.
    for (int attempt = 0; handle < 0 && (attempt == 0 || errno == EEXIST); ++attempt) {
      temporary_ = target_;
      temporary_ += ".tmp-" + std::to_string(getpid()) + "-" + std::to_string(attempt);
      handle = open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    }
  }
  if (handle < 0) throw_cannot_create(target_, errno);
  buffer_ = std::make_unique<Buffer>(handle);
  stream_ = std::make_unique<std::ostream>(buffer_.get());
}

AtomicFile::~AtomicFile() {
  if (temporary_.empty()) return;
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void AtomicFile::write(std::string_view bytes) {
  stream_->write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!*stream_) throw_cannot_write(target_, buffer_->error());
}

void AtomicFile::commit() {
  if (!buffer_->sync_to_disk() || !buffer_->close()) {
    throw_cannot_write(target_, buffer_->error());
  }
  if (temporary_.empty()) return;
  if (rename(temporary_.c_str(), target_.c_str()) != 0) {
    if (errno == ENOENT && std::filesystem::is_directory(target_.parent_path())) {
      throw VanishedError(
          fmt::format("{}: cannot be written: {}, which holds it until it is whole, "
                      "was removed",
                      shown(target_), shown(temporary_.filename())));
    }
    throw_cannot_create(target_, errno);
  }
  temporary_.clear();
  sync_folder(target_.parent_path());
}

void write_file(const std::filesystem::path& target,
                std::initializer_list<std::string_view> parts) {
  constexpr int most_attempts = 10;
  for (int attempt = 1;; ++attempt) {
    try {
      AtomicFile file(target);
      for (const std::string_view bytes : parts) file.write(bytes);
      return file.commit();
    } catch (const VanishedError&) {
      if (attempt == most_attempts) throw;
    }
  }
}

void append_to_file(const std::filesystem::path& target, std::string_view bytes) {
  const int handle = open(target.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (handle < 0) throw_cannot_write(target, errno);
  const off_t size = lseek(handle, 0, SEEK_END);
  const bool written = write_all(handle, bytes) && fsync(handle) == 0;
  const int error = errno;
  close(handle);
  if (written) return;
  std::error_code ignored;
  std::filesystem::resize_file(target, static_cast<std::uintmax_t>(size), ignored);
  throw_cannot_write(target, error);
}

}  // namespace scarp

#pragma once

#include <filesystem>
#include <initializer_list>
#include <memory>
#include <ostream>
#include <string_view>

#include "core/error.h"

namespace scarp {

/// The disk is full: what was being written can be written again when there is space.
class DiskFullError : public NumericalError {
 public:
  using NumericalError::NumericalError;
};

/// A file that appears whole or not at all.
///
/// Bytes go to `NAME.tmp-...` beside the target; commit() brings them to the disk and renames. A
/// file that is not committed is removed and an older file of that name stays as it was. A link is
/// followed; a device or a pipe is written as it is.
///
/// Throws: InputError if the file cannot be made where the user wants it (no folder, no
/// permission); NumericalError if it could not be written to the end, DiskFullError where that
///         is why.
class AtomicFile {
 public:
  explicit AtomicFile(const std::filesystem::path& target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// For text and binary content alike; can be positioned with seekp. An error of the disk makes it
  /// bad, and commit() says which it was.
  std::ostream& stream() { return *stream_; }

  /// Appends bytes; a full disk is noticed when the buffer of 1 MB is written out.
  void write(std::string_view bytes);

  /// Flushes to the disk and puts the file in its place. Call it once, last.
  void commit();

 private:
  class Buffer;
  std::filesystem::path target_;
  std::filesystem::path temporary_;  ///< empty for a device and after commit()
  std::unique_ptr<Buffer> buffer_;
  std::unique_ptr<std::ostream> stream_;
};

/// Writes a whole file by way of AtomicFile, in parts that follow each other; again where somebody
/// clears the folder up before it is whole.
void write_file(const std::filesystem::path& target, std::initializer_list<std::string_view> parts);
inline void write_file(const std::filesystem::path& target, std::string_view bytes) {
  write_file(target, {bytes});
}

/// Appends bytes to a file that is there and brings them to the disk; what a full disk has taken of
/// them is taken back.
///
/// Throws: NumericalError if they could not be written.
void append_to_file(const std::filesystem::path& target, std::string_view bytes);

}  // namespace scarp

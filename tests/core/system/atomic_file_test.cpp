#include "core/system/atomic_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

#include "core/error.h"
#include "core/system/read_file.h"
#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class AtomicFileTest : public testing::Test {
 protected:
  static std::string content(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream bytes;
    bytes << file.rdbuf();
    return bytes.str();
  }

  std::ptrdiff_t file_count() const {
    return std::distance(fs::directory_iterator(folder_), fs::directory_iterator());
  }

  TemporaryFolder folder_;
};

TEST_F(AtomicFileTest, KeepsEveryByte) {
  std::string bytes;
  for (int i = 0; i < 3 << 20; ++i) bytes.push_back(static_cast<char>(i * 7));
  write_file(folder_ / "all", bytes);
  EXPECT_EQ(content(folder_ / "all"), bytes);
  EXPECT_EQ(file_count(), 1);
}

TEST_F(AtomicFileTest, CanGoBackAndOverwrite) {
  AtomicFile file(folder_ / "header");
  file.stream() << "???? body";
  file.stream().seekp(0) << "head";
  file.stream().seekp(0, std::ios::end) << ", end";
  EXPECT_EQ(file.stream().tellp(), 14);
  file.commit();
  EXPECT_EQ(content(folder_ / "header"), "head body, end");
}

TEST_F(AtomicFileTest, IsNotThereBeforeCommit) {
  AtomicFile file(folder_ / "late");
  file.write("text");
  EXPECT_FALSE(fs::exists(folder_ / "late"));
  file.commit();
  EXPECT_EQ(content(folder_ / "late"), "text");
}

TEST_F(AtomicFileTest, LeavesTheOldFileWhenItIsNotCommitted) {
  write_file(folder_ / "old", "first");
  { AtomicFile(folder_ / "old").write("second"); }
  EXPECT_EQ(content(folder_ / "old"), "first");
  EXPECT_EQ(file_count(), 1);
}

TEST_F(AtomicFileTest, MayBeReadByWhomTheUserAllows) {
  const mode_t before = umask(0026);
  write_file(folder_ / "file", "text");
  umask(before);
  EXPECT_EQ(fs::status(folder_ / "file").permissions(), static_cast<fs::perms>(0640));
}

TEST_F(AtomicFileTest, FollowsALink) {
  write_file(folder_ / "real", "first");
  fs::create_symlink(folder_ / "real", folder_ / "link");
  write_file(folder_ / "link", "second");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(content(folder_ / "real"), "second");
}

TEST_F(AtomicFileTest, TwoWritersOfOneNameDoNotMix) {
  AtomicFile a(folder_ / "name");
  AtomicFile b(folder_ / "name");
  a.write("aaaa");
  b.write("bb");
  a.commit();
  b.commit();
  EXPECT_EQ(content(folder_ / "name"), "bb");
  EXPECT_EQ(file_count(), 1);
}

TEST_F(AtomicFileTest, SaysThatTheFolderIsMissing) {
  try {
    AtomicFile file(folder_ / "none" / "file");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), (folder_ / "none" / "file").string() +
                                             ": cannot be written: there is no folder " +
                                             (folder_ / "none").string());
  }
}

TEST_F(AtomicFileTest, SaysThatItWasRemovedBeforeItWasWhole) {
  AtomicFile file(folder_ / "file");
  for (const fs::path& part : fs::directory_iterator(folder_)) fs::remove(part);
  EXPECT_THAT([&] { file.commit(); },
              testing::ThrowsMessage<NumericalError>(testing::EndsWith("was removed")));
}

// Somebody clears the folder up while a file is written that takes a moment.
TEST_F(AtomicFileTest, IsWrittenAgainWhereItWasRemovedBeforeItWasWhole) {
  std::atomic<bool> ended = false;
  std::thread other([&] {
    for (bool removed = false; !removed && !ended;) {
      std::error_code ignored;
      for (const fs::path& part : fs::directory_iterator(folder_))
        if (part.filename().string().find(".tmp-") != std::string::npos)
          removed = fs::remove(part, ignored);
    }
  });
  const std::string bytes(std::size_t{64} << 20, 'x');
  EXPECT_NO_THROW(write_file(folder_ / "file", {bytes, "end"}));
  ended = true;
  other.join();
  EXPECT_EQ(read_file(folder_ / "file"), bytes + "end");
}

TEST_F(AtomicFileTest, RefusesAFolderAsAFile) {
  EXPECT_THROW(AtomicFile{folder_}, InputError);
  EXPECT_TRUE(fs::is_directory(folder_));
}

/// Whoever runs the tests as root may write anywhere, so the child process gives that up first.
[[noreturn]] void write_without_permission(const fs::path& folder) {
  if (geteuid() == 0 && seteuid(65534) != 0) std::_Exit(3);
  try {
    write_file(folder / "file", "text");
  } catch (const InputError& error) {
    std::fputs(error.what(), stderr);
    std::_Exit(2);
  }
  std::_Exit(0);
}

TEST_F(AtomicFileTest, SaysThatPermissionIsMissing) {
  fs::permissions(folder_, fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_EXIT(write_without_permission(folder_), testing::ExitedWithCode(2),
              "file: cannot be written: no permission to write in .*choose another folder");
  fs::permissions(folder_, fs::perms::owner_all);
  EXPECT_EQ(file_count(), 0);
}

TEST_F(AtomicFileTest, SaysThatTheDiskIsFull) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  try {
    write_file("/dev/full", "text");
    FAIL();
  } catch (const NumericalError& error) {
    EXPECT_THAT(error.what(), HasSubstr("/dev/full: cannot be written: the disk is full; free "));
  }
}

TEST_F(AtomicFileTest, NoticesAFullDiskWhileWriting) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  AtomicFile file("/dev/full");
  EXPECT_THROW(file.write(std::string(3 << 20, 'x')), NumericalError);
  EXPECT_THROW(file.commit(), NumericalError);
}

TEST_F(AtomicFileTest, AppendsToWhatIsThere) {
  write_file(folder_ / "file", "one\n");
  append_to_file(folder_ / "file", "two\n");
  EXPECT_EQ(content(folder_ / "file"), "one\ntwo\n");
}

/// A limit on the size of files stands for a disk that is full after some bytes.
[[noreturn]] void append_beyond_the_limit(const fs::path& file) {
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{6, 6};
  if (setrlimit(RLIMIT_FSIZE, &limit) != 0) std::_Exit(4);
  try {
    append_to_file(file, "two\n");
  } catch (const NumericalError& error) {
    std::_Exit(std::string(error.what()).ends_with("raise the limit (ulimit -f)") ? 3 : 5);
  }
  std::_Exit(0);
}

TEST_F(AtomicFileTest, TakesBackHalfALine) {
  write_file(folder_ / "file", "one\n");
  EXPECT_EXIT(append_beyond_the_limit(folder_ / "file"), testing::ExitedWithCode(3), "");
  EXPECT_EQ(content(folder_ / "file"), "one\n");
}

}  // namespace
}  // namespace scarp

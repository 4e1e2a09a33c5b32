#include "core/system/folder_lock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "core/error.h"
#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(FolderLock, HoldsOffASecondOneUntilItEnds) {
  const TemporaryFolder folder;
  {
    const FolderLock first(folder / "r");
    EXPECT_THAT([&] { FolderLock(folder / "r"); },
                testing::ThrowsMessage<InputError>(
                    AllOf(HasSubstr("another scarp is writing here"), HasSubstr("-o"))));
    EXPECT_NO_THROW(FolderLock(folder / "s"));
  }
  EXPECT_NO_THROW(FolderLock(folder / "r"));
}

TEST(FolderLock, OfAKilledProcessIsFree) {
  const TemporaryFolder folder;
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    const FolderLock lock(folder);
    if (write(ready[1], "x", 1) == 1) pause();
    _exit(1);
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_THROW(FolderLock{folder}, InputError);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_NO_THROW(FolderLock{folder});
}

TEST(FolderLock, NoticesThatItsFolderIsAnotherOne) {
  const TemporaryFolder folder;
  const FolderLock lock(folder / "r");
  EXPECT_NO_THROW(lock.require_held());
  std::filesystem::remove_all(folder / "r");
  EXPECT_THROW(lock.require_held(), NumericalError);
  const FolderLock other(folder / "r");
  EXPECT_THROW(lock.require_held(), NumericalError);
  EXPECT_NO_THROW(other.require_held());
}

}  // namespace
}  // namespace scarp

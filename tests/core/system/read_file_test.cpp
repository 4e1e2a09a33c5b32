#include "core/system/read_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "core/error.h"
#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

std::string message_of(const fs::path& path) {
  try {
    read_file(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ReadFile, GivesEveryByte) {
  const TemporaryFolder folder;
  const fs::path path = folder / "bytes";
  std::string bytes(200'000, '\0');
  for (std::size_t n = 0; n < bytes.size(); ++n) bytes[n] = static_cast<char>(n * n / 7);
  std::ofstream(path, std::ios::binary) << bytes;
  EXPECT_EQ(read_file(path), bytes);
  std::ofstream(path, std::ios::binary | std::ios::trunc).flush();
  EXPECT_EQ(read_file(path), "");
}

TEST(ReadFile, DoesNotWaitForAPipe) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "metrics.csv").c_str(), 0600), 0);
  EXPECT_THAT(message_of(folder / "metrics.csv"), HasSubstr("it is a pipe"));
}

TEST(ReadFile, SaysWhyAFileCannotBeRead) {
  EXPECT_THAT(message_of("/no/such"), AllOf(HasSubstr("/no/such"), HasSubstr("No such file")));
  EXPECT_THAT(message_of("/"), HasSubstr("folder"));
  EXPECT_THAT(message_of("/dev/zero"), HasSubstr("device"));
  // Opens, and then cannot be read.
  EXPECT_THAT(message_of("/proc/self/mem"), HasSubstr("Input/output error"));
}

}  // namespace
}  // namespace scarp

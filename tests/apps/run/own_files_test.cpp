#include "apps/run/own_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/error.h"
#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(OwnFiles, AreThoseBesideTheirMark) {
  const TemporaryFolder folder;
  const auto is_picture = [](const std::string& name) { return name.ends_with(".svg"); };
  const auto require = [&](bool has_mark) {
    require_own(folder / "", "a drawing", has_mark, is_picture);
  };
  EXPECT_NO_THROW(require(false));
  std::ofstream(folder / "notes.txt") << "mine";
  EXPECT_NO_THROW(require(false));
  std::ofstream(folder / "b.svg") << "mine";
  std::ofstream(folder / "a.svg") << "mine";
  EXPECT_THAT([&] { require(false); },
              ThrowsMessage<InputError>(
                  AllOf(HasSubstr("a.svg: was not written by a drawing"), HasSubstr("-o"))));
  EXPECT_NO_THROW(require(true));
  std::filesystem::create_directory(folder / "c.svg");
  EXPECT_THAT([&] { require(true); }, ThrowsMessage<InputError>(HasSubstr("c.svg: is a folder")));
  std::filesystem::remove(folder / "c.svg");
  std::filesystem::create_symlink(folder / "nowhere", folder / "c.svg");
  EXPECT_NO_THROW(require(true));
}

TEST(OwnFiles, AMarkIsTheBeginningOfAFile) {
  const TemporaryFolder folder;
  EXPECT_FALSE(begins_with(folder / "a.csv", "x,y"));
  std::ofstream(folder / "a.csv") << "x,z";
  EXPECT_FALSE(begins_with(folder / "a.csv", "x,y"));
  std::ofstream(folder / "a.csv") << "x,y,z\n1,2,3\n";
  EXPECT_TRUE(begins_with(folder / "a.csv", "x,y"));
}

}  // namespace
}  // namespace scarp

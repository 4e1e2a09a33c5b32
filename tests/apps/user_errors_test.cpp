#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "core/recipe/toml.h"
#include "tests/apps/program.h"

namespace scarp {
namespace {

using testing::HasSubstr;

/// tests/apps/user_errors.toml, a group of its cases at a time.
class UserErrors : public Program, public testing::WithParamInterface<std::string> {
 protected:
  UserErrors() : table_(parse_toml(read_file(file()), file())) {
    std::filesystem::current_path(folder_);
    for (const TomlValue& given : table_.find("files")->entries) write(given.key, given.text);
  }

  static std::string file() {
    return std::string(SCARP_SOURCE_DIR) + "/tests/apps/user_errors.toml";
  }

  // Adds the files of a case, and says which there are.
  std::set<std::string> prepare(const TomlValue& example) const {
    if (const TomlValue* edit = example.find("edit")) {
      std::string recipe = table_.find("files")->find("trench.toml")->text;
      const std::string& old = edit->entries[0].text;
      const std::size_t at = recipe.find(old);
      EXPECT_NE(at, std::string::npos) << old;
      write("bad.toml", recipe.replace(at, old.size(), edit->entries[1].text));
    }
    if (const TomlValue* more = example.find("files"))
      for (const TomlValue& given : more->entries) write(given.key, given.text);
    write("messages.txt", "");
    return files(".");
  }

  // Names of files as if they were relative to the folder.
  std::string without_folder(std::string message) const {
    const std::string folder = folder_.string() + '/';
    for (std::size_t at = 0; (at = message.find(folder)) != std::string::npos;)
      message.erase(at, folder.size());
    return message;
  }

  void remove_all_but_shared() const {
    for (const std::string& name : files("."))
      if (table_.find("files")->find(name) == nullptr) std::filesystem::remove(folder_ / name);
  }

  TomlValue table_;
};

// Refused with the place and the remedy, and nothing is written.
TEST_P(UserErrors, AreRefused) {
  const TomlValue* group = table_.find(GetParam());
  ASSERT_NE(group, nullptr);
  for (const TomlValue& example : group->entries) {
    const std::string& command = example.find("command")->text;
    SCOPED_TRACE("user_errors.toml:" + std::to_string(example.place.line) + ": " + command);
    const std::set<std::string> before = prepare(example);
    const Outcome outcome = scarp(command);
    EXPECT_EQ(outcome.exit_code, example.find("exit")->integer);
    EXPECT_THAT(without_folder(outcome.messages), HasSubstr(example.find("says")->text));
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(files("."), before);
    remove_all_but_shared();
  }
}

INSTANTIATE_TEST_SUITE_P(Groups, UserErrors, testing::Values("recipe", "command", "mesh"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace scarp

// The house rules that CMake cannot check, because Debian puts all headers in one folder: who may
// include what.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

struct Include {
  fs::path file;  // relative to the project
  int line;
  std::string header;
};

const std::map<std::string, std::set<std::string>>& floors_below() {
  static const std::map<std::string, std::set<std::string>> below{
      {"core", {}},
      {"levelset", {"core"}},
      {"mesh", {"core"}},
      {"flux", {"core"}},
      {"models", {"core", "levelset", "mesh", "flux"}},
      {"apps", {"core", "levelset", "mesh", "flux", "models"}}};
  return below;
}

/// What a line includes; empty if it includes nothing.
std::string included(const std::string& line) {
  const std::size_t begin = line.find_first_of("<\"");
  if (line.rfind("#include", 0) != 0 || begin == std::string::npos) return "";
  return line.substr(begin + 1, line.find_first_of(">\"", begin + 1) - begin - 1);
}

std::vector<std::string> floors() {
  std::vector<std::string> names;
  for (const auto& [folder, below] : floors_below()) names.push_back(folder);
  return names;
}

std::vector<Include> includes(const std::vector<std::string>& folders = floors()) {
  std::vector<Include> found;
  for (const std::string& folder : folders) {
    for (const auto& entry :
         fs::recursive_directory_iterator(fs::path(SCARP_SOURCE_DIR) / folder)) {
      if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
      std::ifstream in(entry.path());
      std::string text;
      for (int line = 1; std::getline(in, text); ++line) {
        const std::string header = included(text);
        if (!header.empty()) {
          found.push_back({fs::relative(entry.path(), SCARP_SOURCE_DIR), line, header});
        }
      }
    }
  }
  return found;
}

std::string place(const Include& include) {
  return include.file.string() + ":" + std::to_string(include.line) + ": " + include.header;
}

bool starts_with(const std::string& text, const std::string& start) {
  return text.rfind(start, 0) == 0;
}

TEST(Floors, AFileIncludesItsOwnFolderAndFloorsBelow) {
  int own = 0;
  for (const Include& include : includes()) {
    const std::string from = include.file.begin()->string();
    const std::string to = include.header.substr(0, include.header.find('/'));
    if (!floors_below().contains(to) || include.header.find('/') == std::string::npos) continue;
    ++own;
    EXPECT_TRUE(to == from || floors_below().at(from).contains(to)) << place(include);
  }
  EXPECT_GT(own, 0) << "no include was read: the test looks in the wrong place";
}

// Which files include a header that starts with one of the given names.
std::set<fs::path> files_that_include(const std::vector<std::string>& starts,
                                      const std::vector<std::string>& folders = floors()) {
  std::set<fs::path> files;
  for (const Include& include : includes(folders)) {
    for (const std::string& start : starts) {
      if (starts_with(include.header, start)) files.insert(include.file);
    }
  }
  return files;
}

TEST(Floors, OpenVdbIsSeenInOneSourceFileOnly) {
  EXPECT_EQ(files_that_include({"openvdb/"}), (std::set<fs::path>{"levelset/grid/vdb.cpp"}));
}

TEST(Floors, EmbreeIsSeenInOneSourceFileOnly) {
  EXPECT_EQ(files_that_include({"embree3/", "embree4/"}),
            (std::set<fs::path>{"flux/rays/embree_tree.cpp"}));
}

// A dependency that nothing includes is none.
TEST(Floors, EachPackageIsIncludedBySomething) {
  EXPECT_FALSE(files_that_include({"openvdb/"}).empty());
  EXPECT_FALSE(files_that_include({"embree3/"}).empty());
  EXPECT_FALSE(files_that_include({"tbb/", "oneapi/tbb"}).empty());
  EXPECT_FALSE(files_that_include({"Eigen/", "eigen3/"}).empty());
  EXPECT_FALSE(files_that_include({"gtest/"}, {"tests"}).empty());
}

TEST(Floors, TheTomlParserIsSeenInOneFileOfCoreOnly) {
  const std::set<fs::path> files = files_that_include({"toml++/", "toml.hpp"});
  ASSERT_EQ(files.size(), 1U);
  EXPECT_EQ(files.begin()->begin()->string(), "core");
  EXPECT_EQ(files.begin()->extension(), ".cpp");
}

TEST(Floors, TheCommandLineParserIsSeenInOneFileOfAppsOnly) {
  EXPECT_EQ(files_that_include({"CLI/"}), (std::set<fs::path>{"apps/scarp/command_line.cpp"}));
}

TEST(Floors, NoHeaderIncludesTbb) {
  for (const fs::path& file : files_that_include({"tbb/", "oneapi/tbb"})) {
    EXPECT_EQ(file.extension(), ".cpp") << file;
  }
}

}  // namespace

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

using Below = std::map<std::string, std::set<std::string>>;

/// What files of a folder may include besides their own.
const Below& floors_below() {
  static const Below below{{"core", {}},
                           {"levelset", {"core"}},
                           {"mesh", {"core"}},
                           {"flux", {"core"}},
                           {"models", {"core", "levelset", "mesh", "flux"}},
                           {"apps", {"core", "levelset", "mesh", "flux", "models"}}};
  return below;
}

/// What lies over all rooms of its folder, though it stands beside them.
const std::set<std::string> on_top{"flux/reconstruct", "flux/revolution", "flux/solve",
                                   "models/registry"};

/// What files of a room may include of their folder besides their own room.
const Below& rooms_below() {
  static const Below below{
      {"core", {}},
      {"core/system", {"core"}},
      {"core/recipe", {"core", "core/system"}},
      {"levelset/grid", {}},
      {"levelset/start", {"levelset/grid"}},
      {"levelset/surface", {"levelset/grid"}},
      {"levelset/motion", {"levelset/grid", "levelset/surface"}},
      {"levelset/operations", {"levelset/grid", "levelset/surface", "levelset/start"}},
      {"levelset/metrology", {"levelset/grid", "levelset/surface"}},
      {"levelset/bath", {"levelset/grid"}},
      {"mesh", {}},
      {"mesh/files", {"mesh"}},
      {"mesh/regions", {"mesh"}},
      {"mesh/simplify", {"mesh"}},
      {"flux/sampling", {}},
      {"flux", {"flux/sampling"}},
      {"flux/rays", {"flux", "flux/sampling"}},
      {"flux/engines", {"flux", "flux/sampling", "flux/rays"}},
      {"flux on top", {"flux", "flux/sampling", "flux/rays", "flux/engines"}},
      {"models", {}},
      {"models/catalogue", {"models"}},
      {"models on top", {"models", "models/catalogue"}},
      {"apps/viewer", {}},
      {"apps/simulator", {}},
      {"apps/estimate", {"apps/simulator"}},
      {"apps/run", {"apps/viewer", "apps/simulator", "apps/estimate"}},
      {"apps/report", {"apps/viewer", "apps/simulator", "apps/estimate", "apps/run"}},
      {"apps/scarp", {"apps/simulator", "apps/estimate", "apps/run", "apps/report"}}};
  return below;
}

std::string room_of(fs::path file) {
  const std::string folder = file.begin()->string();
  if (on_top.contains(file.replace_extension().string())) return folder + " on top";
  return file.parent_path().string();
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

TEST(Floors, AFileIncludesItsOwnRoomAndRoomsBelow) {
  int others = 0;
  for (const Include& include : includes()) {
    const fs::path header = include.header;
    if (!header.has_parent_path() || *header.begin() != *include.file.begin()) continue;
    const std::string from = room_of(include.file);
    const std::string to = room_of(header);
    if (from == to) continue;
    ++others;
    ASSERT_TRUE(rooms_below().contains(from)) << "a room without a floor: " << from;
    EXPECT_TRUE(rooms_below().at(from).contains(to)) << place(include);
  }
  EXPECT_GT(others, 0);
}

// A folder that is full is one in which nobody finds anything.
TEST(Floors, NoRoomHasMoreThan45Files) {
  std::map<fs::path, int> files;
  for (const auto& [room, below] : rooms_below()) {
    if (room.ends_with(" on top") || room == "models/catalogue") continue;  // a file per model
    for (const auto& entry : fs::directory_iterator(fs::path(SCARP_SOURCE_DIR) / room))
      files[room] += entry.is_regular_file() ? 1 : 0;
  }
  for (const auto& [room, count] : files) EXPECT_LE(count, 45) << room;
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

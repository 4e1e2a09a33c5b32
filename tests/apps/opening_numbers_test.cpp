// An opening keeps its number and its place over outputs, seeds, interruptions and modes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <vector>

#include "core/recipe/csv_table.h"
#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

/// What metrology.csv says of an opening at each output, across y. Units: nm.
struct Course {
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> top_cd;
};

std::map<int, Course> courses_of(const fs::path& run) {
  const CsvTable table(run / "metrology.csv");
  std::map<int, Course> courses;
  for (std::size_t row = 0; row < table.row_count(); ++row) {
    if (table.text(row, "plane").starts_with("x")) continue;
    Course& course = courses[static_cast<int>(table.number(row, "opening").value_or(0))];
    course.x.push_back(table.number(row, "x_nm").value_or(1e9));
    course.y.push_back(table.number(row, "y_nm").value_or(1e9));
    course.top_cd.push_back(table.number(row, "top_cd_nm").value_or(0));
  }
  return courses;
}

class OpeningNumbers : public Program {
 protected:
  /// Four holes that grow at four corners, whose centres noise moves.
  static std::string four_holes(const std::string& more) {
    return "run " + std::string(SCARP_SOURCE_DIR) +
           "/tests/reference/openings/four_holes.toml --quiet " + more;
  }
};

void expect_four_holes(const std::map<int, Course>& courses, std::size_t outputs) {
  // Means over eight seeds, whose standard deviation is 1.5 at the end.
  const std::vector<double> narrow{220, 229, 238, 248, 258, 267, 277, 286, 295, 305, 314, 324, 333};
  const std::vector<double> wide{300, 310, 320, 330, 341, 350, 360, 370, 381, 392, 401, 411, 422};
  ASSERT_EQ(courses.size(), 4U);
  for (const auto& [number, course] : courses) {
    ASSERT_EQ(course.x.size(), outputs) << number;
    for (std::size_t n = 0; n < outputs; ++n) {
      EXPECT_NEAR(course.x[n], number <= 2 ? -250 : 250, 12.5) << number << ' ' << n;
      EXPECT_NEAR(course.y[n], number % 2 == 1 ? -250 : 250, 12.5) << number << ' ' << n;
      EXPECT_NEAR(course.top_cd[n], (number % 2 == 1 ? wide : narrow)[n], 6) << number << ' ' << n;
    }
  }
}

TEST_F(OpeningNumbers, StayOverOutputsAndSeeds) {
  for (const int seed : {1, 7}) {
    const std::string run = path("seed_" + std::to_string(seed));
    ASSERT_EQ(scarp(four_holes("--set flux.seed=" + std::to_string(seed) + " -o " + run)).exit_code,
              0);
    expect_four_holes(courses_of(run), 13);
    const std::string page = read_file(fs::path(run) / "report.html");
    EXPECT_THAT(page, HasSubstr("hole 4, across x"));
    EXPECT_THAT(page, Not(HasSubstr("hole 4, x =")));
  }
}

// Of four trenches those on the right merge before those on the left.
TEST_F(OpeningNumbers, StayOverInterruptions) {
  std::string text = R"(
[domain]
spacing = "20 nm"
extent = ["1.6 um"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[step]]
model = "isotropic"
duration = "45 s"
etch_rate = "2 nm/s"
[output]
every = "5 s"
)";
  for (const char* center : {"-500", "-220", "220", "440"})
    text += std::string("[[geometry]]\nshape = \"trench\"\nwidth = \"160 nm\"\n") +
            "depth = \"300 nm\"\ncenter = \"" + center + " nm\"\n";
  write("four.toml", text);
  const std::string run = "run " + path("four.toml") + " --quiet -o ";
  ASSERT_EQ(scarp(run + path("whole")).exit_code, 0);
  const auto courses = courses_of(folder_ / "whole");
  ASSERT_EQ(courses.size(), 6U);
  EXPECT_NEAR(courses.at(5).x.back(), 330, 20);
  EXPECT_NEAR(courses.at(6).x.back(), -360, 20);
  ASSERT_LT(courses.at(6).x.size(), courses.at(5).x.size());

  fs::copy(folder_ / "whole", folder_ / "cut", fs::copy_options::recursive);
  // Nor do the numbers come from what is left of earlier outputs.
  for (const char* gone :
       {"summary.json", "metrology.csv", "state_0009.vdb", "state_0003.vdb", "state_0004.vdb"})
    fs::remove(folder_ / "cut" / gone);
  ASSERT_EQ(scarp(run + path("cut") + " --resume").exit_code, 0);
  for (const auto& [number, course] : courses_of(folder_ / "cut"))
    EXPECT_NEAR(course.x.back(), courses.at(number).x.back(), 1) << number;
  const auto json = json_of(scarp("measure --json " + path("cut/state_0009.vdb")));
  ASSERT_EQ(json["openings"].size(), 2U);
  for (const auto& opening : json["openings"])
    EXPECT_NEAR(opening["place"]["x_nm"], courses.at(opening["opening"]).x.back(), 1e-3);
}

// Of a trench on a periodic side and one in the middle.
TEST_F(OpeningNumbers, StayOnPeriodicSidesAndInBothModes) {
  const std::string text = R"(
[domain]
spacing = "20 nm"
extent = ["800 nm"]
boundary = ["periodic"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "160 nm"
depth = "300 nm"
center = "400 nm"
[[geometry]]
shape = "trench"
width = "240 nm"
depth = "300 nm"
[flux]
rays = 3000
engine = "forward"
[[step]]
model = "single_particle"
duration = "40 s"
etch_rate = "2 nm/s"
sticking = 0.5
[output]
every = "2 s"
)";
  write("two.toml", text);
  ASSERT_EQ(scarp("run " + path("two.toml") + " --quiet -o " + path("2d")).exit_code, 0);
  ASSERT_EQ(scarp("run " + path("two.toml") + " --quiet -o " + path("3d") +
                  " --set 'domain.mode=\"3d\"' --set 'domain.extent=[\"800 nm\", \"80 nm\"]'"
                  " --set 'domain.boundary=[\"periodic\", \"reflective\"]'")
                .exit_code,
            0);
  for (const char* run : {"2d", "3d"}) {
    const auto courses = courses_of(folder_ / run);
    ASSERT_EQ(courses.size(), 2U) << run;
    for (std::size_t n = 0; n < 21; ++n) {
      EXPECT_NEAR(courses.at(1).x[n], -400, 20) << run << n;
      EXPECT_NEAR(courses.at(2).x[n], 0, 20) << run << n;
    }
    EXPECT_NEAR(courses.at(1).top_cd.front(), 160, 2);
    EXPECT_GT(courses.at(1).top_cd.back(), 200);
  }
}

}  // namespace
}  // namespace scarp

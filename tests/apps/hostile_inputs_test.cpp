// Recipes, layouts, meshes and tables with random changes, through the program: whatever stands in
// them, it ends by itself with one of its exit codes, within bounds of time and memory.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "core/printable.h"
#include "core/random.h"
#include "tests/apps/program.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

const fs::path sources = SCARP_SOURCE_DIR;

std::vector<fs::path> files_of(const fs::path& folder, const std::string& ending = "") {
  std::vector<fs::path> files;
  for (const fs::path& file : fs::directory_iterator(sources / folder))
    if (ending.empty() || file.extension() == ending) files.push_back(file);
  std::ranges::sort(files);
  return files;
}

/// Changes to a text or to bytes.
class Mutation {
 public:
  explicit Mutation(std::uint64_t seed) : random_({.seed = seed}) {}

  std::size_t below(std::size_t count) {
    return std::min(count - 1,
                    static_cast<std::size_t>(random_.uniform() * static_cast<double>(count)));
  }

  template <class T>
  const T& any_of(const std::vector<T>& choice) {
    return choice[below(choice.size())];
  }

  /// A few numbers of a text, bits of a file, or anything anywhere.
  std::string change(std::string text) {
    const bool is_text =
        std::ranges::all_of(text, [](unsigned char c) { return c < 128 && c > 0; });
    const bool is_gentle = below(3) > 0;
    for (std::size_t n = below(4); n < 4; n += 1 + below(4)) {
      if (text.empty()) return text;
      const std::size_t place = below(text.size());
      if (!is_gentle)
        change_once(text, place);
      else if (is_text)
        change_number(text, place);
      else
        text[place] = static_cast<char>(text[place] ^ (1 << below(8)));
    }
    return text;
  }

 private:
  void change_once(std::string& text, std::size_t place) {
    const std::size_t length = std::min(text.size() - place, below(40));
    switch (below(9)) {
      case 0:
        text[place] = static_cast<char>(text[place] ^ (1 << below(8)));
        return;
      case 1:
        text.erase(place, length);
        return;
      case 2:
        text.insert(below(text.size()), text.substr(place, length));
        return;
      case 3:
        text.insert(place, any_of(words_));
        return;
      case 4:
        text.resize(place);
        return;
      default:
        change_number(text, place);
    }
  }

  /// To one that is somewhere near, or to no number that makes sense.
  void change_number(std::string& text, std::size_t place) {
    const auto is_part = [](unsigned char c) { return std::isdigit(c) != 0 || c == '.'; };
    auto first =
        std::find_if(text.begin() + static_cast<std::ptrdiff_t>(place), text.end(), is_part);
    while (first != text.begin() && is_part(static_cast<unsigned char>(*std::prev(first)))) --first;
    const auto last = std::find_if_not(first, text.end(), is_part);
    const double value = std::atof(std::string(first, last).c_str());
    const std::vector<double> factors{0.1, 0.5, 0.9, 1.1, 2, 3, 10};
    const double near = value * any_of(factors);
    text.replace(first, last, below(4) > 0 ? fmt::format("{:.3g}", near) : any_of(numbers_));
  }

  RandomStream random_;
  std::vector<std::string> numbers_{
      "nan",     "inf",   "-inf",       "0",      "-1",   "1",   "2",
      "10",      "1e308", "1e-308",     "-1e308", "1e30", "1e9", "1e12",
      "1000000", "0.001", "4294967296", "1e-9",   "0x7f", "1_0", "18446744073709551616"};
  std::vector<std::string> words_{"\x1b[31m",
                                  "\x07",
                                  std::string(1, '\0'),
                                  "\xff\xfe",
                                  "\"",
                                  "'",
                                  "[[step]]\n",
                                  "]]>",
                                  "=1+1",
                                  "\n",
                                  "\r",
                                  " um",
                                  " s",
                                  "{",
                                  "}",
                                  "\xc2\x9b",
                                  "model = \"etch\"\n",
                                  std::string(3000, 'a'),
                                  "../..",
                                  "%s%n"};
};

class SlowHostileInputs : public Program, public testing::WithParamInterface<int> {
 protected:
  /// What is called of an input, and how long it may take: a run is asked to stop after 15 s.
  void expect_sound(const std::string& arguments, bool is_run, const std::string& what) {
    const std::string line = "cd " + folder_.string() + " && ulimit -v 2097152; timeout " +
                             (is_run ? "--foreground --preserve-status -k 5 15 " : "-k 1 20 ") +
                             SCARP_BINARY + ' ' + arguments +
                             " --threads 2 > said 2>&1 < /dev/null";
    const auto start = std::chrono::steady_clock::now();
    const int status = std::system(line.c_str());
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    const std::string said = read_file(folder_ / "said");
    EXPECT_THAT(code, testing::AnyOf(0, 1, 2, 3, 130)) << what << ": " << arguments << '\n'
                                                       << repeated(said.substr(0, 300));
    EXPECT_FALSE(has_control_characters(said)) << what << ": " << arguments;
    EXPECT_LT(seconds.count(), 21) << what << ": " << arguments;
    if (!HasFailure() || is_kept_) return;
    is_kept_ = true;
    const fs::path kept = fs::temp_directory_path() / ("hostile_" + std::to_string(GetParam()));
    fs::remove_all(kept);
    fs::copy(folder_, kept, fs::copy_options::recursive);
  }

  bool is_kept_ = false;
};

// Small, so that only what was changed makes them long.
std::string recipe_around(const std::string& geometry, const std::string& step) {
  return "[domain]\nspacing = \"10 nm\"\nextent = [\"400 nm\", \"400 nm\"]\n"
         "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n" +
         geometry + "[flux]\nrays = 5000\n[[step]]\nduration = \"2 s\"\n" + step;
}

const std::string grow =
    "model = \"single_particle\"\nmaterial = \"SiO2\"\ngrowth_rate = \"10 nm/s\"\nsticking = 0.5\n";

TEST_P(SlowHostileInputs, EndWithinBounds) {
  std::vector<fs::path> recipes = files_of("tests/regression", ".toml");
  for (const char* more : {"tests/fuzz/seeds/recipe", "tests/reference/films"})
    for (const fs::path& file : files_of(more)) recipes.push_back(file);
  std::vector<fs::path> meshes = files_of("tests/reference/meshes");
  for (const char* format : {"obj", "ply", "stl", "vtp"})
    for (const fs::path& file : files_of(fs::path("tests/fuzz/seeds") / format))
      meshes.push_back(file);
  const std::vector<fs::path> layouts = files_of("tests/fuzz/seeds/gds");

  for (int n = 0; n < 100; ++n) {
    const int number = 100 * GetParam() + n;
    const std::string what = "input " + std::to_string(number);
    Mutation mutation(static_cast<std::uint64_t>(number));
    fs::remove_all(folder_ / "out");
    switch (n % 10) {
      case 0:
      case 1: {
        const fs::path& file = mutation.any_of(meshes);
        const std::string name = "in" + file.extension().string();
        write(name, mutation.change(read_file(file)));
        const std::vector<std::string> commands{
            "simplify " + name + " out.ply --l0 0.5",
            "simplify " + name + " out.vtp --max-error 0.1 --spacing 1",
            "simplify " + name + " out.obj --vertices 20", "flux " + name + " --rays 1000"};
        expect_sound(mutation.any_of(commands), false, what);
        break;
      }
      case 2: {
        const fs::path& file = mutation.any_of(meshes);
        const std::string name = "in" + file.extension().string();
        write(name, mutation.change(read_file(file)));
        write("r.toml",
              recipe_around("[[geometry]]\nshape = \"mesh\"\nmaterial = \"SiO2\"\nfile = \"" +
                                name + "\"\nunit = \"100 nm\"\n",
                            grow));
        expect_sound("preview r.toml -o out", false, what);
        break;
      }
      case 3:
      case 4:
        write("in.gds", mutation.change(read_file(mutation.any_of(layouts))));
        write("r.toml",
              recipe_around("[[geometry]]\nshape = \"mask\"\nmaterial = \"resist\"\n"
                            "thickness = \"100 nm\"\n"
                            "resist = { shape = \"gds\", file = \"in.gds\", layer = 1 }\n",
                            grow));
        expect_sound(n % 10 == 3 ? "preview r.toml -o out" : "check r.toml", false, what);
        break;
      case 5:
        write("t.csv", mutation.change("angle [deg],density\n0,1\n10,0.8\n40,0.3\n90,0\n"));
        write("r.toml", recipe_around("", grow + "source_table = \"t.csv\"\n"));
        expect_sound("run r.toml -o out", true, what);
        break;
      default: {
        write("r.toml", mutation.change(read_file(mutation.any_of(recipes))));
        const std::vector<std::string> commands{"check r.toml", "preview r.toml -o out",
                                                "run r.toml -o out", "run r.toml -o out"};
        const std::string& command = mutation.any_of(commands);
        expect_sound(command, command.starts_with("run"), what);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Hundred, SlowHostileInputs, testing::Range(0, 20));

}  // namespace
}  // namespace scarp

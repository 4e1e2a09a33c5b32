// What scarp preview takes for layouts of many shapes, on one core.
//
//   ./dev bench layouts [--repeats N] [--json]
//
// 10 000 triangles that touch and 10 000 squares that do not, on 400 x 400 cells, and 400 discs of
// 64 points on 200 x 200 cells; the mask is two cells thick. CPU seconds of the program, the least
// of the repeats; more than two for any of them is exit code 2.

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/system/temporary_folder.h"
#include "tests/bench/bench_main.h"
#include "tests/levelset/gds_writer.h"

namespace scarp::bench {
namespace {

constexpr double most_seconds = 2;

struct Settings {
  int repeats = 3;
  bool json = false;
};

struct Layout {
  std::string name;
  int cells = 0;  ///< of 10 nm, along x and y
  std::string gds;
};

/// cut: each square in two triangles, which touch their neighbours; or half as wide as its place.
Layout squares(bool cut) {
  constexpr int count = 100;
  constexpr int pitch = 40;
  const int rows = cut ? count / 2 : count;
  GdsWriter gds;
  gds.cell("TOP", [&] {
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j < rows; ++j) {
        const int x = pitch * (i - count / 2);
        const int y = pitch * (j - rows / 2);
        const int x1 = x + (cut ? pitch : pitch / 2);
        const int y1 = y + (cut ? pitch : pitch / 2);
        if (cut) {
          gds.boundary(1, 0, {x, y, x1, y, x1, y1, x, y});
          gds.boundary(1, 0, {x, y, x1, y1, x, y1, x, y});
        } else {
          gds.rectangle(1, x, y, x1, y1);
        }
      }
    }
  });
  return {.name = cut ? "10000 touching" : "10000 apart", .cells = 400, .gds = gds.finish()};
}

Layout discs() {
  constexpr int count = 20;
  constexpr int corners = 64;
  constexpr double pitch = 100;
  constexpr double radius = 35;
  GdsWriter gds;
  gds.cell("TOP", [&] {
    for (int n = 0; n < count * count; ++n) {
      std::vector<int> points;
      for (int corner = 0; corner <= corners; ++corner) {
        const double angle = 2 * std::numbers::pi * (corner % corners) / corners;
        const double x = pitch * (n % count - 0.5 * (count - 1)) + radius * std::cos(angle);
        const double y = pitch * (n / count - 0.5 * (count - 1)) + radius * std::sin(angle);
        points.push_back(static_cast<int>(std::lround(x)));
        points.push_back(static_cast<int>(std::lround(y)));
      }
      gds.boundary(1, 0, points);
    }
  });
  return {.name = "400 discs", .cells = 200, .gds = gds.finish()};
}

double seconds_of_children() {
  rusage use{};
  getrusage(RUSAGE_CHILDREN, &use);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(use.ru_utime) + seconds(use.ru_stime);
}

double seconds_of_preview(const Layout& layout) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a.gds", std::ios::binary) << layout.gds;
  std::ofstream(folder / "r.toml") << fmt::format(
      "[domain]\nspacing = \"10 nm\"\nextent = [\"{0} nm\", \"{0} nm\"]\n"
      "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
      "[[geometry]]\nshape = \"mask\"\nmaterial = \"resist\"\nthickness = \"20 nm\"\n"
      "resist = {{ shape = \"gds\", file = \"a.gds\", layer = 1 }}\n"
      "[[step]]\nmodel = \"planarise\"\nheight = \"1 um\"\n",
      10 * layout.cells);
  const std::string line = std::string(SCARP_BINARY) + " preview --threads 1 --quiet " +
                           (folder / "r.toml").string() + " -o " + (folder / "p").string();
  const double before = seconds_of_children();
  if (std::system(line.c_str()) != 0) throw std::runtime_error(layout.name + ": preview failed");
  return seconds_of_children() - before;
}

void run(const Settings& settings) {
  nlohmann::ordered_json json;
  bool is_slow = false;
  for (const Layout& layout : {squares(true), squares(false), discs()}) {
    double seconds = seconds_of_preview(layout);
    for (int n = 1; n < settings.repeats; ++n)
      seconds = std::min(seconds, seconds_of_preview(layout));
    is_slow = is_slow || seconds > most_seconds;
    json["seconds"][layout.name] = seconds;
    if (!settings.json) fmt::print("{:16} {:5.2f} s\n", layout.name, seconds);
  }
  if (settings.json) std::cout << json.dump(2) << '\n';
  if (is_slow) throw std::runtime_error("slower than the two seconds that previews may take");
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  const auto declare = [&](CLI::App& app) {
    app.add_option("--repeats", settings.repeats, "How often each is timed (3)")
        ->check(CLI::PositiveNumber);
    app.add_flag("--json", settings.json, "One object on standard output");
  };
  return scarp::bench::bench_main(argc, argv, "previews of layouts of many shapes", declare,
                                  [&] { scarp::bench::run(settings); });
}

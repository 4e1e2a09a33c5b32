#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>

#include "core/system/read_file.h"
#include "core/system/temporary_folder.h"

namespace scarp {

/// What a call of the program gave.
struct Outcome {
  int exit_code = 0;
  std::string out;
  std::string messages;
};

inline nlohmann::json json_of(const Outcome& outcome) { return nlohmann::json::parse(outcome.out); }

/// What the viewer of a page is told of its first scene.
inline nlohmann::json scene_description(const std::string& page) {
  const std::string begin = "<script type=\"application/json\">";
  const std::size_t from = page.find(begin) + begin.size();
  return nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
}

/// metrics.csv without the columns that hold wall times.
inline std::string metrics_without_times(const std::filesystem::path& file) {
  std::istringstream in(read_file(file));
  std::string kept;
  std::set<std::size_t> times;
  std::string line;
  for (bool head = true; std::getline(in, line); head = false) {
    std::istringstream cells(line);
    std::string cell;
    for (std::size_t column = 0; std::getline(cells, cell, ','); ++column) {
      if (head && cell.rfind("t_", 0) == 0) times.insert(column);
      if (!times.contains(column)) kept += cell + ',';
    }
    kept += '\n';
  }
  return kept;
}

/// Rows of metrics.csv with another first digit of the process time in one of them.
inline std::string with_other_digit(std::string rows, std::size_t row) {
  std::size_t place = 0;
  for (std::size_t n = 0; n < row; ++n) place = rows.find('\n', place) + 1;
  const std::size_t digit = rows.find(',', rows.find(',', place) + 1) + 1;
  rows[digit] = rows[digit] == '9' ? '8' : '9';
  return rows;
}

/// Calls the program as a user does, in a folder of its own.
class Program : public ::testing::Test {
 protected:
  Outcome scarp(const std::string& arguments) const {
    const std::filesystem::path messages = folder_ / "messages.txt";
    const std::string line =
        std::string(SCARP_BINARY) + " " + arguments + " 2>" + messages.string();
    FILE* pipe = popen(line.c_str(), "r");
    Outcome outcome;
    std::array<char, 4096> buffer{};
    for (std::size_t n = 0; (n = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
      outcome.out.append(buffer.data(), n);
    }
    outcome.exit_code = WEXITSTATUS(pclose(pipe));
    outcome.messages = read_file(messages);
    return outcome;
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  std::set<std::string> files(const std::string& name) const {
    std::set<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / name)) {
      found.insert(entry.path().filename().string());
    }
    return found;
  }

  nlohmann::json summary(const std::string& run) const {
    return nlohmann::json::parse(read_file(folder_ / run / "summary.json"));
  }

  void expect_same_bits(const std::string& run, const std::string& other) const {
    EXPECT_EQ(summary(run)["state_hash"], summary(other)["state_hash"]);
    EXPECT_EQ(metrics_without_times(folder_ / run / "metrics.csv"),
              metrics_without_times(folder_ / other / "metrics.csv"));
  }

  /// Arguments of a trench run that takes about a second.
  std::string small_trench(const std::string& more = "") const {
    return std::string(SCARP_SOURCE_DIR) +
           "/configs/trench_deposition.toml --set domain.spacing='\"0.4 um\"' "
           "--set domain.extent='[\"10 um\", \"2 um\"]' --set flux.target_error=0.1 "
           "--set step[0].duration='\"30 s\"' --set output.every='\"10 s\"' --quiet " +
           more;
  }

  /// Arguments of a run with neutrals and ions that takes about a second.
  std::string small_ion_etch(const std::string& more = "") const {
    return std::string(SCARP_SOURCE_DIR) +
           "/configs/ion_etch.toml --set domain.spacing='\"20 nm\"' --set flux.rays=20000 "
           "--set step[0].duration='\"30 s\"' --set output.every='\"10 s\"' --quiet " +
           more;
  }

  TemporaryFolder folder_;
};

/// A square pyramid without its base, as .obj; one more triangle on an edge makes it non-manifold.
inline constexpr const char* pyramid =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 0.5\n"
    "f 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";

}  // namespace scarp

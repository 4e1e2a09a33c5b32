#include "apps/run/own_files.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/printable.h"
#include "core/system/read_file.h"

namespace scarp {

namespace fs = std::filesystem;

std::vector<fs::path> find_files(const fs::path& folder, bool (*chosen)(const std::string& name)) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (chosen(entry.path().filename().string())) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

bool begins_with(const fs::path& file, const std::string& text) {
  return fs::exists(file) && read_file(file).starts_with(text);
}

void require_files(const fs::path& folder, bool (*chosen)(const std::string& name)) {
  for (const fs::path& each : find_files(folder, chosen)) {
    // Links are followed, also to a device.
    if (!fs::is_directory(each) && !fs::is_fifo(each) && !fs::is_socket(each)) continue;
    throw InputError(fmt::format(
        "{}: is {}, in the place of a file that will be written; move it away, or choose another "
        "folder with -o",
        shown(each), fs::is_directory(each) ? "a folder" : "a pipe"));
  }
}

void require_own(const fs::path& folder, const std::string& writer, bool has_mark,
                 bool (*is_output)(const std::string& name)) {
  require_files(folder, is_output);
  if (has_mark) return;
  const std::vector<fs::path> foreign = find_files(folder, is_output);
  if (foreign.empty()) return;
  throw InputError(
      fmt::format("{}: was not written by {}, and scarp never overwrites such a file; choose "
                  "another folder with -o, or move it away",
                  shown(foreign.front()), writer));
}

}  // namespace scarp

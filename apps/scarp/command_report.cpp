#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/report/report.h"
#include "apps/run/own_files.h"
#include "apps/scarp/commands.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/system/atomic_file.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

std::string page_of(const fs::path& folder) {
  if (fs::exists(folder / "metrics.csv")) return run_page(folder);
  if (fs::exists(folder / "compare.json")) return comparison_page(folder);
  throw InputError(fmt::format(
      "{}: is the folder neither of a run (metrics.csv) nor of a comparison (compare.json); make "
      "one with scarp run or scarp compare",
      shown(folder)));
}

}  // namespace

ExitCode execute(const ReportArguments& arguments, const CommonOptions& common) {
  const fs::path folder = arguments.folder;
  const fs::path file =
      arguments.output.empty() ? folder / report_file : fs::path(arguments.output);
  write_file(file, page_of(folder));
  if (common.json) {
    const nlohmann::ordered_json json{{"report", file.string()}, {"bytes", fs::file_size(file)}};
    std::cout << json.dump(2) << '\n';
  } else if (!common.quiet) {
    fmt::print("{}\n", shown(file));
  }
  return done;
}

}  // namespace scarp

#include <fmt/format.h>

#include <fstream>
#include <iostream>

#include "apps/report/report.h"
#include "apps/run/own_files.h"
#include "apps/run/restart.h"
#include "apps/run/tell.h"
#include "apps/scarp/attended_run.h"
#include "apps/scarp/commands.h"
#include "apps/simulator/recipe.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/system/atomic_file.h"

namespace scarp {

namespace {

// What a run wrote before it was resumed may be damaged since; the run itself does not need it.
void write_page_of(const std::filesystem::path& folder, const std::filesystem::path& page) {
  std::string text;
  try {
    text = run_page(folder);
  } catch (const InputError& error) {
    tell(fmt::format("warning: there is no {}: {}\n", shown(page.filename()), error.what()));
    return;
  }
  write_file(page, text);
}

// What was computed is there, whatever becomes of its pictures.
void write_page_of_complete_run(const std::filesystem::path& folder,
                                const std::filesystem::path& page) {
  try {
    write_page_of(folder, page);
  } catch (const NumericalError& error) {
    throw NumericalError(
        fmt::format("{}: the run is complete, but its report is not: {}; make it with: scarp "
                    "report {}",
                    shown(folder), error.what(), shown(folder)));
  }
}

}  // namespace

ExitCode execute(const RunArguments& arguments, const CommonOptions& common) {
  const Recipe recipe = read_runnable(arguments.recipe, arguments.set);
  const std::filesystem::path folder = arguments.result_folder();
  const AttendedOptions options{.resume = arguments.resume,
                                .quiet = common.quiet,
                                .memory_limit_mb = arguments.memory_limit_mb()};
  const RunEnd end = attended_run(recipe, folder, options);
  if (end == RunEnd::interrupted) {
    tell(fmt::format("interrupted; {}\n", how_to_go_on(folder)));
    return interrupted;
  }
  const std::filesystem::path page = folder / report_file;
  // A run that was complete stays as it is.
  if (end == RunEnd::complete || !std::filesystem::exists(page))
    write_page_of_complete_run(folder, page);
  if (common.json) {
    std::ifstream summary(folder / "summary.json");
    std::cout << summary.rdbuf();
  } else if (!common.quiet) {
    fmt::print(
        "{} in {}; look at profiles.svg, surface.pvd (ParaView) and metrology.csv, or at all of it "
        "in\n{}\n",
        end == RunEnd::was_complete ? "was complete" : "complete", shown(folder), shown(page));
  }
  return done;
}

}  // namespace scarp

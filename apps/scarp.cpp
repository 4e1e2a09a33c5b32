// The command line: reads it, runs one command, turns exceptions into messages and exit codes.

#include <fmt/format.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <new>

#include "apps/commands.h"
#include "core/error.h"
#include "core/parallel.h"

namespace scarp {

namespace {

std::atomic<bool> interrupt_flag{false};

void on_interrupt(int signal) {
  interrupt_flag = true;
  std::signal(signal, SIG_DFL);
}

void add_common_options(CLI::App& command, CommonOptions& common) {
  command.add_option("--threads", common.threads, "Number of threads (default: all cores)")
      ->check(CLI::PositiveNumber);
  command.add_flag("--quiet", common.quiet, "Only errors and results");
  command.add_flag("--json", common.json, "One JSON object on standard output, nothing else there");
}

int run_command_line(int argc, char** argv) {
  CLI::App app("scarp simulates the topography of wafers that are etched and coated.", "scarp");
  app.set_version_flag("--version", "scarp " SCARP_VERSION);
  app.require_subcommand(1);

  CommonOptions common;
  CommandAction action;
  add_run(app, common, action);
  add_check(app, common, action);
  add_preview(app, common, action);
  add_simplify(app, common, action);
  add_flux(app, common, action);
  add_distance(app, common, action);
  add_models(app, common, action);
  for (CLI::App* command : app.get_subcommands({})) add_common_options(*command, common);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? done : wrong_input;
  }
  const ThreadLimit limit(common.threads);
  const int code = action();
  // A result that did not reach its reader is no result.
  if (!std::cout.flush() || std::fflush(stdout) != 0) {
    throw NumericalError("standard output cannot be written");
  }
  return code;
}

}  // namespace

const std::atomic<bool>& interrupt_requested = interrupt_flag;

void add_recipe_arguments(CLI::App& command, RecipeArguments& arguments) {
  command.add_option("recipe", arguments.recipe, "Recipe file (.toml)")->required();
  command
      .add_option("--set", arguments.set,
                  "Change a value: PATH=VALUE, for example domain.spacing='\"0.4 um\"'")
      ->allow_extra_args(false);
}

std::filesystem::path result_folder(const std::string& recipe, const std::string& output) {
  if (!output.empty()) return output;
  return std::filesystem::path("results") / std::filesystem::path(recipe).stem();
}

}  // namespace scarp

int main(int argc, char** argv) {
  using namespace scarp;
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  try {
    return run_command_line(argc, argv);
  } catch (const InputError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return wrong_input;
  } catch (const NumericalError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return could_not_go_on;
  } catch (const std::filesystem::filesystem_error& error) {
    fmt::print(stderr, "{}: {}\n", error.path1().string(), error.code().message());
    return could_not_go_on;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "out of memory; use a coarser spacing or a smaller extent\n");
    return could_not_go_on;
  }
}

#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace scarp {

/// Exit codes, as the README lists them.
enum ExitCode {
  done = 0,
  check_failed = 1,
  wrong_input = 2,
  could_not_go_on = 3,
  interrupted = 130
};

/// Options that every command has.
struct CommonOptions {
  int threads = 0;
  bool quiet = false;
  bool json = false;
};

/// What the chosen command does; set by its callback, called once the command line is read.
using CommandAction = std::function<int()>;

/// Options of the commands that take a recipe.
struct RecipeArguments {
  std::string recipe;
  std::vector<std::string> set;
};

void add_recipe_arguments(CLI::App& command, RecipeArguments& arguments);

/// Where a recipe's files go: the folder of -o, or results/<recipe name>.
std::filesystem::path result_folder(const std::string& recipe, const std::string& output);

void add_run(CLI::App& app, const CommonOptions& common, CommandAction& action);
void add_check(CLI::App& app, const CommonOptions& common, CommandAction& action);
void add_preview(CLI::App& app, const CommonOptions& common, CommandAction& action);
void add_models(CLI::App& app, const CommonOptions& common, CommandAction& action);
void add_simplify(CLI::App& app, const CommonOptions& common, CommandAction& action);
void add_flux(CLI::App& app, const CommonOptions& common, CommandAction& action);
void add_distance(CLI::App& app, const CommonOptions& common, CommandAction& action);

/// Set by the first interrupt from the keyboard; the second ends the process at once.
extern const std::atomic<bool>& interrupt_requested;

}  // namespace scarp

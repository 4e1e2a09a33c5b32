#include "apps/scarp/command_line.h"

// The only source file that includes the parser: it takes seconds to compile.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "core/printable.h"
#include "core/suggestion.h"
#include "core/system/memory_amount.h"

namespace scarp {

namespace {

// Checks of our own: the parser's would print the range of a double, and accept the numbers behind
// the names of an enum.
CLI::Validator number(const std::string& wanted, bool (*is_wanted)(double)) {
  return {[=](const std::string& text) -> std::string {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && is_wanted(value)) return "";
            return '"' + text + "\" is not " + wanted;
          },
          ""};
}

CLI::Validator one_of(const std::array<std::string_view, 4>& names, const char* separator) {
  return {[=](std::string& name) -> std::string {
            if (std::ranges::find(names, name) != names.end()) return "";
            return fmt::format("\"{}\" is none of {}", name, fmt::join(names, separator));
          },
          ""};
}

CLI::Validator method() { return one_of({"curvature", "paper", "lindstrom-turk", "length"}, ", "); }
CLI::Validator modes() {
  return one_of({"3d,2d", "2d,3d", "3d,axisymmetric", "axisymmetric,3d"}, " | ");
}

/// Of every option that is a number: what is larger is a mistake, and squares of it overflow.
CLI::Validator moderate() {
  constexpr double largest = 1e12;
  return {[](const std::string& text) -> std::string {
            double value = 0;
            if (!CLI::detail::lexical_cast(text, value) || std::abs(value) <= largest) return "";
            return fmt::format("\"{}\" is too large: at most 1e12 makes sense here", text);
          },
          ""};
}

CLI::Validator above_zero() {
  return number("a number above 0", [](double x) { return x > 0; });
}
CLI::Validator not_negative() {
  return number("a number of 0 or more", [](double x) { return x >= 0; });
}
CLI::Validator probability() {
  return number("a number in [0, 1]", [](double x) { return x >= 0 && x <= 1; });
}
CLI::Validator fraction_to_remove() {
  return number("a number in [0, 1)", [](double x) { return x >= 0 && x < 1; });
}

/// Of a whole number above 0, which may be written 1e6.
CLI::Validator count() {
  constexpr double greatest = 9007199254740992;  // whole numbers are exact up to here
  return {[](std::string& text) -> std::string {
            double value = 0;
            const bool is_number = CLI::detail::lexical_cast(text, value);
            if (!is_number || !(value >= 1) || value > greatest || value != std::floor(value)) {
              return '"' + text + "\" is not a whole number above 0";
            }
            text = std::to_string(static_cast<long long>(value));
            return "";
          },
          ""};
}

/// Of an amount of memory, which becomes a number of bytes.
CLI::Validator memory_amount() {
  return {
      [](std::string& text) -> std::string {
        const auto bytes = parse_memory(text);
        if (!bytes) {
          return '"' + text +
                 "\" is not an amount of memory of 1 MB or more; write for example 512MB or 8GB";
        }
        text = std::to_string(*bytes);
        return "";
      },
      ""};
}

template <class T>
void add_choice(CLI::App& command, const std::string& option, const std::string& meaning, T& value,
                const std::map<std::string, T>& choices) {
  const auto choose = [&value, option, choices](const std::string& name) {
    const auto found = choices.find(name);
    if (found != choices.end()) {
      value = found->second;
      return;
    }
    std::vector<std::string> names;
    names.reserve(choices.size());
    for (const auto& [known, meant] : choices) names.push_back(known);
    throw CLI::ValidationError(option,
                               fmt::format("\"{}\" is none of {}", name, fmt::join(names, ", ")));
  };
  command.add_option_function<std::string>(option, choose, meaning)->type_name("NAME");
}

void add_common_options(CLI::App& command, CommonOptions& common) {
  command.add_option("--threads", common.threads, "Number of threads (default: all cores)")
      ->transform(count())
      ->check(number("4096 or less", [](double x) { return x <= 4096; }));
  command.add_flag("--quiet", common.quiet, "Print only results, warnings and errors");
  command.add_flag("--json", common.json,
                   "Print one JSON object on standard output and nothing else");
}

/// An empty name would be taken as none: a variable of a script that is not set.
void add_output(CLI::App& command, std::string& output, const char* meaning) {
  const CLI::Validator not_empty(
      [](const std::string& name) -> std::string {
        if (!name.empty()) return "";
        return "the name is empty; write one, for example -o results/trench, or leave -o out";
      },
      "");
  command.add_option("-o,--output", output, meaning)->check(not_empty);
}

void add_recipe_arguments(CLI::App& command, RecipeArguments& arguments) {
  command.add_option("recipe", arguments.recipe, "Recipe file (.toml)")->required();
  command
      .add_option("--set", arguments.set,
                  "Change a value: PATH=VALUE, for example domain.spacing='\"0.4 um\"'")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  add_output(command, arguments.output, "Result folder (default: results/<recipe name>)");
}

void add_memory_limit(CLI::App& command, MemoryArguments& arguments, const char* meaning) {
  command.add_option("--memory-limit", arguments.memory_limit, meaning)
      ->transform(memory_amount())
      ->type_name("AMOUNT");
}

void add_arguments(CLI::App& command, RunArguments& arguments) {
  add_recipe_arguments(command, arguments);
  command.add_flag("--resume", arguments.resume, "Continue from the last checkpoint in the folder");
  add_memory_limit(command, arguments,
                   "Stop a run that needs more, for example 8GB (default: what the machine has)");
}

void add_arguments(CLI::App& command, CheckArguments& arguments) {
  add_recipe_arguments(command, arguments);
  add_memory_limit(command, arguments,
                   "Report a run that needs more (default: what the machine has)");
}

void add_arguments(CLI::App& command, PreviewArguments& arguments) {
  add_recipe_arguments(command, arguments);
  add_memory_limit(command, arguments,
                   "Refuse a wafer that needs more (default: what the machine has)");
}

void add_arguments(CLI::App& command, SimplifyArguments& arguments) {
  SimplifyOptions& options = arguments.options;
  command.add_option("in", arguments.in, "Mesh: .obj .ply .stl .vtp")->required();
  command.add_option("out", arguments.out, "Result; the ending of its name selects the format")
      ->required();
  command
      .add_option("--method", arguments.method,
                  "curvature (default), paper, lindstrom-turk or length")
      ->check(method());
  command
      .add_option("--spacing", options.spacing,
                  "Grid spacing of the simulation that the mesh is from (default: estimated from "
                  "its edges)")
      ->check(above_zero());
  auto* remove = command.add_option("--remove", options.remove, "Fraction of vertices to remove")
                     ->check(fraction_to_remove());
  command.add_option("--vertices", options.vertices, "Number of vertices to keep")
      ->transform(count())
      ->excludes(remove);
  command
      .add_option("--max-error", options.max_error,
                  "Largest distance between the two surfaces, in the unit of the mesh (default: "
                  "0.1 spacings, or none if a number of vertices is given)")
      ->check(not_negative());
  command
      .add_option("--l0", options.l0,
                  "Shortest edge at features, in the unit of the mesh (default: 0.6 spacings)")
      ->check(not_negative());
  command
      .add_option(
          "--step-length", options.step_length,
          "Growth of the edge length per region, in the unit of the mesh (default: 2 spacings)")
      ->check(not_negative());
  command
      .add_option("--l-max", options.l_max,
                  "Longest edge in flat regions, in the unit of the mesh (default: any)")
      ->check(not_negative());
  command.add_option(
      "--curvature-threshold", options.curvature_threshold,
      "Mean curvature above which a vertex is a feature (default: estimated from the noise)");
  command.add_option(
      "--shape-weight", options.shape_weight,
      "Weight of good facet shapes against small distances, in squared spacings; for the method "
      "curvature (default: 4e-6, or 5e-6 if a number of vertices is given)");
}

void add_arguments(CLI::App& command, FluxArguments& arguments) {
  FluxOptions& options = arguments.options;
  command.add_option("mesh", arguments.mesh, "Mesh: .obj .ply .stl .vtp")->required();
  command.add_option("--sticking", arguments.sticking, "Sticking probability (default: 1)")
      ->check(probability());
  command
      .add_option("--source-power", arguments.source_power,
                  "Cosine power of the source (default: 1)")
      ->check(not_negative());
  add_choice(command, "--engine", "forward, gather or auto (default)", options.engine,
             {{"auto", FluxOptions::Engine::automatic},
              {"forward", FluxOptions::Engine::forward},
              {"gather", FluxOptions::Engine::gather}});
  auto* rays =
      command
          .add_option("--rays", options.rays,
                      "Fixed number of rays in place of a target. forward: particles from the "
                      "source, rounded up to batches of 32. gather: most rays of all facets "
                      "together; at least 4096, and 8 from each element of about two spacings")
          ->transform(count());
  command
      .add_option("--target-error", options.target_error,
                  "Add rays until the error is below this (default: 0.01)")
      ->check(above_zero())
      ->excludes(rays);
  command
      .add_option("--max-rays", options.max_rays,
                  "Most rays for the target, with the same least numbers as --rays: 32 (forward), "
                  "4096 in all and 8 from each element (gather) (default: 2^28)")
      ->transform(count());
  command.add_option(
      "--spacing", options.spacing,
      "Grid spacing of the simulation that the mesh is from; it sets the element size of gather "
      "(default: estimated from the facets, as if they were not simplified)");
  command.add_option("--seed", options.seed, "Seed of the random numbers (default: 1)")
      ->check(not_negative());
  add_choice(command, "--boundary", "reflective (default) or periodic sides", arguments.boundary,
             {{"reflective", Boundary::reflective}, {"periodic", Boundary::periodic}});
  add_output(command, arguments.output, "Flux per facet: .vtp or .csv");
}

void add_arguments(CLI::App& command, DistanceArguments& arguments) {
  command.add_option("a", arguments.a, "Mesh: .obj .ply .stl .vtp")->required();
  command.add_option("b", arguments.b, "Mesh to compare with")->required();
  add_output(command, arguments.output, "A with the distance to B at every vertex (.vtp)");
}

void add_arguments(CLI::App& command, MeasureArguments& arguments) {
  command
      .add_option("where", arguments.where,
                  "Result folders of runs, for their newest states, or states (.vdb)")
      ->required();
  command.add_flag("--all", arguments.all, "Measure all outputs of the result folders");
  command.add_option("-o,--output", arguments.output,
                     "CSV file for a table with one line per opening (default: standard output for "
                     "several states)");
  command.add_option(
      "--start", arguments.start,
      "State to compare masks and depths with (default: state_0000.vdb next to the state)");
  command
      .add_option("--mask", arguments.masks,
                  "Material that is a mask; repeat for several, or write none (default: "
                  "[metrology] of the recipe)")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command
      .add_option("--cd-at", arguments.cd_at,
                  "Height at which to measure widths, for example '-0.5 um'; repeat for several; z "
                  "= 0 is the surface of the wafer (default: [metrology] of the recipe)")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command
      .add_option("--angle-at", arguments.angle_at,
                  "Height at which to measure the angles of both walls; repeat for several (default: "
                  "[metrology] of the recipe)")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_arguments(CLI::App& command, SectionArguments& arguments) {
  command
      .add_option("where", arguments.where,
                  "Result folder of a run, with the surfaces of all its outputs, or a state (.vdb)")
      ->required();
  command.add_option("line", arguments.line,
                     "Where to cut: 'y = 0 nm' (default), 'x = 1 um' or 'from -1 um, 0 um to 1 um, "
                     "2 um'");
  add_output(command, arguments.output, "Writes OUTPUT.csv and OUTPUT.svg (default: section)");
}

void add_tolerances(CLI::App& command, Tolerances& allowed) {
  const auto add = [&](const char* option, const char* meaning, double& value) {
    command.add_option(option, value, fmt::format("{} (default: {:g})", meaning, value))
        ->check(not_negative());
  };
  add("--length-cells", "Allowed difference of widths and depths, in spacings",
      allowed.length_cells);
  add("--length-part", "In addition, this part of the value", allowed.length_part);
  add("--film-cells", "Allowed difference of films and step coverages, in spacings of thickness",
      allowed.film_cells);
  add("--film-part", "In addition, this part of the value", allowed.film_part);
  add("--volume-cells",
      "Allowed difference of volumes of materials, in spacings times the area of their surface",
      allowed.volume_cells);
  add("--volume-part", "In addition, this part of the value", allowed.volume_part);
  add("--mean-distance", "Mean distance between the surfaces, in spacings", allowed.mean_distance);
  add("--p99-distance", "Distance that 99 % of the places stay within, in spacings",
      allowed.p99_distance);
}

void add_arguments(CLI::App& command, CompareArguments& arguments) {
  command
      .add_option("recipe", arguments.recipe,
                  "Recipe (.toml) to run with and without simplification; or a result folder or a "
                  "state (.vdb), or several of different seeds, separated by commas")
      ->required();
  command.add_option("with", arguments.with,
                     "What to compare with: result folders or states, separated by commas, or a "
                     "contour (.csv with a header such as 'x [um],z [um]')");
  command.add_option("--seeds", arguments.seeds, "Runs of each variant (default: 3)")
      ->transform(count());
  command
      .add_option("--methods", arguments.methods,
                  "Simplification methods to compare with the full mesh, for example "
                  "paper,curvature (default: that of the recipe)")
      ->delimiter(',')
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->check(method());
  command
      .add_option(
          "--modes", arguments.modes,
          "Compare modes of the recipe instead, the reference first: 3d,2d or 3d,axisymmetric")
      ->check(modes())
      ->excludes("--methods");
  command.add_option("--line", arguments.line,
                     "Where a contour was measured (default: 'y = 0 nm')");
  command
      .add_option("--set", arguments.set,
                  "Change a value of the recipe: PATH=VALUE, for example "
                  "domain.spacing='\"0.4 um\"'")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  add_output(command, arguments.output,
             "Folder for compare.json, report.html and the runs (default: results/<recipe name>, "
             "or results/compare for given runs)");
  add_tolerances(command, arguments.tolerances);
}

void add_arguments(CLI::App& command, RenderArguments& arguments) {
  command
      .add_option("where", arguments.where,
                  "Result folder of a run, for its newest state, or a state (.vdb)")
      ->required();
  add_output(command, arguments.output, "Picture (default: picture.png)");
  command.add_option("--cut", arguments.cut,
                     "Cut the wafer open here and leave out what is in front: 'y = 0 nm' "
                     "(default), 'x = 1 um' or none");
  command
      .add_option("--azimuth", arguments.azimuth,
                  "Direction of the eye in degrees, from -y towards -x (default: 30)")
      ->check(number("a number", [](double x) { return std::isfinite(x); }));
  command
      .add_option("--elevation", arguments.elevation,
                  "Height of the eye in degrees, up to 90 (default: 35)")
      ->check(number("a number above 0 and up to 90", [](double x) { return x > 0 && x <= 90; }));
  command
      .add_option(
          "--width", arguments.width,
          "Width in pixels (default: 1200); less if the picture would be more than twice as high")
      ->check(number("a number of 16 to 16384", [](double x) { return x >= 16 && x <= 16384; }));
}

void add_arguments(CLI::App& command, ReportArguments& arguments) {
  command.add_option("folder", arguments.folder, "Result folder of a run or of a comparison")
      ->required();
  add_output(command, arguments.output, "Page (default: report.html in the folder)");
}

void add_arguments(CLI::App& command, BaselineArguments& arguments) {
  const auto choose = [&arguments](const std::string& action) {
    if (action != "create" && action != "check")
      throw CLI::ValidationError("action",
                                 fmt::format("\"{}\" is neither create nor check", action));
    arguments.creates = action == "create";
  };
  command.add_option_function<std::string>("action", choose, "create or check")->required();
  command.add_option("suite", arguments.suite, "Folder of recipes (.toml)")->required();
  command
      .add_option("--seeds", arguments.seeds,
                  "Runs of each recipe from which create derives tolerances (default: 7)")
      ->transform(count());
  command.add_option("--set", arguments.set, "Change a value of all recipes: PATH=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  add_output(command, arguments.output,
             "Folder for the runs and report.html (default: results/<suite name>)");
}

void add_arguments(CLI::App& command, VolumeArguments& arguments) {
  command
      .add_option("where", arguments.where,
                  "Result folder of a run, for its newest state, or a state (.vdb)")
      ->required();
  add_output(
      command, arguments.output,
      "All materials in one mesh with shared interfaces: .msh (gmsh 4.1) .smesh (tetgen) .vtu; "
      "or NAME_MATERIAL.ENDING for each material: .stl .obj .ply .vtp (default: volume.stl)");
  command.add_option("--bottom", arguments.bottom,
                     "Height at which the wafer ends, for example '-2 um' (default: ten spacings "
                     "below its lowest point)");
  command.add_flag("--gas", arguments.gas, "The gas above is a region, too, and closed voids are");
  command
      .add_option("--top", arguments.top,
                  "Height at which the gas ends (default: ten spacings above the highest point)")
      ->needs("--gas");
  command.add_option("--size", arguments.size,
                     "Length of edges where the surface is flat, for example '40 nm' (default: "
                     "four spacings)");
  command.add_flag("--tetrahedra", arguments.tetrahedra,
                   "Fill the regions with tetrahedra, by tetgen or gmsh: .msh .vtu");
}

void add_arguments(CLI::App& command, ModelsArguments& arguments) {
  command.add_option("name", arguments.name, "Print the reference page of this model");
}

/// Declares a command; the arguments live as long as the parser.
template <class Arguments>
void add_command(CLI::App& app, const char* name, const char* summary, CommandLine& line) {
  CLI::App* command = app.add_subcommand(name, summary);
  const auto arguments = std::make_shared<Arguments>();
  add_arguments(*command, *arguments);
  for (CLI::Option* const option : command->get_options())
    if (option->get_type_name().find("FLOAT") != std::string::npos) option->check(moderate());
  add_common_options(*command, line.common);
  command->callback([&line, arguments] { line.command = *arguments; });
}

/// The parser would only say that a command is missing.
void check_command_name(const CLI::App& app, const std::string& name) {
  if (name.empty() || name[0] == '-') return;
  std::vector<std::string> commands;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (command->get_name() == name) return;
    commands.push_back(command->get_name());
  }
  throw CLI::ExtrasError(fmt::format("\"{}\" is not a command{}; the commands are {}", name,
                                     suggestion(name, commands), fmt::join(commands, ", ")),
                         CLI::ExitCodes::ExtrasError);
}

std::vector<std::string> long_options(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back(name);
  return names;
}

/// The first long option among words that the parser did not know.
std::optional<std::string> unknown_option(std::span<const std::string> words) {
  for (const std::string& word : words)
    if (word.starts_with("--") && word.size() > 2) return word.substr(2, word.find('=') - 2);
  return std::nullopt;
}

/// The parser would only say that something was not expected, or miss what the option took.
void check_option_names(const CLI::App& app) {
  for (const CLI::App* command : app.get_subcommands()) {
    const auto name = unknown_option(command->remaining());
    if (!name) continue;
    const std::string nearest = nearest_name(*name, long_options(*command));
    throw CLI::ExtrasError(
        fmt::format("--{} is not an option of {}{}", *name, command->get_name(),
                    nearest.empty() ? "" : fmt::format(" (did you mean --{}?)", nearest)),
        CLI::ExitCodes::ExtrasError);
  }
}

/// The parser would only say that a command is missing, or what was not expected.
void check_option_before_command(const CLI::App& app, const std::string& word) {
  const auto name = unknown_option(std::span(&word, 1));
  if (!name || std::ranges::count(long_options(app), *name) > 0) return;
  throw CLI::ExtrasError(
      fmt::format("--{} stands before the command: write scarp COMMAND ... --{}", *name, *name),
      CLI::ExitCodes::ExtrasError);
}

/// What the parser says, on one line, with what it repeats of the command line cut short.
std::string failure_text(std::string said, std::span<char* const> words) {
  for (const std::string word : words) {
    const std::string short_word = repeated(word);
    if (short_word == word) continue;
    for (std::size_t at = 0; (at = said.find(word, at)) != std::string::npos;
         at += short_word.size())
      said.replace(at, word.size(), short_word);
  }
  return one_line(said) + "\nRun with --help for more information.\n";
}

/// Throws: CLI::ParseError, also where help is asked for.
void parse(CLI::App& app, int argc, char** argv) {
  if (argc > 1) {
    check_command_name(app, argv[1]);
    check_option_before_command(app, argv[1]);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success&) {
    throw;
  } catch (const CLI::ParseError&) {
    check_option_names(app);
    throw;
  }
}

}  // namespace

std::variant<CommandLine, ExitCode> read_command_line(int argc, char** argv) {
  CLI::App app("scarp simulates the topography of wafers that are etched and coated.", "scarp");
  app.set_version_flag("--version", "scarp " SCARP_VERSION);
  app.require_subcommand(1);
  app.failure_message(
      [words = std::span<char* const>(argv, static_cast<std::size_t>(argc))](
          const CLI::App*, const CLI::Error& error) { return failure_text(error.what(), words); });

  CommandLine line;
  add_command<RunArguments>(app, "run", "Run a recipe", line);
  add_command<CheckArguments>(app, "check",
                              "Check a recipe and print it with every default and its cost", line);
  add_command<PreviewArguments>(app, "preview",
                                "Write the start geometry of a recipe, without running it", line);
  add_command<SimplifyArguments>(app, "simplify", "Reduce a surface mesh by edge collapse", line);
  add_command<FluxArguments>(app, "flux", "Compute the flux on a mesh, relative to the source",
                             line);
  add_command<DistanceArguments>(app, "distance", "Measure the distance between two surfaces",
                                 line);
  add_command<MeasureArguments>(
      app, "measure", "Measure depths, widths, films and voids of a run or a state", line);
  add_command<SectionArguments>(
      app, "section", "Cut a run or a state along any line; write a picture and its points", line);
  add_command<CompareArguments>(
      app, "compare",
      "Compare a recipe with and without simplification, 2D with 3D, or two runs; give a verdict",
      line);
  add_command<BaselineArguments>(app, "baseline",
                                 "Store the results of recipes, and report when they change", line);
  add_command<ReportArguments>(
      app, "report", "Write a run or a comparison as one page: 3D view, sections, numbers", line);
  add_command<RenderArguments>(app, "render", "Draw a run or a state in 3D, cut open (.png)", line);
  add_command<VolumeArguments>(
      app, "volume", "Write each material of a run or a state as a closed surface, for other tools",
      line);
  add_command<ModelsArguments>(
      app, "models", "List the process models with their parameters, units and sources", line);
  try {
    parse(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? done : wrong_input;
  }
  return line;
}

}  // namespace scarp

#pragma once

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "apps/report/comparison.h"
#include "core/frame.h"
#include "core/system/peak_memory.h"
#include "flux/solve.h"
#include "mesh/simplify/simplify.h"

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
  int threads = 0;  ///< 0: all cores
  bool quiet = false;
  bool json = false;
};

/// Options of the commands that take a recipe.
struct RecipeArguments {
  std::string recipe;
  std::vector<std::string> set;  ///< PATH=VALUE, VALUE in TOML
  std::string output;            ///< result folder; empty: results/<recipe name>

  std::filesystem::path result_folder() const {
    if (!output.empty()) return output;
    return std::filesystem::path("results") / std::filesystem::path(recipe).stem();
  }
};

/// Options of the commands that refuse a recipe for the memory it takes.
struct MemoryArguments {
  std::uint64_t memory_limit = 0;  ///< bytes; 0: what the machine has

  double memory_limit_mb() const {
    return memory_limit > 0 ? static_cast<double>(memory_limit) / (1024 * 1024)
                            : available_memory_mb();
  }
};

struct RunArguments : RecipeArguments, MemoryArguments {
  bool resume = false;
};

struct CheckArguments : RecipeArguments, MemoryArguments {};

struct PreviewArguments : RecipeArguments, MemoryArguments {};

struct SimplifyArguments {
  std::string in;
  std::string out;
  std::string method = "curvature";
  SimplifyOptions options;
};

struct FluxArguments {
  std::string mesh;
  std::string output;
  double sticking = 1;
  double source_power = 1;
  Boundary boundary = Boundary::reflective;
  FluxOptions options;
};

struct DistanceArguments {
  std::string a;
  std::string b;
  std::string output;
};

struct MeasureArguments {
  std::vector<std::string> where;  ///< result folders and states
  bool all = false;                ///< outputs of the folders
  std::string output;              ///< a CSV file; empty for standard output
  std::string start;
  std::vector<std::string> masks;
  std::vector<std::string> cd_at;     ///< heights with their units
  std::vector<std::string> angle_at;  ///< likewise
};

struct SectionArguments {
  std::string where;  ///< a result folder or a state
  std::string line = "y = 0 nm";
  std::string output = "section";  ///< without an ending
};

struct VolumeArguments {
  std::string where;  ///< a result folder or a state
  std::string output = "volume.stl";
  std::string bottom;  ///< a height with its unit; empty: below the wafer
  // Of all regions in one mesh:
  bool gas = false;
  std::string top;   ///< where the gas ends, likewise; empty: above the wafer
  std::string size;  ///< of edges, a length; empty: four spacings
  bool tetrahedra = false;
};

struct RenderArguments {
  std::string where;  ///< a result folder or a state
  std::string output = "picture.png";
  std::string cut = "y = 0 nm";
  double azimuth = 30;    ///< degrees
  double elevation = 35;  ///< degrees
  int width = 1200;       ///< pixels
};

struct ReportArguments {
  std::string folder;
  std::string output;  ///< empty: report.html in the folder
};

struct BaselineArguments {
  bool creates = false;  ///< else it checks
  std::string suite;
  int seeds = 7;
  std::vector<std::string> set;
  std::string output;
};

struct CompareArguments : RecipeArguments {
  std::string with;  ///< what the run or state in place of a recipe is compared with
  int seeds = 3;
  std::vector<std::string> methods;
  std::string modes;              ///< for example "3d,2d"; empty: full and simplified meshes
  std::string line = "y = 0 nm";  ///< where a contour was measured
  Tolerances tolerances;
};

struct ModelsArguments {
  std::string name;
};

struct CommandLine {
  CommonOptions common;
  std::variant<RunArguments, CheckArguments, PreviewArguments, SimplifyArguments, FluxArguments,
               DistanceArguments, MeasureArguments, SectionArguments, CompareArguments,
               BaselineArguments, VolumeArguments, RenderArguments, ReportArguments,
               ModelsArguments>
      command;
};

/// The command line in plain values. Help and mistakes are printed here: then the result is the
/// exit code.
std::variant<CommandLine, ExitCode> read_command_line(int argc, char** argv);

}  // namespace scarp

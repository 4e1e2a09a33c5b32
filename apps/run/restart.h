#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/run/metrics_rows.h"
#include "apps/simulator/recipe.h"
#include "apps/simulator/state.h"
#include "core/log.h"
#include "levelset/metrology/opening_names.h"

namespace scarp {

/// The checkpoint between outputs, and the one before it; those at outputs are numbered.
inline constexpr const char* interrupted_state = "state_interrupted.vdb";
inline constexpr const char* earlier_interrupted_state = "state_interrupted_before.vdb";

/// The name of a file of an output: STEM_NNNN.ENDING, with more digits only from 10000 on.
std::string numbered(const std::string& stem, int number, const std::string& ending);

/// The number in such a name; nothing of any other, as a user's own surface_scan.vtp.
std::optional<int> output_number(const std::string& name, const std::string& stem,
                                 const std::string& ending);

/// What a run has written by the time of a checkpoint.
///
/// Units: s.
struct WrittenSoFar {
  std::vector<double> output_times;
  std::string rows_hash;  ///< of the rows of metrics.csv, each with its end of line
  std::map<std::string, std::string> hashes;  ///< of files of outputs, by their names
  OpeningNames openings;                      ///< at the last output
};

/// Where a run can go on: the state, the file it is from, what was written up to there.
struct Restart {
  State state;
  std::filesystem::path file;
  WrittenSoFar written;
};

/// Writes a checkpoint that holds everything the run depends on, with the recipe's hash.
///
/// Throws: as AtomicFile.
void write_restart(const std::filesystem::path& file, const State& state,
                   const WrittenSoFar& written, const Recipe& recipe);

/// The newest of the checkpoints from which a run of the recipe can go on; empty if there is none.
///
/// One that cannot be read, is of another recipe, or whose time steps have no rows in metrics.csv
/// or others than when it was written is passed over, with a warning: an earlier one leads to
/// the same bits. Without rows none are asked for.
std::optional<Restart> newest_restart(std::span<const std::filesystem::path> checkpoints,
                                      const std::optional<MetricsRows>& rows,
                                      const std::string& recipe_hash, const Log& log);

/// read_recipe() for recipes that may start from a state.
Recipe read_runnable(const std::filesystem::path& file, const std::vector<std::string>& overrides);

/// What a checkpoint says of the wafer alone, to measure and to draw it without its recipe.
///
/// Units: s.
struct SavedWafer {
  Layers layers;
  Materials materials;  ///< those built in, and those of the layers
  double time = 0;
  MetrologyOptions metrology{};
  OpeningNames openings{};  ///< those of the run so far
};

/// Materials that are known already keep their numbers, so that wafers can be compared.
///
/// Throws: InputError if it is not a checkpoint of a run.
SavedWafer read_wafer(const std::filesystem::path& file, Materials known = {});

/// The states in the folder of a run, the newest last.
std::vector<std::filesystem::path> states_of(const std::filesystem::path& folder);

/// The newest state in the folder of a run; a state itself.
///
/// Throws: InputError if the folder holds none.
std::filesystem::path newest_state(const std::filesystem::path& where);

}  // namespace scarp

#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "apps/run/metrology_files.h"
#include "apps/run/restart.h"
#include "apps/run/result_files.h"
#include "apps/simulator/flux_target.h"
#include "apps/simulator/simulator.h"
#include "core/log.h"
#include "core/system/folder_lock.h"
#include "core/system/hash.h"
#include "levelset/metrology/metrology.h"

namespace scarp {

/// Whether a run writes a file of that name into its folder.
bool is_result(const std::string& name);

/// What a complete run of the same recipe lacks of what it wrote, a line each: files that are
/// missing, rows of metrics.csv that were changed. Nothing where a folder holds no such run.
std::optional<std::vector<std::string>> losses_of_complete_run(const std::filesystem::path& folder,
                                                               const Recipe& recipe);

/// The folder that a run writes, see the README's table of files. Held by one process at a time.
///
/// Files appear whole or not at all; metrics.csv grows by whole lines. What somebody puts in their
/// place meanwhile is set aside, and metrics.csv and recipe.toml are written anew.
/// Throws: InputError when the folder cannot be made or written, or another process holds it;
///         NumericalError when the disk is full, or the folder was removed in the meantime.
class ResultFolder {
 public:
  /// The recipe has to outlive it.
  ResultFolder(std::filesystem::path folder, const Recipe& recipe);

  const std::filesystem::path& path() const { return path_; }

  /// Removes what an earlier run left, logs that, and starts anew.
  ///
  /// Throws: InputError when the folder holds no run, but a file that a run would replace.
  void start(const Log& log);

  /// Reads the newest checkpoint that is whole and drops the rows of what came after it; files of
  /// later outputs stay until they are written again. A recipe and rows of metrology that are lost
  /// are written again. Logs where the run continues and what it passed over.
  /// Empty when there is no checkpoint.
  ///
  /// Throws: InputError when the folder holds a run of another recipe, or only damaged checkpoints.
  std::optional<State> resume(const Log& log);

  /// The number of outputs so far; the next one gets this number.
  int output_count() const { return static_cast<int>(written_.output_times.size()); }

  /// surface_NNNN.vtp, surface.pvd, what Sections writes, lines of metrology.csv and
  /// state_NNNN.vdb.
  void write_output(const State& state, const Survey& survey);

  /// A checkpoint between outputs; the one before it is kept.
  void write_checkpoint(const State& state);

  /// The newest checkpoint that was written or read; empty before the first.
  const std::filesystem::path& last_checkpoint() const { return last_checkpoint_; }

  /// One line of metrics.csv: the state after the time step, which belonged to the given step.
  void append_metrics(const State& after, std::size_t step, const Survey& survey, const Move& move);

  /// summary.json; marks the run as complete. Returns what it says of the run.
  RunTotals write_summary(const State& state, const Survey& survey, const StageTimer& total,
                          double wall_seconds);

 private:
  /// True when a run has begun here: its metrics.csv is there from the first moment to the last.
  bool holds_run() const;
  /// Of the files of the newest output, but the state.
  void add_hashes();
  /// Throws: InputError when there is the recipe of another run.
  void require_same() const;
  void require_not_start() const;
  std::filesystem::path file(const std::string& name) const { return path_ / name; }

  template <class Write>
  void while_held(const Write& write) const;
  void set_aside(const std::filesystem::path& strange, const char* how) const;
  void set_strange_files_aside() const;
  void keep_metrics() const;
  Sections& sections();
  /// Of a whole wafer, compared with the start of the recipe, by the openings known before.
  Metrology measure(const Layers& layers, const OpeningNames& known, bool feet_are_rounded);
  void tell_lost_files() const;
  void tell_unresolved(const Metrology& before, double time);
  void tell_rounded_feet() const;
  void restore_rows(std::span<const std::string> kept, const State& state);
  void restore_metrology();
  void write_state(const std::string& name, const State& state);

  std::filesystem::path path_;
  FolderLock lock_;
  const Recipe& recipe_;
  MetrologyColumns columns_;
  WrittenSoFar written_;        ///< but the hash of rows, which runs on
  Hash rows_hash_;              ///< of the rows of metrics.csv so far
  std::string metrics_;         ///< metrics.csv so far
  std::string metrology_rows_;  ///< metrology.csv so far
  std::optional<Metrology> start_;
  std::optional<Metrology> newest_;  ///< of the last output that was written
  std::set<int> unresolved_;         ///< openings that were reported
  std::optional<Sections> sections_;
  std::filesystem::path last_checkpoint_;
  Log log_;
};

/// Writes the files of an output into a folder that goes at once, to see how long it takes.
void write_trial_output(const State& state, const Survey& survey, const Recipe& recipe);

}  // namespace scarp

#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "apps/run/common_openings.h"
#include "apps/run/metrology_files.h"
#include "apps/run/restart.h"
#include "core/stage_timer.h"
#include "levelset/metrology/cross_section.h"

namespace scarp {

/// What a run took, from its metrics.csv: means over its time steps, sums of seconds and rays.
struct RunCost {
  double time_steps = 0;
  double facets_full = 0;
  double facets = 0;
  double rays = 0;
  double segments = 0;
  StageTimer stages{};

  double seconds() const;
};

/// An output of a run. Units: s of process time.
struct RunOutput {
  double time = 0;
  std::filesystem::path state;
  std::filesystem::path surface;  ///< with the flux; empty where there is none
};

/// What a finished run left, or a single state.
struct RunRecord {
  std::filesystem::path where;
  std::vector<RunOutput> outputs;
  std::optional<RunCost> cost{};
  bool is_state = false;       ///< a single one
  bool is_complete = true;     ///< has come to its end; a state is as it is
  bool has_condition = false;  ///< of a complete run: an end condition, not a time, ended a step

  double end() const { return outputs.back().time; }
};

/// What to say of a run that has not come to its end; empty of others.
std::string incomplete_warning(const RunRecord& run);

/// The summary.json of a run; empty while it is not complete, and if the file is of another recipe
/// than the recipe.toml beside it.
nlohmann::ordered_json read_summary(const std::filesystem::path& folder);

/// Refuses a summary.json with entries that are not as scarp run writes them.
[[noreturn]] void refuse_summary(const std::filesystem::path& file);

/// Throws: InputError if it is neither.
RunRecord read_run(const std::filesystem::path& where);

/// What is compared of an output: metrology against the start of its run, the whole surface, and
/// the exposed one in the middle of the domain.
struct Snapshot {
  Frame frame;
  std::vector<MetrologyValue> values;
  std::vector<OpeningPlace> openings;
  TriMesh surface;
  std::vector<Polyline> profile;
};

/// Reads the outputs of one run; refers to it, and to the openings of all runs if they are to have
/// common numbers.
class SnapshotReader {
 public:
  explicit SnapshotReader(const RunRecord& run, CommonOpenings* common = nullptr)
      : run_(run), common_(common) {}

  /// Materials keep the numbers that they have already. One that is gone has a volume of 0.
  Snapshot read(std::size_t output, Materials& materials);

 private:
  Metrology measured(const SavedWafer& wafer, Materials& materials);

  const RunRecord& run_;
  CommonOpenings* common_;
  std::map<int, int> numbers_;  ///< common ones by those of the run
  std::optional<Metrology> start_;
  std::set<MaterialId> seen_;  ///< materials
};

}  // namespace scarp

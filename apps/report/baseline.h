#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/report/comparison.h"

namespace scarp {

// What a recipe gave at some time, kept to notice when it gives something else.

/// A stored value. Units: as its name says.
struct BaselineValue {
  std::string name;
  double value = 0;      ///< mean over seeds
  double tolerance = 0;  ///< of a single run
};

/// An output. Units: s; nm; the distance, in spacings, is allowed between the stored profile and
/// that of another run, as mean over places.
struct BaselineOutput {
  double time = 0;
  std::vector<BaselineValue> values;
  std::vector<Polyline> profile;
  double profile_distance = 0;
};

struct Baseline {
  int seeds = 0;
  double spacing = 0;  ///< nm
  std::vector<BaselineOutput> outputs;
};

/// Metrology of a run of each seed: of widths, depths, films and coverages the mean, and as
/// tolerance 0.02 spacings and what chance makes of a single run: three standard errors of the
/// spread of the seeds, in the sense of Student. Of the time itself, that an end condition may
/// move, one per cent and the same chance. The profile is that of the first seed.
Baseline make_baseline(const std::vector<RunRecord>& seeds);

/// Writes and reads it as JSON.
///
/// Throws: InputError if it cannot be read or is none.
void write_baseline(const std::filesystem::path& file, const Baseline& baseline);
Baseline read_baseline(const std::filesystem::path& file);

/// A run against its baseline, which is the first group of the comparison.
Comparison check(const Baseline& baseline, const RunRecord& run);

}  // namespace scarp

#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "apps/run/picture.h"
#include "apps/simulator/flux_target.h"
#include "apps/simulator/section.h"
#include "apps/simulator/simplify_choice.h"
#include "apps/simulator/simulator.h"

namespace scarp {

// What the single files of a result folder hold, see the README's table; ResultFolder decides when
// they are written.
//
// All throw InputError when a file cannot be made and NumericalError when the disk is full.

/// The surface with material, flux, its standard error and speed of every facet, as .vtp.
void write_surface(const std::filesystem::path& file, const State& state, const Survey& survey,
                   const ProcessStep& step, const Materials& materials);

/// The cross-sections of a run: through the middle of the domain across y, and those of the
/// recipe; with the surfaces of earlier outputs.
///
/// Shape: earlier has the surfaces of each section, in the order of the sections.
class Sections {
 public:
  /// Of a run on this frame with these lines; the names of its materials have to outlive it.
  Sections(const Frame& frame, std::span<const SectionLine> lines, const Materials& materials);

  std::size_t size() const { return lines_.size(); }

  /// Remembers an output for the pictures of later ones.
  void add(double time, const Layers& layers);

  /// Writes profile_NNNN.csv and .svg and profiles.svg of the middle; section_K_NNNN.csv and .svg
  /// and section_K.svg of the others, from 1. The pictures are titled "TITLE: y = 0 nm, MOMENT".
  ///
  /// Shape: layers are those of the whole wafer.
  void write(const std::filesystem::path& folder, int number, double time, const Layers& layers,
             const std::string& title, const std::string& moment);

 private:
  const Materials& materials_;
  std::vector<SectionLine> lines_;
  std::vector<std::vector<EarlierSurface>> earlier_;
};

/// In or after which step a state is, as pictures say it: several may be at one time.
std::string moment_of(const State& state, std::span<const ProcessStep> steps);

/// The names of all files that Sections writes for so many sections besides that through the
/// middle.
std::vector<std::string> section_files(std::size_t section_count, int output_count);

/// The first line of metrics.csv; new columns come before the last one, which ends whole rows.
///
/// voids are those at the beginning of the time step, as the facets are; islands what it cut off.
std::string metrics_head(std::span<const ProcessStep> steps, const Simplification& simplification);

/// A line of metrics.csv: the state after the time step, which belonged to the given step.
std::string metrics_row(const State& after, std::size_t step, const Survey& survey,
                        const Move& move, std::span<const ProcessStep> steps,
                        const Simplification& simplification);

/// What a run has written and how long it took. Units: s.
struct RunTotals {
  std::vector<double> output_times;
  std::string rows_hash;  ///< see write_restart()
  FluxTarget flux;
  LeftOutCount left_out;
  StageTimer stages;
  double wall_seconds = 0;
};

/// The content of summary.json.
std::string summary_text(const State& state, const Survey& survey, const Metrology& metrology,
                         const Recipe& recipe, const RunTotals& totals);

/// What a recipe's first time step starts from, its surface, the voids in it, and what was left out
/// because nothing joins it to the wafer.
struct Preview {
  Layers layers;
  TriMesh surface;
  std::vector<Region> voids;
  RemovedSolid islands;
  std::vector<double> volumes;  ///< of each layer, nm^3
};

/// Writes the start geometry (see prepared_state) as preview.vtp, preview.csv and preview.svg; what
/// a run left in the folder stays.
///
/// Throws: InputError where the folder cannot be locked, or has files of these names that no
/// preview
///         has written.
Preview write_preview(const std::filesystem::path& folder, const Recipe& recipe);

}  // namespace scarp

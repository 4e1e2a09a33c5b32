#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/run/run_record.h"
#include "mesh/distance.h"

namespace scarp {

// Two groups of runs side by side: the first is the reference, the runs of a group differ in their
// seeds alone. docs/compare.md has the rules and their reasons.

/// How far they may differ. Units: grid spacings; parts of the value of the reference.
struct Tolerances {
  double length_cells = 0.25;  ///< widths, depths and heights
  double length_part = 0.01;
  double film_cells = 0.1;  ///< thicknesses, and what they make of coverages
  double film_part = 0.02;
  double volume_cells = 0.1;  ///< times the area of the material's surface
  double volume_part = 0.02;
  double mean_distance = 0.2;
  double p99_distance = 0.75;
};

/// Runs that differ in their seeds alone.
struct RunGroup {
  std::string name;
  std::vector<RunRecord> runs;
};

/// Of a value over the seeds of a group.
struct Sample {
  std::size_t count = 0;
  std::size_t stand_ins = 0;  ///< of runs without the opening
  double mean = 0;
  std::optional<double> spread{};  ///< standard deviation; nothing of a single run
};

enum class Verdict {
  none,    ///< no tolerance is stated
  within,  ///< the tolerance
  noise,   ///< beyond it, but seeds explain it: more of them would tell
  moved    ///< beyond it, and beyond what seeds explain
};

/// What chance has to do with a difference.
struct Significance {
  /// How often seeds alone make it as large; nothing where each group has one run alone.
  std::optional<double> chance{};
  /// Chance does not explain it, with all others that are looked at. Of single runs every
  /// difference beyond rounding. Nothing where there is no tolerance.
  std::optional<bool> is_significant{};
};

/// A value at one time. Units: as its name says.
struct ComparedValue {
  double time = 0;
  std::string name;
  Sample first{};
  Sample second{};
  std::optional<double> difference{};  ///< second less first, where both have it
  std::optional<double> std_error{};
  std::optional<double> tolerance{};
  Significance significance{};
  Verdict verdict = Verdict::none;
};

/// How far the surfaces are from each other at one time: means over pairs of runs. Units: spacings.
struct ComparedDistance {
  double time = 0;
  DistanceStatistics forward;                         ///< from the first to the second
  DistanceStatistics reverse;                         ///< and back
  std::optional<DistanceStatistics> between_seeds{};  ///< of the same group
  double mean_tolerance = 0;
  double p99_tolerance = 0;  ///< 0 where there is no verdict
  Significance mean_significance{};
  Significance p99_significance{};
  Verdict mean_verdict = Verdict::none;
  Verdict p99_verdict = Verdict::none;

  /// The way on which it is larger.
  double worst(double DistanceStatistics::*member) const {
    return std::max(forward.*member, reverse.*member);
  }
};

/// The flux along the profile in the middle of the domain, in pieces of two spacings.
///
/// Shape: an entry per piece. Units: nm along the profile; relative to an open flat wafer.
struct ComparedFlux {
  double time = 0;
  std::string name;
  std::vector<double> place{};
  std::vector<double> first{};
  std::vector<double> second{};
  double rms_difference = 0;
  double max_difference = 0;
  std::optional<double> rms_std_error{};  ///< what seeds alone would make of rms_difference
};

/// The exposed surfaces of the first runs in the middle of the domain. Units: nm, s.
struct ComparedProfile {
  double time = 0;
  std::vector<Polyline> first;
  std::vector<Polyline> second;
};

/// What a group takes to have the noise of the first one at the end: its flux as much longer as its
/// variance is larger, what else it does as long as it took.
///
/// Noise is the mean distance between surfaces of two seeds. What the mean distance between the
/// groups has besides, in squares, is systematic, and no rays change it. Units: s; spacings.
struct EqualError {
  double first_seconds = 0;
  double second_seconds = 0;
  double first_noise = 0;
  double second_noise = 0;
  double systematic = 0;
  double speedup = 0;
  std::optional<double> speedup_std_error{};  ///< from three seeds of each on
};

struct Comparison {
  std::string first;
  std::string second;
  double spacing = 0;                      ///< nm
  std::vector<std::string> warnings{};     ///< of runs that are not complete or end apart
  std::string ends_apart{};                ///< when each ends, where the ends are not compared
  std::optional<Tolerances> tolerances{};  ///< nothing where each value brings its own
  std::vector<ComparedValue> values{};
  std::vector<ComparedDistance> distances{};
  std::vector<ComparedFlux> fluxes{};
  std::vector<ComparedProfile> profiles{};
  std::vector<RunCost> first_costs{};
  std::vector<RunCost> second_costs{};
  std::optional<double> speedup{};  ///< of all stages together, without files and metrology
  std::optional<double> speedup_std_error{};
  std::optional<EqualError> equal_error{};

  bool reaches_ends() const { return ends_apart.empty(); }
  /// Whether anything differs by more than chance explains, within its tolerance or not.
  bool is_significant() const;
  /// What fails it, a line each.
  std::vector<std::string> moved() const;
  bool passed() const { return moved().empty(); }
};

/// Which outputs of each run are compared with each other: those at one process time, the first
/// with the first where several are, and the ends if they are at one time, too. Single states, and
/// runs that end conditions ended, are compared at their ends whatever their times.
std::vector<std::vector<std::size_t>> common_outputs(std::span<const RunRecord* const> runs);

/// Compares two groups at their common outputs.
///
/// A value has moved where its means differ by more than the tolerance and by more than chance
/// explains: by Student's distribution of the difference by its standard error, which is that of
/// the spreads of both groups together. All values and distances at all outputs share one chance
/// of 0.27 %, see beyond_chance. A distance is significant by how far its mean over pairs is beyond
/// that between seeds of one group. Of single runs the tolerance alone decides.
///
/// Throws: InputError where the domains are not the same, no output is common, or no files are left
///         to compare.
Comparison compare(const RunGroup& first, const RunGroup& second, const Tolerances& tolerances);

/// The verdict on a difference.
Verdict judge(double size, double tolerance, bool is_significant);

/// Mean and spread of values.
Sample sample_of(std::span<const double> values);

/// The standard error of the difference of two means, from the spreads of both together; nothing
/// without spreads.
struct DifferenceError {
  double std_error = 0;
  int degrees_of_freedom = 0;

  /// How often chance makes a difference as large, on either side.
  double chance(double difference) const;
};
std::optional<DifferenceError> difference_error(const Sample& a, const Sample& b);

/// How often two groups of so many share so many runs with an opening as unequally by chance,
/// whatever the part of all runs that has it. Source: Fisher's exact test.
double split_chance(std::size_t first_with, std::size_t first, std::size_t second_with,
                    std::size_t second);

}  // namespace scarp

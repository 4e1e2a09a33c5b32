#include "apps/report/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/report/compared_flux.h"
#include "apps/run/restart.h"
#include "apps/simulator/section.h"
#include "core/error.h"
#include "core/many_tests.h"
#include "core/printable.h"
#include "core/running_statistics.h"
#include "core/student.h"
#include "flux/revolution.h"
#include "levelset/grid/symmetry.h"
#include "levelset/metrology/openings.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

/// A cross-section of an infinitely long structure fits any slice of it, and one through an axis a
/// domain that is as wide.
void require_same_domain(const Frame& a, const Frame& b, const std::string& where) {
  bool is_same = !(a.is_section() && b.is_section()) || a.is_slice() == b.is_slice();
  for (int axis = 0; axis < std::min(a.lateral_axes(), b.lateral_axes()); ++axis) {
    const double difference = a.sides().width(axis) - b.sides().width(axis);
    is_same =
        is_same && a.boundary[axis] == b.boundary[axis] && std::abs(difference) < 1e-6 * a.spacing;
  }
  if (is_same) return;
  throw InputError(
      fmt::format("{}: has another extent or other sides than what it is compared with", where));
}

/// Makes what was a cross-section, or one through an axis, as long as another.
void lengthen(Snapshot& section, const Sides& slice) {
  const Sides own = section.frame.sides();
  const double longer = slice.width(1) / own.width(1);
  for (Vec3f& r : section.surface.vertices)
    r.y = static_cast<float>(slice.lower[1] + longer * (static_cast<double>(r.y) - own.lower[1]));
  for (MetrologyValue& each : section.values) {
    if (!each.name.ends_with("_nm3") || !section.frame.is_slice()) continue;
    each.value *= longer;
    each.per_nm *= longer;
  }
}

/// Makes what was a section through an axis a surface between four sides, as wide either way. Its
/// volumes are those within its circle, which no other surface has.
void revolve(Snapshot& section) {
  TriMesh beyond_axis;
  beyond_axis.vertices = section.surface.vertices;
  for (std::size_t f = 0; f < section.surface.triangles.size(); ++f) {
    const Triangle& t = section.surface.triangles[f];
    if (std::ranges::any_of(t, [&](std::uint32_t v) { return beyond_axis.vertices[v].x < 0; }))
      continue;
    beyond_axis.triangles.push_back(t);
    if (!section.surface.materials.empty())
      beyond_axis.materials.push_back(section.surface.materials[f]);
  }
  section.frame = section.frame.revolved();
  const Frame quarter = part_of(section.frame, {.across = {true, true}});
  section.surface = with_images(Revolution(beyond_axis, quarter.sides()).mesh(), quarter);
  std::erase_if(section.values,
                [](const MetrologyValue& each) { return each.name.ends_with("_nm3"); });
}

/// Gives sections the length, or the circles, of a surface between four sides, if there is one;
/// else all of them that of the first, each having that of its own spacing.
void make_comparable(std::span<Snapshot> all) {
  const auto is_section = [](const Snapshot& each) { return each.frame.is_section(); };
  const auto slice = std::ranges::find_if_not(all, is_section);
  const bool has_slice = slice != all.end();
  const Sides sides = (has_slice ? *slice : all.front()).frame.sides();
  for (Snapshot& each : all) {
    if (each.frame.is_around_axis() && has_slice) {
      revolve(each);
    } else if (is_section(each)) {
      lengthen(each, sides);
    }
  }
}

// --- values --------------------------------------------------------------------------------------

/// Differences below this are rounding. Units: spacings.
constexpr double least_difference = 1e-4;

std::optional<double> tolerance_of(const MetrologyValue& value, double mean, double spacing,
                                   const Tolerances& allowed) {
  const auto of = [&](double cells, double part) {
    return cells * spacing * std::abs(value.per_nm) + part * std::abs(mean);
  };
  switch (value.kind) {
    case ValueKind::width_or_depth:
    case ValueKind::height:
      return of(allowed.length_cells, allowed.length_part);
    case ValueKind::film:
    case ValueKind::coverage:
      return of(allowed.film_cells, allowed.film_part);
    case ValueKind::volume:
      return of(allowed.volume_cells, allowed.volume_part);
    case ValueKind::other:
      break;
  }
  return std::nullopt;
}

/// What grids of different spacings may make of a value: each leaves it open by its own error. On
/// equal grids the error is the same, and is no difference.
double grid_difference(const std::string& name, std::span<const Snapshot> a,
                       std::span<const Snapshot> b) {
  if (a.front().frame.spacing == b.front().frame.spacing) return 0;
  double sum = 0;
  for (const std::span<const Snapshot> group : {a, b}) {
    double most = 0;
    for (const Snapshot& each : group) {
      const auto same = std::ranges::find(each.values, name, &MetrologyValue::name);
      if (same != each.values.end()) most = std::max(most, same->grid_error);
    }
    sum += most;
  }
  return sum;
}

const OpeningPlace* find_opening(std::span<const Snapshot> group, int number) {
  for (const Snapshot& each : group) {
    const auto same = std::ranges::find(each.openings, number, &OpeningPlace::number);
    if (same != each.openings.end()) return &*same;
  }
  return nullptr;
}

/// The same values of two groups.
class SameValues {
 public:
  SameValues(const MetrologyValue& value, std::span<const Snapshot> a, std::span<const Snapshot> b)
      : value_(value), spacing_(a.front().frame.spacing) {
    if (value.opening) {
      place_ = find_opening(a, *value.opening);
      if (place_ == nullptr) place_ = find_opening(b, *value.opening);
    }
  }

  Sample of(std::span<const Snapshot> group) const {
    std::vector<double> found;
    std::size_t stand_ins = 0;
    for (const Snapshot& each : group) {
      const auto same = std::ranges::find(each.values, value_.name, &MetrologyValue::name);
      if (same != each.values.end()) {
        found.push_back(same->value);
      } else if (has_stand_in(each)) {
        found.push_back(least_opening_depth * spacing_);
        ++stand_ins;
      }
    }
    Sample sample = sample_of(found);
    sample.stand_ins = stand_ins;
    return sample;
  }

 private:
  /// An opening that a run does not have is at most as deep as the least that is called one; but
  /// one that has merged or fallen apart is not shallow.
  bool has_stand_in(const Snapshot& run) const {
    if (place_ == nullptr || !value_.name.ends_with(" depth_nm")) return false;
    return std::ranges::none_of(run.openings, [&](const OpeningPlace& other) {
      return other.number != place_->number && overlap(other, *place_, run.frame);
    });
  }

  const MetrologyValue& value_;
  double spacing_;
  const OpeningPlace* place_ = nullptr;
};

/// What chance alone makes of a difference of two samples of groups of runs; nothing of single
/// ones. Where too few runs have the value to have a spread, chance may be all.
std::optional<double> chance_of(const Sample& a, const Sample& b, std::size_t runs) {
  if (runs < 3) return std::nullopt;
  const auto error = difference_error(a, b);
  if (!error) return 1;
  const double chance = error->chance(b.mean - a.mean);
  if (a.stand_ins + b.stand_ins == 0) return chance;
  return std::max(chance,
                  split_chance(a.count - a.stand_ins, a.count, b.count - b.stand_ins, b.count));
}

ComparedValue compared(const MetrologyValue& value, std::span<const Snapshot> a,
                       std::span<const Snapshot> b, const Tolerances& allowed) {
  const double spacing = a.front().frame.spacing;
  const SameValues same(value, a, b);
  ComparedValue result{.name = value.name, .first = same.of(a), .second = same.of(b)};
  if (result.first.count == 0 || result.second.count == 0) return result;
  result.difference = result.second.mean - result.first.mean;
  if (const auto error = difference_error(result.first, result.second))
    result.std_error = error->std_error;
  result.tolerance = tolerance_of(value, result.first.mean, spacing, allowed);
  if (!result.tolerance) return result;
  const double rounding = least_difference * spacing * std::abs(value.per_nm);
  result.tolerance = std::max({*result.tolerance, rounding, grid_difference(value.name, a, b)});
  if (std::abs(*result.difference) <= rounding) {
    result.significance.is_significant = false;
  } else {
    result.significance.chance = chance_of(result.first, result.second, a.size() + b.size());
  }
  return result;
}

void compare_values(double time, std::span<const Snapshot> a, std::span<const Snapshot> b,
                    Comparison& result) {
  std::vector<MetrologyValue> all;
  for (const std::span<const Snapshot> group : {a, b}) {
    for (const Snapshot& snapshot : group) {
      for (const MetrologyValue& value : snapshot.values) {
        if (std::ranges::find(all, value.name, &MetrologyValue::name) == all.end())
          all.push_back(value);
      }
    }
  }
  for (const MetrologyValue& value : all) {
    result.values.push_back(compared(value, a, b, *result.tolerances));
    result.values.back().time = time;
  }
}

// --- distances -----------------------------------------------------------------------------------

constexpr std::array statistics_members{&DistanceStatistics::max, &DistanceStatistics::mean,
                                        &DistanceStatistics::rms, &DistanceStatistics::p99};

DistanceStatistics mean_of(std::span<const DistanceStatistics> each) {
  DistanceStatistics mean;
  for (const DistanceStatistics& one : each) {
    for (const auto member : statistics_members)
      mean.*member += one.*member / static_cast<double>(each.size());
  }
  return mean;
}

/// Of pairs of surfaces, in spacings.
struct PairDistances {
  std::vector<DistanceStatistics> forward;
  std::vector<DistanceStatistics> reverse;

  void add(const TriMesh& a, const TriMesh& b, double spacing) {
    const SurfaceDistance both = surface_distance(a, b);
    forward.push_back(both.forward);
    reverse.push_back(both.reverse);
    for (DistanceStatistics* one : {&forward.back(), &reverse.back()})
      for (const auto member : statistics_members) (*one).*member /= spacing;
  }

  std::size_t count() const { return forward.size(); }

  /// The worse way of each pair.
  std::vector<double> worst(double DistanceStatistics::*member) const {
    std::vector<double> found;
    for (std::size_t n = 0; n < count(); ++n)
      found.push_back(std::max(forward[n].*member, reverse[n].*member));
    return found;
  }

  /// Mean distances over both ways.
  std::vector<double> means() const {
    std::vector<double> found;
    for (std::size_t n = 0; n < count(); ++n)
      found.push_back(0.5 * (forward[n].mean + reverse[n].mean));
    return found;
  }
};

/// Each surface of a group with the next one.
PairDistances within(std::span<const Snapshot> group, double spacing) {
  PairDistances pairs;
  const std::size_t count = group.size() < 3 ? group.size() - 1 : group.size();
  for (std::size_t n = 0; n < count; ++n)
    pairs.add(group[n].surface, group[(n + 1) % group.size()].surface, spacing);
  return pairs;
}

PairDistances across(std::span<const Snapshot> a, std::span<const Snapshot> b, double spacing) {
  PairDistances pairs;
  for (std::size_t n = 0; n < std::max(a.size(), b.size()); ++n)
    pairs.add(a[n % a.size()].surface, b[n % b.size()].surface, spacing);
  return pairs;
}

struct AllDistances {
  PairDistances across;
  PairDistances first;
  PairDistances second;
};

Significance significance_of(const AllDistances& all, double DistanceStatistics::*member) {
  std::vector<double> seeds = all.first.worst(member);
  const std::vector<double> more = all.second.worst(member);
  seeds.insert(seeds.end(), more.begin(), more.end());
  const Sample apart = sample_of(all.across.worst(member));
  if (apart.mean <= least_difference) return {.is_significant = false};
  if (seeds.empty()) return {};
  const Sample noise = sample_of(seeds);
  const auto error = difference_error(noise, apart);
  // A single pair of seeds has no spread, but a size.
  const double excess = apart.mean - noise.mean;
  if (excess <= 0) return {.chance = 1};
  return {.chance = error ? error->chance(excess) : 0};
}

ComparedDistance compared(const AllDistances& all, const Tolerances& allowed) {
  ComparedDistance result{.forward = mean_of(all.across.forward),
                          .reverse = mean_of(all.across.reverse),
                          .mean_tolerance = std::max(allowed.mean_distance, least_difference),
                          .p99_tolerance = std::max(allowed.p99_distance, least_difference)};
  std::vector<DistanceStatistics> seeds;
  for (const PairDistances* pairs : {&all.first, &all.second}) {
    seeds.insert(seeds.end(), pairs->forward.begin(), pairs->forward.end());
    seeds.insert(seeds.end(), pairs->reverse.begin(), pairs->reverse.end());
  }
  if (!seeds.empty()) result.between_seeds = mean_of(seeds);
  result.mean_significance = significance_of(all, &DistanceStatistics::mean);
  result.p99_significance = significance_of(all, &DistanceStatistics::p99);
  return result;
}

// --- cost ----------------------------------------------------------------------------------------

/// A mean with the square of its relative error.
struct Relative {
  double mean = 0;
  double square = 0;
};

Relative relative(std::span<const double> values) {
  RunningStatistics all;
  for (const double value : values) all.add(value);
  if (!(all.mean() > 0)) return {};
  return {.mean = all.mean(), .square = std::pow(all.std_error() / all.mean(), 2)};
}

std::vector<double> seconds_of(std::span<const RunCost> costs) {
  std::vector<double> seconds;
  for (const RunCost& cost : costs) seconds.push_back(cost.seconds());
  return seconds;
}

double mean_seconds(std::span<const RunCost> costs, const char* stage) {
  double sum = 0;
  for (const RunCost& cost : costs) sum += cost.stages.seconds(stage);
  return sum / static_cast<double>(costs.size());
}

void compare_costs(const AllDistances& last, Comparison& result) {
  if (result.first_costs.empty() || result.second_costs.empty()) return;
  const Relative first = relative(seconds_of(result.first_costs));
  const Relative second = relative(seconds_of(result.second_costs));
  if (!(second.mean > 0)) return;
  result.speedup = first.mean / second.mean;
  if (result.first_costs.size() > 1 && result.second_costs.size() > 1)
    result.speedup_std_error = *result.speedup * std::sqrt(first.square + second.square);
  if (last.first.count() == 0 || last.second.count() == 0) return;

  const Relative noise_first = relative(last.first.means());
  const Relative noise_second = relative(last.second.means());
  const double flux = mean_seconds(result.second_costs, "flux");
  const double factor =
      noise_first.mean > 0 ? std::pow(noise_second.mean / noise_first.mean, 2) : 1;
  EqualError equal{.first_seconds = first.mean,
                   .second_seconds = second.mean + flux * (factor - 1),
                   .first_noise = noise_first.mean,
                   .second_noise = noise_second.mean};
  const double apart = relative(last.across.means()).mean;
  equal.systematic = std::sqrt(std::max(
      0.0, apart * apart - 0.5 * (std::pow(noise_first.mean, 2) + std::pow(noise_second.mean, 2))));
  equal.speedup = equal.first_seconds / equal.second_seconds;
  const double share = flux * factor / equal.second_seconds;
  // One pair has no spread. In a ring each seed is in two, so half as many are independent.
  constexpr double pairs_of_seed = 2;
  const double noise_square = pairs_of_seed * (noise_first.square + noise_second.square);
  if (last.first.count() > 1 && last.second.count() > 1)
    equal.speedup_std_error =
        equal.speedup * std::sqrt(first.square + second.square + 4 * share * share * noise_square);
  result.equal_error = equal;
}

// --- verdicts ------------------------------------------------------------------------------------

/// Everything that has a tolerance and may differ: volumes, and the rest.
std::array<std::vector<Significance*>, 2> looked_at(Comparison& comparison) {
  std::array<std::vector<Significance*>, 2> all;
  for (ComparedValue& each : comparison.values)
    if (each.tolerance && !each.significance.is_significant)
      all[each.name.ends_with("_nm3") ? 0 : 1].push_back(&each.significance);
  for (ComparedDistance& each : comparison.distances)
    for (Significance* one : {&each.mean_significance, &each.p99_significance})
      if (!one->is_significant) all[1].push_back(one);
  return all;
}

/// Volumes have half of the weight: they are means over the whole surface, which see a change most
/// clearly. Of single runs nothing is known of chance: whatever differs counts.
void find_significant(Comparison& comparison) {
  std::vector<Significance*> all;
  std::vector<LookedAt> chances;
  for (const std::vector<Significance*>& half : looked_at(comparison)) {
    for (Significance* each : half) {
      all.push_back(each);
      chances.push_back(
          {.chance = each->chance.value_or(0), .weight = 1 / static_cast<double>(half.size())});
    }
  }
  const std::vector<bool> found = beyond_chance(chances, three_standard_errors_chance());
  for (std::size_t n = 0; n < all.size(); ++n) all[n]->is_significant = found[n];
}

void judge_all(Comparison& comparison) {
  find_significant(comparison);
  for (ComparedValue& each : comparison.values) {
    if (each.tolerance)
      each.verdict =
          judge(std::abs(*each.difference), *each.tolerance, *each.significance.is_significant);
  }
  for (ComparedDistance& each : comparison.distances) {
    const auto verdict = [&](double DistanceStatistics::*member, double tolerance,
                             const Significance& significance) {
      return judge(each.worst(member), tolerance, *significance.is_significant);
    };
    each.mean_verdict =
        verdict(&DistanceStatistics::mean, each.mean_tolerance, each.mean_significance);
    each.p99_verdict = verdict(&DistanceStatistics::p99, each.p99_tolerance, each.p99_significance);
  }
}

// --- ends ----------------------------------------------------------------------------------------

bool is_same_time(double a, double b) { return std::abs(a - b) <= 1e-9 * std::abs(b); }

std::vector<std::size_t> ends_of(std::span<const RunRecord* const> runs) {
  std::vector<std::size_t> ends;
  for (const RunRecord* run : runs) ends.push_back(run->outputs.size() - 1);
  return ends;
}

bool end_at_one_time(std::span<const RunRecord* const> runs) {
  return std::ranges::all_of(
      runs, [&](const RunRecord* run) { return is_same_time(run->end(), runs.front()->end()); });
}

/// Whether their ends are the same output at whatever times.
bool may_end_apart(std::span<const RunRecord* const> runs) {
  return std::ranges::all_of(runs, &RunRecord::is_state) ||
         std::ranges::all_of(
             runs, [](const RunRecord* run) { return run->is_complete && run->has_condition; });
}

/// "a ends at 8 s, b at 10 s"; of states "is".
std::string ends_text(std::span<const RunRecord* const> runs) {
  std::string text;
  for (const RunRecord* run : runs)
    text += fmt::format("{}{}{} at {:.6g} s", text.empty() ? "" : ", ", shown(run->where),
                        !text.empty()   ? ""
                        : run->is_state ? " is"
                                        : " ends",
                        run->end());
  return text;
}

// --- all together --------------------------------------------------------------------------------

/// Goes through the outputs of all runs.
class Comparer {
 public:
  Comparer(const RunGroup& first, const RunGroup& second, const Tolerances& tolerances) {
    result_.first = first.name;
    result_.second = second.name;
    result_.tolerances = tolerances;
    first_count_ = first.runs.size();
    for (const RunGroup* group : {&first, &second}) {
      for (const RunRecord& run : group->runs) {
        runs_.push_back(&run);
        readers_.emplace_back(run, &openings_);
        if (run.cost)
          (group == &first ? result_.first_costs : result_.second_costs).push_back(*run.cost);
      }
    }
  }

  Comparison run() {
    const std::vector<std::vector<std::size_t>> common = common_outputs(runs_);
    if (common.empty()) {
      throw InputError(
          fmt::format("{}: they have no output at the same time; name two states "
                      "(.vdb) to compare them whatever their times",
                      ends_text(runs_)));
    }
    if (common.back() != ends_of(runs_)) result_.ends_apart = ends_text(runs_);
    warn(runs_.front()->outputs[common.back().front()].time);
    for (const std::vector<std::size_t>& outputs : common) compare_at(outputs);
    judge_all(result_);
    // Times of runs that are not equally long say nothing.
    if (result_.reaches_ends()) compare_costs(last_, result_);
    return std::move(result_);
  }

 private:
  void warn(double last_time) {
    for (const RunRecord* run : runs_)
      if (!run->is_complete) result_.warnings.push_back(incomplete_warning(*run));
    if (end_at_one_time(runs_)) return;
    result_.warnings.push_back(ends_text(runs_) +
                               (result_.reaches_ends()
                                    ? ": compared at these times"
                                    : fmt::format(": compared up to {:.6g} s", last_time)));
  }

  void compare_at(const std::vector<std::size_t>& outputs) {
    const double time = runs_.front()->outputs[outputs.front()].time;
    std::vector<Snapshot> all;
    std::array<std::vector<fs::path>, 2> surfaces;
    for (std::size_t n = 0; n < runs_.size(); ++n) {
      all.push_back(readers_[n].read(outputs[n], materials_));
      require_same_domain(all.front().frame, all.back().frame, shown(runs_[n]->where));
      surfaces[n < first_count_ ? 0 : 1].push_back(runs_[n]->outputs[outputs[n]].surface);
    }
    make_comparable(all);
    const std::span<const Snapshot> a = std::span(all).first(first_count_);
    const std::span<const Snapshot> b = std::span(all).subspan(first_count_);
    result_.spacing = a.front().frame.spacing;
    compare_values(time, a, b, result_);
    last_ = {.across = across(a, b, result_.spacing),
             .first = within(a, result_.spacing),
             .second = within(b, result_.spacing)};
    result_.distances.push_back(compared(last_, *result_.tolerances));
    result_.distances.back().time = time;
    for (ComparedFlux& flux : compare_fluxes(surfaces, a.front())) {
      flux.time = time;
      result_.fluxes.push_back(std::move(flux));
    }
    result_.profiles.push_back(
        {.time = time, .first = a.front().profile, .second = b.front().profile});
  }

  Comparison result_;
  std::size_t first_count_ = 0;
  std::vector<const RunRecord*> runs_;
  std::vector<SnapshotReader> readers_;
  Materials materials_;
  CommonOpenings openings_;
  AllDistances last_;
};

}  // namespace

std::vector<std::vector<std::size_t>> common_outputs(std::span<const RunRecord* const> runs) {
  struct Moment {
    double time = 0;
    int occurrence = 0;
  };
  const auto moments = [](const RunRecord& run) {
    std::vector<Moment> found;
    for (const RunOutput& output : run.outputs) {
      const bool again = !found.empty() && found.back().time == output.time;
      found.push_back({output.time, again ? found.back().occurrence + 1 : 0});
    }
    return found;
  };
  std::vector<std::vector<Moment>> of_runs;
  for (const RunRecord* run : runs) of_runs.push_back(moments(*run));
  std::vector<std::vector<std::size_t>> common;
  for (const Moment& wanted : of_runs.front()) {
    std::vector<std::size_t> row;
    for (const std::vector<Moment>& each : of_runs) {
      const auto same = std::ranges::find_if(each, [&](const Moment& moment) {
        return moment.occurrence == wanted.occurrence && is_same_time(moment.time, wanted.time);
      });
      if (same == each.end()) break;
      row.push_back(static_cast<std::size_t>(same - each.begin()));
    }
    if (row.size() == runs.size()) common.push_back(std::move(row));
  }
  if (!end_at_one_time(runs) && !may_end_apart(runs)) return common;
  std::vector<std::size_t> ends = ends_of(runs);
  if (common.empty() || common.back() != ends) common.push_back(std::move(ends));
  return common;
}

Sample sample_of(std::span<const double> values) {
  RunningStatistics all;
  for (const double value : values) all.add(value);
  Sample sample{.count = values.size(), .mean = all.mean()};
  if (values.size() > 1) sample.spread = std::sqrt(all.variance());
  return sample;
}

std::optional<DifferenceError> difference_error(const Sample& a, const Sample& b) {
  if (a.count == 0 || b.count == 0 || a.count + b.count < 3) return std::nullopt;
  const auto n = static_cast<double>(a.count);
  const auto m = static_cast<double>(b.count);
  const double squares =
      (n - 1) * std::pow(a.spread.value_or(0), 2) + (m - 1) * std::pow(b.spread.value_or(0), 2);
  return DifferenceError{.std_error = std::sqrt(squares / (n + m - 2) * (1 / n + 1 / m)),
                         .degrees_of_freedom = static_cast<int>(a.count + b.count) - 2};
}

double DifferenceError::chance(double difference) const {
  if (difference == 0) return 1;
  if (!(std_error > 0)) return 0;
  return 1 - student_probability(std::abs(difference) / std_error, degrees_of_freedom);
}

double split_chance(std::size_t first_with, std::size_t first, std::size_t second_with,
                    std::size_t second) {
  const auto choose = [](std::size_t all, std::size_t some) {
    double ways = 1;
    for (std::size_t n = 0; n < some; ++n)
      ways *= static_cast<double>(all - n) / static_cast<double>(n + 1);
    return ways;
  };
  const std::size_t with = first_with + second_with;
  const auto ways = [&](std::size_t n) { return choose(first, n) * choose(second, with - n); };
  double as_rare = 0;
  for (std::size_t n = with > second ? with - second : 0; n <= std::min(first, with); ++n)
    if (ways(n) <= ways(first_with) * (1 + 1e-9)) as_rare += ways(n);
  return as_rare / choose(first + second, with);
}

Verdict judge(double size, double tolerance, bool is_significant) {
  if (size <= tolerance) return Verdict::within;
  return is_significant ? Verdict::moved : Verdict::noise;
}

bool Comparison::is_significant() const {
  const auto is_so = [](const Significance& each) { return each.is_significant.value_or(false); };
  return std::ranges::any_of(values, is_so, &ComparedValue::significance) ||
         std::ranges::any_of(distances, is_so, &ComparedDistance::mean_significance) ||
         std::ranges::any_of(distances, is_so, &ComparedDistance::p99_significance);
}

std::vector<std::string> Comparison::moved() const {
  std::vector<std::string> lines;
  if (!reaches_ends()) lines.push_back("their ends are at different times: " + ends_apart);
  for (const ComparedDistance& each : distances) {
    const auto line = [&](Verdict verdict, const char* name, double DistanceStatistics::*member,
                          double tolerance) {
      if (verdict != Verdict::moved) return;
      lines.push_back(fmt::format("{} distance at t = {:.6g} s: {:.3g} spacings, allowed {:.3g}",
                                  name, each.time, each.worst(member), tolerance));
    };
    line(each.mean_verdict, "mean", &DistanceStatistics::mean, each.mean_tolerance);
    line(each.p99_verdict, "99 %", &DistanceStatistics::p99, each.p99_tolerance);
  }
  for (const ComparedValue& each : values) {
    if (each.verdict != Verdict::moved) continue;
    lines.push_back(fmt::format("{} at t = {:.6g} s: {:.6g} instead of {:.6g}, allowed +-{:.3g}",
                                each.name, each.time, each.second.mean, each.first.mean,
                                *each.tolerance));
  }
  return lines;
}

Comparison compare(const RunGroup& first, const RunGroup& second, const Tolerances& tolerances) {
  return Comparer(first, second, tolerances).run();
}

}  // namespace scarp

#include "apps/report/baseline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/printable.h"
#include "core/student.h"
#include "core/system/atomic_file.h"
#include "core/system/read_file.h"
#include "levelset/metrology/contour.h"

namespace scarp {

namespace {

using nlohmann::ordered_json;

// What other compilers and libraries may change, in spacings.
constexpr double least_tolerance = 0.02;

// Of the time that a step takes which ends by a condition; metrology is then what was asked for.
constexpr const char* time_name = "time_s";
constexpr double time_tolerance = 0.01;

bool is_kept(const MetrologyValue& value) {
  return value.kind == ValueKind::width_or_depth || value.kind == ValueKind::film ||
         value.kind == ValueKind::coverage;
}

/// Of a single new run, from the spread of seeds.
double chance_of(const Sample& seeds) {
  if (seeds.count < 2) return 0;
  return three_standard_errors(static_cast<int>(seeds.count) - 1) * *seeds.spread *
         std::sqrt(1 + 1 / static_cast<double>(seeds.count));
}

/// Rounded to a number that is short to write.
double rounded(double value, double step) { return std::round(value / step) * step; }

DistanceStatistics distances(std::span<const Polyline> from, std::span<const Polyline> to,
                             double spacing) {
  const DistanceToLines distance(to);
  std::vector<double> values;
  for (const Polyline& line : from)
    for (const auto& point : line.points) values.push_back(distance(point) / spacing);
  return statistics(values);
}

std::vector<double> values_of(std::span<const Snapshot> seeds, const std::string& name) {
  std::vector<double> found;
  for (const Snapshot& each : seeds) {
    const auto same = std::ranges::find(each.values, name, &MetrologyValue::name);
    if (same != each.values.end()) found.push_back(same->value);
  }
  return found;
}

BaselineOutput baseline_of(double time, std::span<const Snapshot> seeds) {
  const Snapshot& first = seeds.front();
  const double spacing = first.frame.spacing;
  BaselineOutput output{.time = time, .values = {}, .profile = first.profile};
  for (const MetrologyValue& value : first.values) {
    const std::vector<double> values = values_of(seeds, value.name);
    // What only some seeds have cannot be asked for.
    if (!is_kept(value) || values.size() < seeds.size()) continue;
    const Sample sample = sample_of(values);
    output.values.push_back(
        {.name = value.name,
         .value = sample.mean,
         .tolerance = least_tolerance * spacing * std::abs(value.per_nm) + chance_of(sample)});
  }
  std::vector<double> apart;
  for (const Snapshot& other : seeds.subspan(1))
    apart.push_back(distances(other.profile, first.profile, spacing).mean);
  const Sample sample = sample_of(apart);
  output.profile_distance = least_tolerance + sample.mean + chance_of(sample);
  return output;
}

BaselineValue time_of(const std::vector<double>& times) {
  const Sample sample = sample_of(times);
  return {.name = time_name,
          .value = sample.mean,
          .tolerance = time_tolerance * sample.mean + chance_of(sample)};
}

ordered_json json_of(const BaselineOutput& output, double spacing) {
  ordered_json json{{"time_s", output.time}, {"values", ordered_json::object()}};
  for (const BaselineValue& value : output.values)
    json["values"][value.name] = {{"value", value.value}, {"tolerance", value.tolerance}};
  json["profile_distance"] = output.profile_distance;
  json["profile_nm"] = ordered_json::array();
  for (const Polyline& line : output.profile) {
    ordered_json points = ordered_json::array();
    for (const auto& [x, z] : line.points) {
      points.push_back(rounded(x, 1e-3 * spacing));
      points.push_back(rounded(z, 1e-3 * spacing));
    }
    json["profile_nm"].push_back(std::move(points));
  }
  return json;
}

BaselineOutput output_of(const nlohmann::ordered_json& json) {
  BaselineOutput output{.time = json.at("time_s"),
                        .values = {},
                        .profile = {},
                        .profile_distance = json.at("profile_distance")};
  for (const auto& [name, value] : json.at("values").items())
    output.values.push_back({name, value.at("value"), value.at("tolerance")});
  for (const auto& points : json.at("profile_nm")) {
    output.profile.emplace_back();
    for (std::size_t n = 0; n + 1 < points.size(); n += 2)
      output.profile.back().points.push_back({points[n], points[n + 1]});
  }
  return output;
}

ComparedValue compared(const BaselineValue& stored, double time,
                       std::span<const MetrologyValue> now, std::size_t seeds) {
  ComparedValue result{.time = time,
                       .name = stored.name,
                       .first = {.count = seeds, .mean = stored.value},
                       .tolerance = stored.tolerance,
                       .verdict = Verdict::moved};
  const auto found = std::ranges::find(now, stored.name, &MetrologyValue::name);
  if (found == now.end()) return result;
  result.second = {.count = 1, .mean = found->value};
  result.difference = found->value - stored.value;
  result.verdict = judge(std::abs(*result.difference), stored.tolerance, true);
  return result;
}

ComparedDistance compared(const BaselineOutput& stored, const Snapshot& now) {
  const double spacing = now.frame.spacing;
  ComparedDistance result{.time = stored.time,
                          .forward = distances(stored.profile, now.profile, spacing),
                          .reverse = distances(now.profile, stored.profile, spacing),
                          .mean_tolerance = stored.profile_distance};
  result.mean_verdict =
      judge(result.worst(&DistanceStatistics::mean), stored.profile_distance, true);
  return result;
}

}  // namespace

Baseline make_baseline(const std::vector<RunRecord>& seeds) {
  Baseline baseline{.seeds = static_cast<int>(seeds.size()), .spacing = 0, .outputs = {}};
  Materials materials;
  std::vector<SnapshotReader> readers(seeds.begin(), seeds.end());
  for (std::size_t output = 0; output < seeds.front().outputs.size(); ++output) {
    std::vector<Snapshot> all;
    std::vector<double> times;
    for (std::size_t n = 0; n < seeds.size(); ++n) {
      if (output >= seeds[n].outputs.size()) continue;
      all.push_back(readers[n].read(output, materials));
      times.push_back(seeds[n].outputs[output].time);
    }
    baseline.spacing = all.front().frame.spacing;
    baseline.outputs.push_back(baseline_of(seeds.front().outputs[output].time, all));
    baseline.outputs.back().values.push_back(time_of(times));
  }
  return baseline;
}

void write_baseline(const std::filesystem::path& file, const Baseline& baseline) {
  ordered_json json{{"seeds", baseline.seeds},
                    {"spacing_nm", baseline.spacing},
                    {"outputs", ordered_json::array()}};
  for (const BaselineOutput& output : baseline.outputs)
    json["outputs"].push_back(json_of(output, baseline.spacing));
  write_file(file, json.dump(1) + '\n');
}

Baseline read_baseline(const std::filesystem::path& file) {
  try {
    const auto json = ordered_json::parse(read_file(file));
    Baseline baseline{.seeds = json.at("seeds"), .spacing = json.at("spacing_nm"), .outputs = {}};
    for (const auto& output : json.at("outputs")) baseline.outputs.push_back(output_of(output));
    return baseline;
  } catch (const nlohmann::json::exception&) {
    throw InputError(fmt::format(
        "{}: is no baseline, or is damaged; make it with scarp baseline create", shown(file)));
  }
}

Comparison check(const Baseline& baseline, const RunRecord& run) {
  Comparison result{
      .first = "baseline", .second = shown(run.where.filename()), .spacing = baseline.spacing};
  SnapshotReader reader(run);
  Materials materials;
  const std::size_t count = std::min(baseline.outputs.size(), run.outputs.size());
  for (std::size_t n = 0; n < count; ++n) {
    const BaselineOutput& stored = baseline.outputs[n];
    Snapshot now = reader.read(n, materials);
    now.values.push_back({.name = time_name, .value = run.outputs[n].time});
    for (const BaselineValue& value : stored.values)
      result.values.push_back(
          compared(value, stored.time, now.values, static_cast<std::size_t>(baseline.seeds)));
    result.distances.push_back(compared(stored, now));
    result.profiles.push_back(
        {.time = stored.time, .first = stored.profile, .second = now.profile});
  }
  const auto outputs = [](std::size_t number) {
    return Sample{.count = 1, .mean = static_cast<double>(number)};
  };
  if (baseline.outputs.size() != run.outputs.size()) {
    result.values.push_back({.name = "number of outputs",
                             .first = outputs(baseline.outputs.size()),
                             .second = outputs(run.outputs.size()),
                             .tolerance = 0,
                             .verdict = Verdict::moved});
  }
  return result;
}

}  // namespace scarp

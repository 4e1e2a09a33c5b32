#include "apps/report/comparison_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/run/markup.h"
#include "apps/run/svg.h"
#include "core/parallel.h"
#include "core/plain_number.h"
#include "levelset/metrology/contour.h"

namespace scarp {

namespace {

using nlohmann::ordered_json;

// --- JSON ----------------------------------------------------------------------------------------

const char* name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::within:
      return "within";
    case Verdict::noise:
      return "noise";
    case Verdict::moved:
      return "moved";
    case Verdict::none:
      break;
  }
  return "none";
}

template <class T>
ordered_json json_of(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

ordered_json json_of(const Sample& sample) {
  if (sample.count == 0)
    return {{"runs", 0}, {"without", 0}, {"mean", nullptr}, {"spread", nullptr}};
  return {{"runs", sample.count},
          {"without", sample.stand_ins},
          {"mean", sample.mean},
          {"spread", json_of(sample.spread)}};
}

ordered_json json_of(const DistanceStatistics& distance) {
  return {
      {"mean", distance.mean}, {"rms", distance.rms}, {"p99", distance.p99}, {"max", distance.max}};
}

ordered_json json_of(const ComparedValue& value) {
  return {{"time_s", value.time},
          {"name", value.name},
          {"first", json_of(value.first)},
          {"second", json_of(value.second)},
          {"difference", json_of(value.difference)},
          {"std_error", json_of(value.std_error)},
          {"tolerance", json_of(value.tolerance)},
          {"verdict", name_of(value.verdict)},
          {"chance", json_of(value.significance.chance)},
          {"significant", json_of(value.significance.is_significant)}};
}

ordered_json json_of(const ComparedDistance& each) {
  return {{"time_s", each.time},
          {"forward", json_of(each.forward)},
          {"reverse", json_of(each.reverse)},
          {"between_seeds", each.between_seeds ? json_of(*each.between_seeds) : ordered_json()},
          {"mean_verdict", name_of(each.mean_verdict)},
          {"mean_chance", json_of(each.mean_significance.chance)},
          {"mean_significant", json_of(each.mean_significance.is_significant)},
          {"p99_verdict", name_of(each.p99_verdict)},
          {"p99_chance", json_of(each.p99_significance.chance)},
          {"p99_significant", json_of(each.p99_significance.is_significant)}};
}

ordered_json json_of(const ComparedFlux& flux) {
  return {{"time_s", flux.time},
          {"name", flux.name},
          {"rms_difference", flux.rms_difference},
          {"max_difference", flux.max_difference},
          {"rms_std_error", json_of(flux.rms_std_error)},
          {"place_nm", flux.place},
          {"first", flux.first},
          {"second", flux.second}};
}

/// Means over the runs of a group.
RunCost mean_cost(std::span<const RunCost> costs) {
  const auto count = static_cast<double>(costs.size());
  RunCost mean;
  for (const RunCost& cost : costs) {
    mean.time_steps += cost.time_steps / count;
    mean.facets_full += cost.facets_full / count;
    mean.facets += cost.facets / count;
    mean.rays += cost.rays / count;
    mean.segments += cost.segments / count;
    for (const auto& [stage, seconds] : cost.stages.stages())
      mean.stages.add(stage, seconds / count);
  }
  return mean;
}

ordered_json cost_json(std::span<const RunCost> costs) {
  if (costs.empty()) return nullptr;
  const RunCost mean = mean_cost(costs);
  ordered_json json{{"seconds", mean.seconds()},
                    {"time_steps", mean.time_steps},
                    {"facets_full", mean.facets_full},
                    {"facets", mean.facets},
                    {"rays", mean.rays},
                    {"segments", mean.segments}};
  for (const auto& [stage, seconds] : mean.stages.stages()) json["stages_s"][stage] = seconds;
  return json;
}

ordered_json equal_error_json(const std::optional<EqualError>& equal) {
  if (!equal) return nullptr;
  return {
      {"first_s", equal->first_seconds},   {"second_s", equal->second_seconds},
      {"speedup", equal->speedup},         {"speedup_std_error", json_of(equal->speedup_std_error)},
      {"first_noise", equal->first_noise}, {"second_noise", equal->second_noise},
      {"systematic", equal->systematic}};
}

// --- text ----------------------------------------------------------------------------------------

std::string with_error(double value, std::optional<double> error) {
  return error ? fmt::format("{:.2f} ± {:.2f}", value, *error) : fmt::format("{:.2f}", value);
}

/// Whether the second runs are simplified and the first are not: else their times say nothing of
/// what simplification saves.
bool shows_simplification(const Comparison& comparison) {
  const auto is_full = [](const RunCost& cost) { return cost.facets == cost.facets_full; };
  return std::ranges::all_of(comparison.first_costs, is_full) &&
         std::ranges::none_of(comparison.second_costs, is_full);
}

/// What the measured times say, in words.
std::string speed_text(const Comparison& comparison) {
  if (!comparison.speedup) return "";
  std::string text = fmt::format("time of {} / time of {}: {}", comparison.first, comparison.second,
                                 with_error(*comparison.speedup, comparison.speedup_std_error));
  const auto& equal = comparison.equal_error;
  if (equal && equal->speedup_std_error) {
    text +=
        fmt::format("; to equal error {}", with_error(equal->speedup, equal->speedup_std_error));
  } else if (equal) {
    text += fmt::format(
        "; to equal error roughly {:.1g}, run three seeds of each for a better estimate",
        equal->speedup);
  }
  if (!shows_simplification(comparison)) return text;
  if (equal && !equal->speedup_std_error) return text;
  const double speedup = equal ? equal->speedup : *comparison.speedup;
  const double error = equal ? *equal->speedup_std_error : comparison.speedup_std_error.value_or(0);
  if (speedup + error < 1) {
    text += fmt::format(": {} was not worth it here", comparison.second);
  } else if (speedup - error < 1) {
    text += ": these runs do not show whether it was worth it";
  }
  return text;
}

/// What is beyond its tolerance by chance.
int unsure_count(const Comparison& comparison) {
  const auto is_noise = [](Verdict verdict) { return verdict == Verdict::noise ? 1 : 0; };
  int count = 0;
  for (const ComparedValue& each : comparison.values) count += is_noise(each.verdict);
  for (const ComparedDistance& each : comparison.distances)
    count += is_noise(each.mean_verdict) + is_noise(each.p99_verdict);
  return count;
}

/// How many values within their tolerances differ by more than chance explains.
std::string differences_text(const Comparison& comparison) {
  const auto count = std::ranges::count_if(comparison.values, [](const ComparedValue& each) {
    return each.significance.chance && each.significance.is_significant.value_or(false);
  });
  if (count == 0) return "";
  return fmt::format("; {} {} by more than chance explains", count,
                     count == 1 ? "value differs" : "values differ");
}

std::string verdict_text(const Comparison& comparison) {
  const int unsure = unsure_count(comparison);
  const std::string names = fmt::format("{} against {}", comparison.second, comparison.first);
  const std::string rest = fmt::format(
      "{} beyond their tolerance, but within the spread of seeds: run more seeds", unsure);
  if (!comparison.reaches_ends() && comparison.moved().size() == 1)
    return fmt::format("{}: within the tolerances up to {:.6g} s, but not compared to the end",
                       names, comparison.distances.back().time);
  if (!comparison.passed()) return names + ": moved" + (unsure > 0 ? "; besides " + rest : "");
  if (unsure > 0) return names + ": no certain change; " + rest;
  return names + ": within the tolerances at every output" + differences_text(comparison);
}

// --- page ----------------------------------------------------------------------------------------

const char* class_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::within:
      return "good";
    case Verdict::noise:
      return "unsure";
    case Verdict::moved:
      return "bad";
    case Verdict::none:
      break;
  }
  return "";
}

std::string number_text(double value) { return fmt::format("{:.5g}", value); }

std::string number_text(std::optional<double> value) { return value ? number_text(*value) : ""; }

std::string text_of(const Sample& sample) {
  if (sample.count == 0) return "-";
  return sample.spread ? fmt::format("{:.5g} ± {:.2g}", sample.mean, *sample.spread)
                       : number_text(sample.mean);
}

std::string values_table(const Comparison& comparison, bool is_judged) {
  const std::vector<std::string> head{"value",          "verdict",         "t [s]",
                                      comparison.first, comparison.second, "difference",
                                      "std error",      "tolerance",       "significant"};
  std::vector<std::vector<TableCell>> rows;
  for (const ComparedValue& each : comparison.values) {
    if ((each.verdict != Verdict::none) != is_judged) continue;
    rows.push_back({{each.name},
                    {is_judged ? name_of(each.verdict) : "", class_of(each.verdict)},
                    {number_text(each.time)},
                    {text_of(each.first)},
                    {text_of(each.second)},
                    {number_text(each.difference)},
                    {number_text(each.std_error)},
                    {number_text(each.tolerance)},
                    {each.significance.is_significant.value_or(false) ? "yes" : ""}});
  }
  return html_table(head, rows);
}

std::string distances_table(const Comparison& comparison) {
  const std::vector<std::string> head{"t [s]", "way", "mean", "rms", "99 %", "max"};
  std::vector<std::vector<TableCell>> rows;
  const auto add = [&](double time, const char* way, const DistanceStatistics& each, Verdict mean,
                       Verdict p99) {
    rows.push_back({{number_text(time)},
                    {way},
                    {number_text(each.mean), class_of(mean)},
                    {number_text(each.rms)},
                    {number_text(each.p99), class_of(p99)},
                    {number_text(each.max)}});
  };
  for (const ComparedDistance& each : comparison.distances) {
    add(each.time, "there", each.forward, each.mean_verdict, each.p99_verdict);
    add(each.time, "back", each.reverse, each.mean_verdict, each.p99_verdict);
    if (each.between_seeds)
      add(each.time, "between seeds", *each.between_seeds, Verdict::none, Verdict::none);
  }
  return html_table(head, rows);
}

std::string costs_table(const Comparison& comparison) {
  const std::vector<std::string> head{"mean over runs", comparison.first, comparison.second};
  const RunCost first = mean_cost(comparison.first_costs);
  const RunCost second = mean_cost(comparison.second_costs);
  std::vector<std::vector<TableCell>> rows;
  const auto add = [&](const std::string& name, double a, double b) {
    rows.push_back({{name}, {number_text(a)}, {number_text(b)}});
  };
  add("runs", static_cast<double>(comparison.first_costs.size()),
      static_cast<double>(comparison.second_costs.size()));
  add("time steps", first.time_steps, second.time_steps);
  add("facets of the extracted surface", first.facets_full, second.facets_full);
  add("facets that the flux is solved on", first.facets, second.facets);
  add("rays", first.rays, second.rays);
  add("ray segments", first.segments, second.segments);
  for (const auto& [stage, seconds] : first.stages.stages())
    add(stage + " [s]", seconds, second.stages.seconds(stage));
  add("all stages [s]", first.seconds(), second.seconds());
  if (const auto& equal = comparison.equal_error) {
    add("distance between two seeds at the end [spacings]", equal->first_noise,
        equal->second_noise);
    add("time to equal error [s]", equal->first_seconds, equal->second_seconds);
  }
  return html_table(head, rows);
}

/// Lines in um.
std::vector<std::vector<std::array<double, 2>>> in_um(std::span<const Polyline> lines) {
  std::vector<std::vector<std::array<double, 2>>> result;
  for (const Polyline& line : lines) {
    result.emplace_back();
    for (const auto& [x, z] : line.points) result.back().push_back({1e-3 * x, 1e-3 * z});
  }
  return result;
}

std::string profiles_svg(const Comparison& comparison) {
  Plot plot{.title = "Profiles of the first seeds, at every output",
            .x_label = "x [um]",
            .y_label = "z [um]",
            .curves = {{.name = comparison.first, .colour = 0, .lines = {}},
                       {.name = comparison.second, .colour = 1, .is_dashed = true, .lines = {}}},
            .has_equal_scales = true};
  for (const ComparedProfile& profile : comparison.profiles) {
    for (auto& line : in_um(profile.first)) plot.curves[0].lines.push_back(std::move(line));
    for (auto& line : in_um(profile.second)) plot.curves[1].lines.push_back(std::move(line));
  }
  return plot_svg(plot);
}

/// How far the last profiles are apart, along the first.
std::string apart_svg(const Comparison& comparison) {
  const ComparedProfile& last = comparison.profiles.back();
  const DistanceToLines distance(last.second);
  Curve curve{.name = "", .colour = 1, .lines = {}};
  double along = 0;
  for (const Polyline& line : last.first) {
    curve.lines.emplace_back();
    const std::array<double, 2>* before = nullptr;
    for (const auto& point : line.points) {
      if (before != nullptr) along += std::hypot(point[0] - (*before)[0], point[1] - (*before)[1]);
      before = &point;
      curve.lines.back().push_back({1e-3 * along, distance(point) / comparison.spacing});
    }
  }
  return plot_svg({.title = fmt::format("Distance between these profiles at t = {} s",
                                        plain_number(last.time, 4)),
                   .x_label = fmt::format("along the profile of {} [um]", comparison.first),
                   .y_label = "[spacings]",
                   .curves = {curve}});
}

std::string flux_svg(const ComparedFlux& flux, const Comparison& comparison) {
  Plot plot{.title = fmt::format(
                "{} at t = {} s: difference {:.2g} rms{}", flux.name, plain_number(flux.time, 4),
                flux.rms_difference,
                flux.rms_std_error ? fmt::format(", by chance {:.2g}", *flux.rms_std_error) : ""),
            .x_label = fmt::format("along the profile of {} [um]", comparison.first),
            .y_label = "flux, relative to an open wafer",
            .curves = {}};
  Curve first{.name = comparison.first, .colour = 0, .lines = {{}}};
  Curve second{.name = comparison.second, .colour = 1, .is_dashed = true, .lines = {{}}};
  for (std::size_t n = 0; n < flux.place.size(); ++n) {
    first.lines[0].push_back({1e-3 * flux.place[n], flux.first[n]});
    second.lines[0].push_back({1e-3 * flux.place[n], flux.second[n]});
  }
  plot.curves = {std::move(first), std::move(second)};
  return plot_svg(plot);
}

/// Those of the last output that has any.
std::string last_fluxes(const Comparison& comparison) {
  std::string svg;
  for (const ComparedFlux& flux : comparison.fluxes)
    if (flux.time == comparison.fluxes.back().time) svg += flux_svg(flux, comparison);
  return svg;
}

std::string rules_text(const Comparison& comparison) {
  if (!comparison.tolerances) return "";
  const Tolerances& allowed = *comparison.tolerances;
  return fmt::format(
      "<p>Allowed: widths, depths and heights {:g} spacings + {:g} %, films and step coverage {:g} "
      "spacings + {:g} %, volumes {:g} spacings on the surface of the material + {:g} %, mean "
      "distance {:g} spacings, 99 % of it {:g}, at every output. <b>moved</b>: beyond that, and "
      "seeds do not explain it; <b>noise</b>: beyond that, but seeds explain it. "
      "<b>significant</b>: seeds do not explain it, within the tolerance or not; by chance in "
      "0.27 % of comparisons. A spacing is {:g} nm. ± is the spread of the seeds.</p>\n",
      allowed.length_cells, 100 * allowed.length_part, allowed.film_cells, 100 * allowed.film_part,
      allowed.volume_cells, 100 * allowed.volume_part, allowed.mean_distance, allowed.p99_distance,
      comparison.spacing);
}

constexpr const char* equal_error_note =
    "<p>Time to equal error: the time of the flux times the ratio of the variances between seeds, "
    "plus that of the other stages. Noise is the mean distance between the surfaces of two seeds "
    "at the end. The rest of the distance is systematic: ";

std::string section_of(const Comparison& comparison, const std::string& scene) {
  std::string html = fmt::format("<h2>{} against {}</h2>\n<p class=\"{}\">{}</p>\n",
                                 escaped(comparison.second), escaped(comparison.first),
                                 class_of(!comparison.passed()           ? Verdict::moved
                                          : unsure_count(comparison) > 0 ? Verdict::noise
                                                                         : Verdict::within),
                                 escaped(verdict_text(comparison)));
  for (const std::string& warning : comparison.warnings)
    html += "<p class=\"unsure\">" + escaped(warning) + "</p>\n";
  const std::vector<std::string> moved = comparison.moved();
  if (!moved.empty()) {
    html += "<ul>\n";
    for (const std::string& line : moved) html += "<li class=\"bad\">" + escaped(line) + "</li>\n";
    html += "</ul>\n";
  }
  if (comparison.speedup) html += "<p>" + escaped(speed_text(comparison)) + ".</p>\n";
  html += rules_text(comparison);
  html += scene;
  html += "<div class=\"plots\">\n" + profiles_svg(comparison) + apart_svg(comparison) +
          last_fluxes(comparison) + "</div>\n";
  html += "<h3>Distances between surfaces [spacings]</h3>\n" + distances_table(comparison);
  html += "<details><summary>Values with a tolerance</summary>\n" + values_table(comparison, true) +
          "</details>\n";
  html += "<details><summary>Values without one</summary>\n" + values_table(comparison, false) +
          "</details>\n";
  if (!comparison.first_costs.empty() && !comparison.second_costs.empty())
    html += "<h3>Cost</h3>\n" + costs_table(comparison);
  if (comparison.equal_error)
    html += fmt::format("{}{:.2g} spacings.</p>\n", equal_error_note,
                        comparison.equal_error->systematic);
  return html;
}

}  // namespace

ordered_json comparison_json(const Comparison& comparison) {
  ordered_json json{{"passed", comparison.passed()},
                    {"significant", comparison.is_significant()},
                    {"first", comparison.first},
                    {"second", comparison.second},
                    {"moved", comparison.moved()},
                    {"warnings", comparison.warnings},
                    {"speedup", json_of(comparison.speedup)},
                    {"speedup_std_error", json_of(comparison.speedup_std_error)},
                    {"time_to_equal_error", equal_error_json(comparison.equal_error)},
                    {"spacing_nm", comparison.spacing}};
  for (const char* list : {"distance", "metrology", "flux"}) json[list] = ordered_json::array();
  for (const ComparedDistance& each : comparison.distances)
    json["distance"].push_back(json_of(each));
  for (const ComparedValue& each : comparison.values) json["metrology"].push_back(json_of(each));
  for (const ComparedFlux& each : comparison.fluxes) json["flux"].push_back(json_of(each));
  json["cost"] = {{"first", cost_json(comparison.first_costs)},
                  {"second", cost_json(comparison.second_costs)}};
  return json;
}

std::string comparison_text(const Comparison& comparison) {
  std::string text = verdict_text(comparison) + '\n';
  for (const std::string& line : comparison.moved()) text += "  " + line + '\n';
  const ComparedDistance& last = comparison.distances.back();
  text += fmt::format("distance at {}: mean {:.3g}, 99 % {:.3g}, max {:.3g} spacings\n",
                      comparison.reaches_ends() ? "the end" : fmt::format("{:.6g} s", last.time),
                      std::max(last.forward.mean, last.reverse.mean),
                      std::max(last.forward.p99, last.reverse.p99),
                      std::max(last.forward.max, last.reverse.max));
  if (comparison.speedup) text += speed_text(comparison) + '\n';
  return text;
}

std::string comparison_page(std::span<const PageEntry> entries, const PageOrigin& origin) {
  std::string body = "<h1>" + escaped(origin.title) + "</h1>\n";
  for (const auto& [each, scene] : entries) {
    // Of many, those that need no look are folded.
    const bool is_folded = entries.size() > 3 && each.passed();
    if (is_folded) body += "<details><summary>" + escaped(verdict_text(each)) + "</summary>\n";
    body += section_of(each, scene);
    if (is_folded) body += "</details>\n";
  }
  if (!origin.recipe.empty())
    body +=
        "<details><summary>Recipe</summary>\n<pre>" + escaped(origin.recipe) + "</pre></details>\n";
  body += fmt::format("<p>scarp {}, {} threads.</p>\n", SCARP_VERSION, thread_count());
  return html_page(origin.title, body);
}

}  // namespace scarp

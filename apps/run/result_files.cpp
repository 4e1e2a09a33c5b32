#include "apps/run/result_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>

#include "apps/run/metrology_files.h"
#include "apps/run/own_files.h"
#include "apps/run/picture.h"
#include "apps/run/restart.h"
#include "apps/simulator/region_text.h"
#include "apps/simulator/state_file.h"
#include "apps/simulator/surface_speeds.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/recipe/csv.h"
#include "core/recipe/quantity.h"
#include "core/system/atomic_file.h"
#include "core/system/folder_lock.h"
#include "core/system/hash.h"
#include "core/system/peak_memory.h"
#include "flux/rays/embree_tree.h"
#include "levelset/grid/symmetry.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/surface/extract_surface.h"
#include "mesh/files/mesh_file.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

// The worst of all species, and their sums.
struct FluxTotals {
  std::uint64_t segments = 0;
  std::uint64_t rays = 0;
  double error = 0;
  double bias = 0;
  double lost = 0;
  double balance_error = 0;
};

FluxTotals totals_of(std::span<const FluxField> flux) {
  FluxTotals totals;
  for (const FluxField& field : flux) {
    totals.segments += field.segments;
    totals.rays += field.rays;
    totals.error = std::max(totals.error, field.error);
    totals.bias = std::max(totals.bias, field.bias);
    if (field.audit.emitted > 0) totals.lost += field.audit.lost() / field.audit.emitted;
    const double balance = field.audit.balance_error();
    if (std::abs(balance) > std::abs(totals.balance_error)) totals.balance_error = balance;
  }
  return totals;
}

// Closed voids, the largest first.
nlohmann::ordered_json void_list(const State& state, std::span<const Region> voids) {
  std::vector<std::size_t> order(voids.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return voids[a].volume > voids[b].volume; });
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const std::size_t n : order) {
    const nlohmann::ordered_json each{{"volume_nm3", voids[n].volume},
                                      {"lowest_nm", voids[n].lower},
                                      {"highest_nm", voids[n].upper},
                                      {"closed_at_s", state.voids[n].time}};
    for (int image = 0; image < voids[n].images; ++image) list.push_back(each);
  }
  return list;
}

// The cut through the middle of the domain, across the y direction.
SectionLine middle(const Frame& frame) { return parse_section("y = 0 nm", frame); }

// Why a step ended.
std::string cause_of(const ProcessStep& step, const StepEnd& end) {
  if (step.operation) return "at_once";
  return step.until && !end.out_of_time ? name_of(step.until->kind) : step.duration_key;
}

// Why a repeat ended, at the end of its last round; empty elsewhere, and where it has no until.
std::string cause_of(const RoundEnd& round, const StepEnd& end) {
  if (end.ends_repeat) return name_of(round.until.kind);
  return round.steps_left == 0 ? "repeat" : "";
}

// Those with an until that are over.
nlohmann::ordered_json repeat_list(const State& state, std::span<const ProcessStep> steps) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (std::size_t n = 0; n < state.ends.size(); ++n) {
    const auto& round = steps[n].round_end;
    if (!round || state.ends[n].skipped) continue;
    const std::string cause = cause_of(*round, state.ends[n]);
    if (cause.empty()) continue;
    list.push_back({{"name", round->name},
                    {"rounds", round->round},
                    {"end_s", state.ends[n].time},
                    {"ended_by", cause}});
  }
  return list;
}

// What covers the surface in some step of a recipe, each once.
std::vector<std::string> coverage_names(std::span<const ProcessStep> steps) {
  std::vector<std::string> names;
  for (const ProcessStep& step : steps) {
    for (const std::string& name : coverage_names(step.model.get()))
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return names;
}

// The area of the surface, the volume below it and its growth, and for every name what that
// coverage takes up and what it took over.
std::string area_cells(const Survey& survey, const Frame& frame, const SurfaceModel* model,
                       std::span<const ProcessStep> steps) {
  const double images = frame.facet_images();
  const std::vector<double> areas = areas_around(survey.facets, frame);
  std::string cells = ',' +
                      format_number(images * std::accumulate(areas.begin(), areas.end(), 0.0)) +
                      ',' + format_number(survey.volume) + ',' + format_number(survey.growth.net);
  const std::vector<double> covered = covered_areas(areas, survey.coverages);
  const std::vector<std::string> known = coverage_names(model);
  const auto cell = [&](std::span<const double> of_known, const std::string& name) {
    const auto k = static_cast<std::size_t>(std::ranges::find(known, name) - known.begin());
    return ',' + (k < of_known.size() ? format_number(images * of_known[k]) : "");
  };
  for (const std::string& name : coverage_names(steps))
    cells += cell(covered, name) + cell(survey.carried_areas, name);
  return cells;
}

nlohmann::ordered_json step_list(const State& state, std::span<const ProcessStep> steps) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  double start = state.origin.time;
  for (std::size_t n = 0; n < state.ends.size(); ++n) {
    const StepEnd& end = state.ends[n];
    if (end.skipped) continue;
    const nlohmann::ordered_json reached =
        end.reached ? nlohmann::ordered_json(*end.reached) : nlohmann::ordered_json();
    list.push_back({{"name", steps[n].name},
                    {"start_s", start},
                    {"end_s", end.time},
                    {"ended_by", cause_of(steps[n], end)},
                    {"reached_s", reached}});
    start = end.time;
  }
  return list;
}

// The numbers that stand for the materials in surface_NNNN.vtp, of those in the stack.
nlohmann::ordered_json material_numbers(const Layers& layers, const Materials& materials) {
  nlohmann::ordered_json numbers;
  for (const Layer& layer : layers.stack) numbers[materials[layer.material].name] = layer.material;
  return numbers;
}

// Of line n of Sections: names of its pictures and points begin with it.
std::string section_name(std::size_t n) {
  return n == 0 ? "profile" : fmt::format("section_{}", n);
}

// All outputs of line n in one picture.
std::string whole_picture(std::size_t n) {
  return n == 0 ? "profiles.svg" : section_name(n) + ".svg";
}

bool is_preview(const std::string& name) {
  return name == "preview.csv" || name == "preview.vtp" || name == "preview.svg";
}

std::string machine_name() {
  std::ifstream cpu("/proc/cpuinfo");
  for (std::string line; std::getline(cpu, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

}  // namespace

void write_surface(const fs::path& file, const State& state, const Survey& survey,
                   const ProcessStep& step, const Materials& materials) {
  const std::vector<float> speed = facet_speeds(state, survey);
  MeshFields fields{
      .facets = {}, .vertices = {}, .material_names = materials.names(), .time = state.time};
  const std::vector<Species> species = step.model ? step.model->species() : std::vector<Species>{};
  if (step.model && step.model->bath() != nullptr)
    fields.facets.push_back({"concentration_" + step.model->bath()->solute().name,
                             std::span(survey.flux.front().arrivals().mean)});
  for (std::size_t s = 0; s < species.size(); ++s) {
    const std::string suffix = species.size() > 1 ? "_" + species[s].name : "";
    fields.facets.push_back({"flux" + suffix, std::span(survey.flux[s].arrivals().mean)});
    fields.facets.push_back(
        {"flux_std_error" + suffix, std::span(survey.flux[s].arrivals().std_error)});
    for (std::size_t k = 0; k < species[s].yields.size(); ++k) {
      const Tally& tally = survey.flux[s].tallies[1 + k];
      fields.facets.push_back({"yield_" + species[s].yields[k].name, std::span(tally.mean)});
      fields.facets.push_back(
          {"yield_std_error_" + species[s].yields[k].name, std::span(tally.std_error)});
    }
  }
  const std::vector<std::string> covers = coverage_names(step.model.get());
  for (std::size_t k = 0; k < survey.coverages.size(); ++k)
    fields.facets.push_back({"coverage_" + covers[k], std::span(survey.coverages[k])});
  fields.facets.push_back({"speed_nm_s", std::span(speed)});
  const Frame& frame = state.layers.frame;
  std::vector<std::vector<float>> with_those_of_images;
  with_those_of_images.reserve(fields.facets.size());
  for (FieldView& field : fields.facets) {
    const auto& values = std::get<std::span<const float>>(field.values);
    field.values =
        std::span<const float>(with_those_of_images.emplace_back(with_images(values, frame)));
  }
  write_vtp(file, with_images(survey.facets, frame), fields);
}

std::string moment_of(const State& state, std::span<const ProcessStep> steps) {
  if (state.time > state.step_start) return "in " + current_step(state, steps).name;
  std::size_t last = state.step;
  while (last > 0 && state.ends[last - 1].skipped) --last;
  return last == 0 ? "start" : "after " + steps[last - 1].name;
}

Sections::Sections(const Frame& frame, std::span<const SectionLine> lines,
                   const Materials& materials)
    : materials_(materials), lines_{middle(whole_of(frame))} {
  lines_.insert(lines_.end(), lines.begin(), lines.end());
  earlier_.resize(lines_.size());
}

void Sections::add(double time, const Layers& layers) {
  const std::vector<TriMesh> surfaces = layer_surfaces(layers);
  for (std::size_t n = 0; n < lines_.size(); ++n)
    earlier_[n].push_back({.time = time, .lines = exposed_lines(cut(layers, surfaces, lines_[n]))});
}

void Sections::write(const fs::path& folder, int number, double time, const Layers& layers,
                     const std::string& title, const std::string& moment) {
  const std::vector<TriMesh> surfaces = layer_surfaces(layers);
  for (std::size_t n = 0; n < lines_.size(); ++n) {
    const fs::path file = folder / fmt::format("{}_{:04}.csv", section_name(n), number);
    ProfileView view{
        .title = title + ": " + (lines_[n].text.empty() ? moment : lines_[n].text + ", " + moment),
        .layers = cut(layers, surfaces, lines_[n]),
        .left = lines_[n].left,
        .right = lines_[n].right};
    write_section_csv(file, view.layers, lines_[n], materials_);
    write_svg(fs::path(file).replace_extension(".svg"), view, materials_);
    view.earlier = some_of(earlier_[n]);
    write_svg(folder / whole_picture(n), view, materials_);
    earlier_[n].push_back({.time = time, .lines = exposed_lines(view.layers)});
  }
}

std::vector<std::string> section_files(std::size_t section_count, int output_count) {
  std::vector<std::string> files;
  for (std::size_t n = 0; n <= section_count; ++n) {
    files.push_back(whole_picture(n));
    for (int number = 0; number < output_count; ++number)
      for (const char* ending : {"csv", "svg"})
        files.push_back(fmt::format("{}_{:04}.{}", section_name(n), number, ending));
  }
  return files;
}

std::string metrics_head(std::span<const ProcessStep> steps, const Simplification& simplification) {
  std::string head =
      "step,step_name,time_s,dt_s,vertices_full,vertices,facets_full,facets,simplify_max_distance,"
      "segments,rays,flux_error,lost_weight,balance_error,t_surface_s,t_simplify_s,t_flux_s,"
      "t_map_s,t_advect_s,voids,void_volume_nm3,islands,island_volume_nm3,coverage_iterations,"
      "position_error_nm,ended_by,residue_volume_nm3,repeat_ended_by,mesh_made_at,surface_area_nm2,"
      "solid_volume_nm3,growth_nm3_per_s";
  for (const std::string& name : coverage_names(steps))
    head += fmt::format(",covered_{0}_nm2,carried_{0}_nm2", name);
  head += ",flux_bias";
  if (simplification.where_it_pays) head += ",simplify_left_out";
  return head + ",time_step\n";
}

std::string metrics_row(const State& after, std::size_t step, const Survey& survey,
                        const Move& move, std::span<const ProcessStep> steps,
                        const Simplification& simplification) {
  const FluxTotals flux = totals_of(survey.flux);
  std::string row = fmt::format(
      "{},{},{},{},{},{},{},{},{},{},{},{},{},{}", step, csv_field(steps[step].name),
      format_number(after.time), format_number(move.dt), survey.vertices_full,
      survey.facets.vertices.size(), survey.facets_full, survey.facets.triangles.size(),
      format_number(survey.simplify_max_distance), flux.segments, flux.rays,
      format_number(flux.error), format_number(flux.lost), format_number(flux.balance_error));
  StageTimer timer = survey.timer;
  timer.add(move.timer);
  for (const char* stage : {"surface", "simplify", "flux", "map", "advect"})
    row += fmt::format(",{:.6f}", timer.seconds(stage));
  row += fmt::format(",{},{},{},{},{}", count_of(survey.gas.voids),
                     format_number(volume_of(survey.gas.voids)), count_of(move.islands),
                     format_number(volume_of(move.islands)), survey.coverage_fit.iterations);
  const std::optional<double> error = position_error(survey, move.dt);
  const ProcessStep& of_row = steps[step];
  const bool is_last = after.step != step;
  const bool is_end_of_round = is_last && of_row.round_end;
  row += fmt::format(",{},{},{}", error ? format_number(*error) : "",
                     is_last ? cause_of(of_row, after.ends[step]) : "",
                     format_number(move.residue_volume));
  row += ',' + (is_end_of_round ? cause_of(*of_row.round_end, after.ends[step]) : "");
  row += fmt::format(",{}", survey.made_at);
  row += area_cells(survey, after.layers.frame, of_row.model.get(), steps);
  row += ',' + format_number(flux.bias);
  if (simplification.where_it_pays) row += ',' + cell_of(survey.simplify_choice);
  return row + fmt::format(",{}\n", after.time_step - 1);
}

std::string summary_text(const State& state, const Survey& survey, const Metrology& metrology,
                         const Recipe& recipe, const RunTotals& totals) {
  nlohmann::ordered_json summary;
  summary["title"] = recipe.title;
  summary["complete"] = true;
  summary["process_time_s"] = state.time;
  summary["recipe_hash"] = hash_of(recipe.resolved);
  summary["start_state_hash"] = recipe.start.state ? recipe.start.state->hash : "";
  summary["time_steps"] = state.time_step - state.origin.time_step;
  summary["outputs"] = totals.output_times.size();
  summary["output_times_s"] = totals.output_times;
  summary["steps"] = step_list(state, recipe.steps);
  summary["repeats"] = repeat_list(state, recipe.steps);
  summary["state_hash"] = state_hash(state, recipe.materials);
  summary["rows_hash"] = totals.rows_hash;
  const FluxTarget& flux = totals.flux;
  const double target = flux.wanted.value;
  summary["flux"] = {{"in_position", flux.wanted.in_position},
                     {"target", target > 0 ? nlohmann::ordered_json(target) : nullptr},
                     {"largest_error", flux.largest},
                     {"time_steps_missed", flux.missed}};
  summary["simplify_left_out"] = {{"no_rays", totals.left_out.no_rays},
                                  {"few_facets", totals.left_out.few_facets}};
  summary["metrology"] =
      metrology_json(metrology, {.materials = recipe.materials, .options = recipe.metrology});
  summary["void_count"] = count_of(survey.gas.voids);
  summary["void_volume_nm3"] = volume_of(survey.gas.voids);
  summary["voids"] = void_list(state, survey.gas.voids);
  summary["islands_removed"] = {{"count", state.islands.count},
                                {"volume_nm3", state.islands.volume}};
  summary["residue_volume_nm3"] = state.residue_volume;
  summary["materials"] = material_numbers(state.layers, recipe.materials);
  summary["wall_s"] = totals.wall_seconds;
  for (const auto& [stage, seconds] : totals.stages.stages()) summary["stages_s"][stage] = seconds;
  summary["peak_memory_mb"] = peak_memory_mb();
  summary["threads"] = thread_count();
  summary["machine"] = machine_name();
  summary["versions"] = {{"scarp", SCARP_VERSION},
                         {"openvdb", SCARP_OPENVDB_VERSION},
                         {"embree", embree_version()},
                         {"compiler", __VERSION__}};
  summary["embree"] = embree_configuration();
  return summary.dump(2) + "\n";
}

Preview write_preview(const fs::path& folder, const Recipe& recipe) {
  const FolderLock lock(folder);
  const fs::path points = folder / "preview.csv";
  require_own(folder, "a preview", begins_with(points, "material,layer,line,"), is_preview);
  State state = prepared_state(recipe.domain.frame, recipe.start, recipe.steps, recipe.materials);
  Preview preview{.layers = std::move(state.layers),
                  .surface = {},
                  .voids = {},
                  .islands = state.islands,
                  .volumes = {}};
  preview.surface = extract_surface(preview.layers);
  preview.voids = open_gas(preview.layers).voids;
  const std::vector<TriMesh> surfaces = layer_surfaces(preview.layers);
  preview.volumes = material_volumes(surfaces, preview.layers.frame);
  const SectionLine line = middle(recipe.domain.frame);
  const ProfileView view{
      .title = line.text.empty() ? recipe.title : recipe.title + ": " + line.text,
      .layers = cut(preview.layers, surfaces, line),
      .left = line.left,
      .right = line.right};
  // The mark of a preview comes first.
  write_section_csv(points, view.layers, line, recipe.materials);
  write_vtp(folder / "preview.vtp", preview.surface,
            {.facets = {}, .vertices = {}, .material_names = recipe.materials.names()});
  write_svg(folder / "preview.svg", view, recipe.materials);
  return preview;
}

}  // namespace scarp

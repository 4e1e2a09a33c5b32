#include "apps/results.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/picture.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/quantity.h"
#include "levelset/checkpoint.h"
#include "levelset/cross_section.h"
#include "levelset/extract_surface.h"
#include "mesh/mesh_file.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

constexpr const char* interrupted_state = "state_interrupted.vdb";
constexpr const char* metrics_head =
    "step,step_name,time_s,dt_s,vertices_full,vertices,facets_full,facets,simplify_max_distance,"
    "segments,rays,flux_error,lost_weight,balance_error,t_surface_s,t_simplify_s,t_flux_s,t_map_s,"
    "t_advect_s,time_step\n";

std::string numbered(const char* stem, int number, const char* ending) {
  return fmt::format("{}_{:04}{}", stem, number, ending);
}

std::string read_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// The files of a run, told apart from a user's own by their names.
bool is_result(const std::string& name) {
  const auto starts = [&](const char* stem) { return name.rfind(stem, 0) == 0; };
  const auto ends = [&](const char* end) { return fs::path(name).extension() == end; };
  return name == "recipe.toml" || name == "metrics.csv" || name == "summary.json" ||
         name == "surface.pvd" || (starts("surface_") && ends(".vtp")) ||
         (starts("state_") && ends(".vdb")) ||
         (starts("profile_") && (ends(".csv") || ends(".svg")));
}

// A name in CSV: in quotes where it holds a comma, a quote or a line end.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c;
    if (c == '"') quoted += '"';
  }
  return quoted + '"';
}

// The worst of all species, and their sums.
struct FluxTotals {
  std::uint64_t segments = 0;
  std::uint64_t rays = 0;
  double error = 0;
  double lost = 0;
  double balance_error = 0;
};

FluxTotals totals_of(std::span<const FluxField> flux) {
  FluxTotals totals;
  for (const FluxField& field : flux) {
    totals.segments += field.segments;
    totals.rays += field.rays;
    totals.error = std::max(totals.error, field.error);
    if (field.audit.emitted > 0) totals.lost += field.audit.lost() / field.audit.emitted;
    const double balance = field.audit.balance_error();
    if (std::abs(balance) > std::abs(totals.balance_error)) totals.balance_error = balance;
  }
  return totals;
}

std::string recipe_hash(const Recipe& recipe) {
  Hash hash;
  hash.add(recipe.resolved);
  return hash.hex();
}

CheckpointNotes notes_of(const State& state, const Recipe& recipe, int output_count) {
  return {{"time_s", format_number(state.time)},
          {"step", std::to_string(state.step)},
          {"step_start_s", format_number(state.step_start)},
          {"time_step", std::to_string(state.time_step)},
          {"seed", std::to_string(recipe.flux.seed)},
          {"outputs", std::to_string(output_count)},
          {"recipe_hash", recipe_hash(recipe)}};
}

double number_of(const CheckpointNotes& notes, const std::string& key, const fs::path& file) {
  const auto entry = notes.find(key);
  if (entry == notes.end()) {
    throw InputError(fmt::format("{}: the entry {} is missing; this is not a checkpoint of a run",
                                 file.string(), key));
  }
  return std::stod(entry->second);
}

// The cut through the middle of the domain, across the y direction.
std::vector<LayerProfile> middle_profile(const Layers& layers) {
  const std::vector<std::vector<Polyline>> lines = cross_section(layers, 1, 0.0);
  std::vector<LayerProfile> profile;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    profile.push_back({layers.stack[k].material, lines[k]});
  }
  return profile;
}

void write_profile(const fs::path& file, std::span<const LayerProfile> layers,
                   const Materials& materials) {
  AtomicFile out(file);
  out.write("material,layer,line,x_nm,z_nm\n");
  for (std::size_t k = 0; k < layers.size(); ++k) {
    for (std::size_t line = 0; line < layers[k].lines.size(); ++line) {
      for (const auto& [x, z] : layers[k].lines[line].points) {
        out.write(fmt::format("{},{},{},{:.6g},{:.6g}\n",
                              csv_field(materials[layers[k].material].name), k, line, x, z));
      }
    }
  }
  out.commit();
}

void write_surface(const fs::path& file, const State& state, const Survey& survey,
                   const Recipe& recipe) {
  const std::vector<float> speed = facet_speeds(state, survey);
  MeshFields fields;
  const std::vector<Species> species = current_step(state, recipe).model->species();
  for (std::size_t s = 0; s < survey.flux.size(); ++s) {
    const std::string suffix = species.size() > 1 ? "_" + species[s].name : "";
    fields.facets.push_back({"flux" + suffix, std::span(survey.flux[s].arrivals().mean)});
    fields.facets.push_back(
        {"flux_std_error" + suffix, std::span(survey.flux[s].arrivals().std_error)});
  }
  fields.facets.push_back({"speed_nm_s", std::span(speed)});
  write_vtp(file, survey.facets, fields);
}

std::string machine_name() {
  std::ifstream cpu("/proc/cpuinfo");
  for (std::string line; std::getline(cpu, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

}  // namespace

Preview write_preview(const fs::path& folder, const Recipe& recipe) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    throw InputError(fmt::format("{}: the folder cannot be made: {}; choose another with -o",
                                 folder.string(), error.message()));
  }
  Preview preview{.layers = build_layers(recipe.frame, recipe.geometry), .surface = {}};
  preview.surface = extract_surface(preview.layers);
  write_vtp(folder / "preview.vtp", preview.surface, {});
  const std::vector<LayerProfile> profile = middle_profile(preview.layers);
  write_profile(folder / "preview.csv", profile, recipe.materials);
  const Sides sides = recipe.frame.sides();
  write_svg(
      folder / "preview.svg",
      {.title = recipe.title, .layers = profile, .left = sides.lower[0], .right = sides.upper[0]},
      recipe.materials);
  return preview;
}

std::string state_hash(const State& state, const Recipe& recipe) {
  Hash result;
  for (const Layer& layer : state.layers.stack) {
    result.add(recipe.materials[layer.material].name);
    result.add("\n");
  }
  result.add_value(hash(state.layers));
  result.add_value(state.time);
  return result.hex();
}

ResultFolder::ResultFolder(fs::path folder) : path_(std::move(folder)) {
  std::error_code error;
  fs::create_directories(path_, error);
  if (error) {
    throw InputError(fmt::format("{}: the result folder cannot be made: {}; choose another with -o",
                                 path_.string(), error.message()));
  }
  // The kernel drops the lock when its process ends, however it ends: none is ever left over.
  lock_ = open(file(".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (lock_ < 0) {
    throw InputError(
        fmt::format("{}: the result folder cannot be written: {}; choose another with "
                    "-o",
                    path_.string(), std::strerror(errno)));
  }
  if (flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    close(lock_);
    throw InputError(
        fmt::format("{}: another run is writing here; wait for it or choose another "
                    "folder with -o",
                    path_.string()));
  }
}

ResultFolder::~ResultFolder() { close(lock_); }

bool ResultFolder::complete(const Recipe& recipe) const {
  return fs::exists(file("summary.json")) && read_text(file("recipe.toml")) == recipe.resolved;
}

void ResultFolder::start(const Recipe& recipe) {
  std::vector<fs::path> old;
  for (const auto& entry : fs::directory_iterator(path_)) {
    if (is_result(entry.path().filename().string())) old.push_back(entry.path());
  }
  for (const fs::path& each : old) fs::remove(each);
  output_count_ = 0;
  write_file(file("recipe.toml"), recipe.resolved);
  write_file(file("metrics.csv"), metrics_head);
}

std::optional<State> ResultFolder::resume(const Recipe& recipe) {
  std::vector<fs::path> checkpoints;
  for (const auto& entry : fs::directory_iterator(path_)) {
    const std::string name = entry.path().filename().string();
    if (is_result(name) && entry.path().extension() == ".vdb") checkpoints.push_back(entry.path());
  }
  if (checkpoints.empty()) return std::nullopt;
  if (read_text(file("recipe.toml")) != recipe.resolved) {
    throw InputError(
        fmt::format("{}: holds a run of another recipe (or of other settings); run "
                    "without --resume to start anew, or choose another folder with -o",
                    file("recipe.toml").string()));
  }
  // Outputs are numbered in the order of time; only an interrupted run has one beyond them.
  std::sort(checkpoints.begin(), checkpoints.end());
  std::optional<State> last;
  for (auto each = checkpoints.rbegin(); each != checkpoints.rend(); ++each) {
    const bool between = each->filename() == interrupted_state;
    if (last && !between) continue;
    Checkpoint checkpoint = read_checkpoint(*each);
    const auto value = [&](const char* key) { return number_of(checkpoint.notes, key, *each); };
    State state{.layers = std::move(checkpoint.layers),
                .time = value("time_s"),
                .step = static_cast<std::size_t>(value("step")),
                .step_start = value("step_start_s"),
                .time_step = static_cast<std::uint32_t>(value("time_step"))};
    if (last && last->time_step >= state.time_step) continue;
    output_count_ = static_cast<int>(value("outputs"));
    last = std::move(state);
    last_checkpoint_ = *each;
  }
  restore_series();

  // Rows of time steps that will be done again.
  std::istringstream rows(read_text(file("metrics.csv")));
  std::string kept;
  std::string row;
  for (std::uint32_t n = 0; n <= last->time_step && std::getline(rows, row); ++n)
    kept += row + '\n';
  write_file(file("metrics.csv"), kept);
  return last;
}

// Times of the outputs so far, from their checkpoints.
void ResultFolder::restore_series() {
  series_.clear();
  for (int number = 0; number < output_count_; ++number) {
    const fs::path state = file(numbered("state", number, ".vdb"));
    series_.push_back({number_of(read_checkpoint(state).notes, "time_s", state),
                       numbered("surface", number, ".vtp")});
  }
}

void ResultFolder::write_output(const State& state, const Survey& survey, const Recipe& recipe) {
  const int number = output_count_;
  write_surface(file(numbered("surface", number, ".vtp")), state, survey, recipe);
  const std::vector<LayerProfile> profile = middle_profile(state.layers);
  write_profile(file(numbered("profile", number, ".csv")), profile, recipe.materials);
  const Sides sides = recipe.frame.sides();
  write_svg(file(numbered("profile", number, ".svg")),
            {.title = fmt::format("{}, t = {:.4g} s", recipe.title, state.time),
             .layers = profile,
             .left = sides.lower[0],
             .right = sides.upper[0]},
            recipe.materials);
  series_.push_back({state.time, numbered("surface", number, ".vtp")});
  write_series(file("surface.pvd"), series_);
  // The checkpoint comes last: where it stands, the output is whole.
  ++output_count_;
  write_state(numbered("state", number, ".vdb"), state, recipe);
  fs::remove(file(interrupted_state));
}

void ResultFolder::write_state(const std::string& name, const State& state, const Recipe& recipe) {
  scarp::write_checkpoint(file(name), state.layers, notes_of(state, recipe, output_count_));
  last_checkpoint_ = file(name);
}

void ResultFolder::write_checkpoint(const State& state, const Recipe& recipe) {
  write_state(interrupted_state, state, recipe);
}

void ResultFolder::append_metrics(const State& after, std::size_t step, const Survey& survey,
                                  const Move& move, const Recipe& recipe) {
  const FluxTotals flux = totals_of(survey.flux);
  std::string row = fmt::format(
      "{},{},{},{},{},{},{},{},{},{},{},{},{},{}", step, csv_field(recipe.steps[step].name),
      format_number(after.time), format_number(move.dt), survey.vertices_full,
      survey.facets.vertices.size(), survey.facets_full, survey.facets.triangles.size(),
      format_number(survey.simplify_max_distance), flux.segments, flux.rays,
      format_number(flux.error), format_number(flux.lost), format_number(flux.balance_error));
  for (const char* stage : {"surface", "simplify", "flux"}) {
    row += fmt::format(",{:.6f}", survey.timer.seconds(stage));
  }
  for (const char* stage : {"map", "advect"}) {
    row += fmt::format(",{:.6f}", move.timer.seconds(stage));
  }
  row += fmt::format(",{}\n", after.time_step - 1);

  std::ofstream out(file("metrics.csv"), std::ios::app | std::ios::binary);
  out << row << std::flush;
  if (!out) {
    throw NumericalError(
        fmt::format("{}: a line could not be written: {}; make room and go on "
                    "with --resume",
                    file("metrics.csv").string(), std::strerror(errno)));
  }
}

void ResultFolder::write_summary(const State& state, const Survey& survey, const Recipe& recipe,
                                 const StageTimer& total, double wall_seconds) {
  nlohmann::ordered_json summary;
  summary["title"] = recipe.title;
  summary["complete"] = true;
  summary["process_time_s"] = state.time;
  summary["time_steps"] = state.time_step;
  summary["outputs"] = output_count_;
  summary["state_hash"] = state_hash(state, recipe);
  summary["metrology"] = {{"highest_nm", bounding_box(survey.facets).upper.z},
                          {"lowest_nm", bounding_box(survey.facets).lower.z}};
  summary["wall_s"] = wall_seconds;
  for (const auto& [stage, seconds] : total.stages()) summary["stages_s"][stage] = seconds;
  summary["peak_memory_mb"] = peak_memory_mb();
  summary["threads"] = thread_count();
  summary["machine"] = machine_name();
  summary["versions"] = {{"scarp", SCARP_VERSION},
                         {"openvdb", SCARP_OPENVDB_VERSION},
                         {"embree", SCARP_EMBREE_VERSION},
                         {"compiler", __VERSION__}};
  write_file(file("summary.json"), summary.dump(2) + "\n");
}

}  // namespace scarp

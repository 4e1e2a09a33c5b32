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

// What a killed process was writing when it died: NAME.tmp-PID-N.
bool is_temporary(const std::string& name) {
  const std::size_t ending = name.rfind(".tmp-");
  return ending != std::string::npos && is_result(name.substr(0, ending));
}

bool is_checkpoint(const std::string& name) {
  return is_result(name) && fs::path(name).extension() == ".vdb";
}

// Whole lines only: one without an end was being written when the process died.
std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::size_t start = 0;
  for (std::size_t end = 0; (end = text.find('\n', start)) != std::string::npos; start = end + 1) {
    lines.push_back(text.substr(start, end - start));
  }
  return lines;
}

// A name in CSV: in quotes where it holds a comma or a quote. A row stays one line.
std::string csv_field(std::string text) {
  for (char& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  if (text.find_first_of(",\"") == std::string::npos) return text;
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

void remove_files(const fs::path& folder, bool (*chosen)(const std::string& name)) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (chosen(entry.path().filename().string())) found.push_back(entry.path());
  }
  for (const fs::path& each : found) fs::remove(each);
}

std::string joined(std::span<const double> numbers) {
  std::string text;
  for (const double number : numbers) text += (text.empty() ? "" : " ") + format_number(number);
  return text;
}

CheckpointNotes notes_of(const State& state, const Recipe& recipe,
                         std::span<const double> output_times) {
  return {{"time_s", format_number(state.time)},
          {"step", std::to_string(state.step)},
          {"step_start_s", format_number(state.step_start)},
          {"time_step", std::to_string(state.time_step)},
          {"seed", std::to_string(recipe.flux.seed)},
          {"output_times_s", joined(output_times)},
          {"recipe_hash", recipe_hash(recipe)}};
}

std::vector<double> numbers_of(const CheckpointNotes& notes, const std::string& key,
                               const fs::path& file) {
  const auto entry = notes.find(key);
  if (entry == notes.end()) {
    throw InputError(fmt::format("{}: the entry {} is missing; this is not a checkpoint of a run",
                                 file.string(), key));
  }
  std::vector<double> numbers;
  std::istringstream text(entry->second);
  for (std::string word; text >> word;) numbers.push_back(std::strtod(word.c_str(), nullptr));
  return numbers;
}

double number_of(const CheckpointNotes& notes, const std::string& key, const fs::path& file) {
  const std::vector<double> numbers = numbers_of(notes, key, file);
  if (numbers.size() == 1) return numbers.front();
  throw InputError(fmt::format(
      "{}: the entry {} is not a number; this is not a checkpoint of a run", file.string(), key));
}

// Adds a line; what a full disk leaves of it is taken back.
void append_whole(const fs::path& file, const std::string& line) {
  std::error_code ignored;
  const std::uintmax_t size = fs::file_size(file, ignored);
  std::ofstream out(file, std::ios::app | std::ios::binary);
  out << line << std::flush;
  if (out) return;
  const std::string cause = std::strerror(errno);
  out.close();
  if (!ignored) fs::resize_file(file, size, ignored);
  throw NumericalError(
      fmt::format("{}: a line could not be written: {}; make room and go on with --resume",
                  file.string(), cause));
}

// Where a run can go on: the state, the file it is from, the times of the outputs up to there.
struct Restart {
  State state;
  fs::path file;
  std::vector<double> output_times;
};

Restart read_restart(const fs::path& file, const Recipe& recipe) {
  Checkpoint checkpoint = read_checkpoint(file);
  const auto value = [&](const char* key) { return number_of(checkpoint.notes, key, file); };
  if (const auto hash = checkpoint.notes.find("recipe_hash");
      hash == checkpoint.notes.end() || hash->second != recipe_hash(recipe)) {
    throw InputError(fmt::format("{}: belongs to another recipe", file.string()));
  }
  return {.state = {.layers = std::move(checkpoint.layers),
                    .time = value("time_s"),
                    .step = static_cast<std::size_t>(value("step")),
                    .step_start = value("step_start_s"),
                    .time_step = static_cast<std::uint32_t>(value("time_step"))},
          .file = file,
          .output_times = numbers_of(checkpoint.notes, "output_times_s", file)};
}

// One that cannot be read, or whose time steps have no rows in metrics.csv, is passed over: an
// earlier one leads to the same bits.
std::optional<Restart> newest_restart(std::span<const fs::path> checkpoints, std::size_t row_count,
                                      const Recipe& recipe, const Log& log) {
  // Outputs are numbered in the order of time; only the checkpoint of an interrupted run is not.
  std::vector<fs::path> newest_first(checkpoints.begin(), checkpoints.end());
  std::sort(newest_first.begin(), newest_first.end(), [](const fs::path& a, const fs::path& b) {
    const std::string left = a.filename().string();
    const std::string right = b.filename().string();
    return std::pair(left.size(), left) > std::pair(right.size(), right);
  });
  std::optional<Restart> newest;
  for (const fs::path& file : newest_first) {
    try {
      Restart restart = read_restart(file, recipe);
      if (restart.state.time_step >= row_count) {
        throw InputError(
            fmt::format("{}: metrics.csv has no rows for its time steps", file.string()));
      }
      if (!newest || restart.state.time_step > newest->state.time_step) {
        newest = std::move(restart);
      }
      if (file.filename() != interrupted_state) break;
    } catch (const InputError& error) {
      log.warn(fmt::format("{}; going on from an earlier checkpoint", error.what()));
    }
  }
  return newest;
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
  // The mark of a complete run goes first, whatever happens on the way.
  fs::remove(file("summary.json"));
  remove_files(path_, is_result);
  remove_files(path_, is_temporary);
  output_times_.clear();
  write_file(file("recipe.toml"), recipe.resolved);
  write_file(file("metrics.csv"), metrics_head);
}

std::optional<State> ResultFolder::resume(const Recipe& recipe, const Log& log) {
  std::vector<fs::path> checkpoints;
  for (const auto& entry : fs::directory_iterator(path_)) {
    if (is_checkpoint(entry.path().filename().string())) checkpoints.push_back(entry.path());
  }
  if (checkpoints.empty()) return std::nullopt;
  if (read_text(file("recipe.toml")) != recipe.resolved) {
    throw InputError(
        fmt::format("{}: holds a run of another recipe (or of other settings); run "
                    "without --resume to start anew, or choose another folder with -o",
                    file("recipe.toml").string()));
  }
  const std::vector<std::string> rows = lines_of(read_text(file("metrics.csv")));
  std::optional<Restart> restart = newest_restart(checkpoints, rows.size(), recipe, log);
  if (!restart) {
    throw InputError(fmt::format(
        "{}: no checkpoint here can be gone on from; run without --resume to start anew",
        path_.string()));
  }
  output_times_ = std::move(restart->output_times);
  last_checkpoint_ = std::move(restart->file);
  remove_files(path_, is_temporary);

  // The rows of time steps that will be done again go.
  std::string kept;
  for (std::size_t n = 0; n <= restart->state.time_step; ++n) kept += rows[n] + '\n';
  write_file(file("metrics.csv"), kept);
  return std::move(restart->state);
}

void ResultFolder::write_output(const State& state, const Survey& survey, const Recipe& recipe) {
  const int number = output_count();
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
  output_times_.push_back(state.time);
  std::vector<SeriesEntry> series;
  for (int n = 0; n <= number; ++n) {
    series.push_back({output_times_[static_cast<std::size_t>(n)], numbered("surface", n, ".vtp")});
  }
  write_series(file("surface.pvd"), series);
  // The checkpoint comes last: where it stands, the output is whole.
  write_state(numbered("state", number, ".vdb"), state, recipe);
  fs::remove(file(interrupted_state));
}

void ResultFolder::write_state(const std::string& name, const State& state, const Recipe& recipe) {
  scarp::write_checkpoint(file(name), state.layers, notes_of(state, recipe, output_times_));
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

  append_whole(file("metrics.csv"), row);
}

void ResultFolder::write_summary(const State& state, const Survey& survey, const Recipe& recipe,
                                 const StageTimer& total, double wall_seconds) {
  nlohmann::ordered_json summary;
  summary["title"] = recipe.title;
  summary["complete"] = true;
  summary["process_time_s"] = state.time;
  summary["time_steps"] = state.time_step;
  summary["outputs"] = output_count();
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

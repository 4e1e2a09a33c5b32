#include "apps/run/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "apps/run/metrics_rows.h"
#include "apps/run/metrology_files.h"
#include "apps/run/own_files.h"
#include "apps/run/recipe_difference.h"
#include "apps/run/result_files.h"
#include "apps/run/run_record.h"
#include "apps/simulator/recipe_warnings.h"
#include "apps/simulator/state_file.h"
#include "apps/simulator/symmetry.h"
#include "core/error.h"
#include "core/plain_number.h"
#include "core/printable.h"
#include "core/system/atomic_file.h"
#include "core/system/read_file.h"
#include "core/system/temporary_folder.h"
#include "levelset/grid/symmetry.h"
#include "mesh/files/mesh_file.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

constexpr const char* metrology_file = "metrology.csv";

// Empty where there is no such file.
std::string read_text(const fs::path& file) { return fs::exists(file) ? read_file(file) : ""; }

// section_K.svg, section_K_NNNN.csv and .svg.
bool is_section(const std::string& name) {
  constexpr std::string_view start = "section_";
  const fs::path file(name);
  if (file.extension() != ".svg" && file.extension() != ".csv") return false;
  const std::string stem = file.stem().string();
  return stem.starts_with(start) && stem.size() > start.size() &&
         stem.find_first_not_of("0123456789_", start.size()) == std::string::npos;
}

// What a run writes, beside metrics.csv.
bool is_output(const std::string& name) {
  return name == "recipe.toml" || name == "summary.json" || name == "surface.pvd" ||
         name == metrology_file || name == interrupted_state || name == earlier_interrupted_state ||
         output_number(name, "surface", ".vtp") || output_number(name, "state", ".vdb") ||
         output_number(name, "profile", ".csv") || output_number(name, "profile", ".svg") ||
         name == "profiles.svg" || name == report_file || is_section(name);
}

// What a killed process was writing when it died: NAME.tmp-PID-N.
bool is_temporary(const std::string& name) {
  const std::size_t ending = name.rfind(".tmp-");
  if (ending == std::string::npos) return false;
  const std::string target = name.substr(0, ending);
  return is_result(target);
}

bool is_checkpoint(const std::string& name) {
  return is_result(name) && fs::path(name).extension() == ".vdb";
}

// All of so many outputs, in the order in which they are listed.
std::vector<std::string> output_files(std::size_t section_count, int output_count) {
  std::vector<std::string> files{"surface.pvd", metrology_file};
  for (int n = 0; n < output_count; ++n) {
    files.push_back(numbered("surface", n, ".vtp"));
    files.push_back(numbered("state", n, ".vdb"));
  }
  const std::vector<std::string> sections = section_files(section_count, output_count);
  files.insert(files.end(), sections.begin(), sections.end());
  return files;
}

// "a, b, c and 7 more"
std::string first_of(std::span<const std::string> names) {
  constexpr std::size_t most = 6;
  const std::string told =
      fmt::format("{}", fmt::join(names.first(std::min(names.size(), most)), ", "));
  return names.size() <= most ? told : fmt::format("{} and {} more", told, names.size() - most);
}

std::vector<std::string> missing_of(const fs::path& folder, const std::vector<std::string>& names) {
  std::vector<std::string> missing;
  for (const std::string& name : names)
    if (!fs::exists(folder / name)) missing.push_back(name);
  return missing;
}

std::string hash_of_file(const fs::path& file) { return hash_of(read_file(file)); }

std::uint32_t first_time_step(const StartGeometry& start) {
  return start.state ? start.state->state->time_step : 0;
}

// The rows of metrology.csv by output; none where it is not of this recipe.
std::map<int, std::vector<std::string>> rows_by_output(const std::string& text,
                                                       const std::string& head) {
  std::map<int, std::vector<std::string>> rows;
  const std::vector<std::string> lines = whole_lines(text);
  if (lines.empty() || lines.front() + '\n' != head) return rows;
  for (std::size_t n = 1; n < lines.size(); ++n)
    rows[std::atoi(lines[n].c_str())].push_back(lines[n]);
  return rows;
}

bool are_different(std::span<const std::string> rows) {
  return std::set<std::string>(rows.begin(), rows.end()).size() == rows.size();
}

void remove_files(const fs::path& folder, bool (*chosen)(const std::string& name)) {
  for (const fs::path& each : find_files(folder, chosen)) fs::remove(each);
}

}  // namespace

bool is_result(const std::string& name) { return name == "metrics.csv" || is_output(name); }

namespace {

bool holds_complete_run(const fs::path& folder, const std::string& resolved,
                        const StartGeometry& start) {
  if (read_text(folder / "recipe.toml") != resolved) return false;
  const auto summary = read_summary(folder);
  const auto is = [&](const char* key, const nlohmann::ordered_json& wanted) {
    const auto found = summary.find(key);
    return found != summary.end() && *found == wanted;
  };
  return is("complete", true) && fs::exists(folder / "metrics.csv") &&
         is("start_state_hash", start.state ? start.state->hash : "");
}

}  // namespace

std::optional<std::vector<std::string>> losses_of_complete_run(const fs::path& folder,
                                                               const Recipe& recipe) {
  if (!holds_complete_run(folder, recipe.resolved, recipe.start)) return std::nullopt;
  const auto summary = read_summary(folder);
  const auto entry = [&](const char* key) { return summary.value(key, nlohmann::ordered_json()); };
  const auto output_count = static_cast<int>(entry("output_times_s").size());
  std::vector<std::string> losses;
  const std::vector<std::string> missing =
      missing_of(folder, output_files(recipe.outputs.sections.size(), output_count));
  if (!missing.empty()) {
    losses.push_back(
        fmt::format("{}: the run is complete, but without {}; run without --resume to "
                    "make all files again",
                    shown(folder), first_of(missing)));
  }
  Hash rows;
  const std::string metrics = read_text(folder / "metrics.csv");
  rows.add(std::string_view(metrics).substr(std::min(metrics.size(), metrics.find('\n') + 1)));
  if (entry("rows_hash").is_string() && entry("rows_hash") != rows.hex()) {
    losses.push_back(
        fmt::format("{}: was changed since the run wrote it; run without --resume to "
                    "make it again",
                    shown(folder / "metrics.csv")));
  }
  return losses;
}

ResultFolder::ResultFolder(fs::path folder, const Recipe& recipe)
    : path_(std::move(folder)),
      lock_(path_),
      recipe_(recipe),
      columns_{.materials = recipe.materials,
               .cd_heights = recipe.metrology.cd_heights,
               .angle_heights = recipe.metrology.angle_heights,
               .films = film_materials(recipe.steps, recipe.occurring),
               .occurring = recipe.occurring} {}

bool ResultFolder::holds_run() const {
  return begins_with(file("metrics.csv"), "step,step_name,time_s,");
}

void ResultFolder::require_not_start() const {
  std::error_code error;
  if (!recipe_.start.state ||
      !fs::equivalent(recipe_.start.state->file.parent_path(), path_, error))
    return;
  throw InputError(
      fmt::format("{}: the run would replace the state that it starts from; choose another folder "
                  "with -o",
                  shown(recipe_.start.state->file)));
}

void ResultFolder::start(const Log& log) {
  log_ = log;
  require_own(path_, "a run", holds_run(), is_result);
  require_not_start();
  if (holds_run()) {
    log.info(fmt::format("{}: replaces the run that was here", shown(path_)));
  }
  // The mark of a complete run is removed first, whatever happens then; metrics.csv, the mark of a
  // run, is there all the time.
  fs::remove(file("summary.json"));
  remove_files(path_, is_output);
  if (holds_run()) remove_files(path_, is_temporary);
  written_ = {};
  rows_hash_ = Hash();
  metrology_rows_ = metrology_head(columns_);
  metrics_ = metrics_head(recipe_.steps, recipe_.simplification);
  write_file(file("metrics.csv"), metrics_);
  write_file(file("recipe.toml"), recipe_.resolved);
}

// One that is lost or damaged tells nothing; checkpoints know the hash of theirs.
void ResultFolder::require_same() const {
  const std::string there = read_text(file("recipe.toml"));
  if (there.empty() || there == recipe_.resolved) return;
  std::string difference;
  try {
    difference = first_difference(recipe_.resolved, there);
  } catch (const InputError& error) {
    log_.warn(fmt::format("{}: is damaged, and is written again ({})", shown(file("recipe.toml")),
                          error.what()));
    return;
  }
  const std::vector<fs::path> states = states_of(path_);
  throw InputError(fmt::format(
      "{}: holds a run of another recipe (or of other settings): {}; run without --resume to start "
      "again, choose another folder with -o{}",
      shown(file("recipe.toml")), difference,
      states.empty() ? ""
                     : fmt::format(", or begin a recipe with start = \"{}\"",
                                   shown(fs::absolute(states.back()).lexically_normal()))));
}

std::optional<State> ResultFolder::resume(const Log& log) {
  log_ = log;
  require_files(path_, is_result);
  const std::vector<fs::path> checkpoints = find_files(path_, is_checkpoint);
  require_same();
  if (checkpoints.empty()) {
    log.warn(fmt::format("{}: there is no checkpoint here; the run starts from the beginning",
                         shown(path_)));
    return std::nullopt;
  }
  std::optional<MetricsRows> rows;
  if (fs::exists(file("metrics.csv"))) {
    rows =
        read_metrics_rows(file("metrics.csv"), metrics_head(recipe_.steps, recipe_.simplification),
                          first_time_step(recipe_.start));
  }
  std::optional<Restart> restart = newest_restart(checkpoints, rows, recipe_.hash(), log);
  if (!restart) {
    throw InputError(fmt::format(
        "{}: none of the checkpoints here can be used; run without --resume to start again",
        shown(path_)));
  }
  written_ = std::move(restart->written);
  last_checkpoint_ = std::move(restart->file);
  log.info(
      fmt::format("continues from {}, t = {:.4g} s", shown(last_checkpoint_), restart->state.time));
  tell_lost_files();
  restore_metrology();
  remove_files(path_, is_temporary);

  restore_rows(rows ? rows->before(restart->state.time_step) : std::span<const std::string>(),
               restart->state);
  write_file(file("recipe.toml"), recipe_.resolved);
  return std::move(restart->state);
}

// Those that the next output does not write anew.
void ResultFolder::tell_lost_files() const {
  const std::vector<std::string> anew = output_files(recipe_.outputs.sections.size(), 0);
  std::vector<std::string> missing =
      missing_of(path_, output_files(recipe_.outputs.sections.size(), output_count()));
  std::erase_if(missing, [&](const std::string& name) {
    return std::ranges::find(anew, name) != anew.end();
  });
  const auto tell = [&](const char* what, const std::vector<std::string>& names) {
    if (names.empty()) return;
    log_.warn(fmt::format(
        "{}: the run continues, but {} {}; run without --resume to make all files again",
        shown(path_), what, first_of(names)));
  };
  tell("without", missing);
  std::vector<std::string> changed;
  for (const auto& [name, hash] : written_.hashes)
    if (name != metrology_file && fs::exists(file(name)) && hash_of_file(file(name)) != hash)
      changed.push_back(name);
  tell("with other content than it wrote in", changed);
}

void ResultFolder::add_hashes() {
  const std::vector<std::string> anew = output_files(recipe_.outputs.sections.size(), 0);
  for (const std::string& name : output_files(recipe_.outputs.sections.size(), output_count())) {
    // States have a checksum of their own.
    if (written_.hashes.contains(name) || is_checkpoint(name) ||
        std::ranges::find(anew, name) != anew.end() || !fs::exists(file(name)))
      continue;
    written_.hashes[name] = hash_of_file(file(name));
  }
  written_.hashes[metrology_file] = hash_of(metrology_rows_);
}

// The rows of time steps that will be done again go.
void ResultFolder::restore_rows(std::span<const std::string> kept, const State& state) {
  if (kept.empty() && state.time_step > first_time_step(recipe_.start)) {
    log_.warn(fmt::format("{}: its rows are lost; it starts again with time step {}",
                          shown(file("metrics.csv")), state.time_step));
  }
  std::string rows;
  for (const std::string& line : kept) rows += line + '\n';
  rows_hash_ = Hash();
  rows_hash_.add(rows);
  metrics_ = metrics_head(recipe_.steps, recipe_.simplification) + rows;
  write_file(file("metrics.csv"), metrics_);
}

// Rows that are lost, double or changed are measured again, if the state of their output is there.
void ResultFolder::restore_metrology() {
  metrology_rows_ = metrology_head(columns_);
  auto known = rows_by_output(read_text(file(metrology_file)), metrology_rows_);
  std::string rows = metrology_rows_;
  for (int n = 0; n < output_count(); ++n)
    for (const std::string& row : known[n]) rows += row + '\n';
  const auto hash = written_.hashes.find(metrology_file);
  if (hash != written_.hashes.end() && hash->second != hash_of(rows)) known.clear();
  for (int n = 0; n < output_count(); ++n) {
    const auto rows = known.find(n);
    if (rows != known.end() && are_different(rows->second)) {
      for (const std::string& row : rows->second) metrology_rows_ += row + '\n';
      continue;
    }
    try {
      const SavedWafer wafer = read_wafer(file(numbered("state", n, ".vdb")), recipe_.materials);
      metrology_rows_ += metrology_rows(
          static_cast<std::size_t>(n), wafer.time,
          measure(wafer.layers, wafer.openings, wafer.metrology.feet_are_rounded), columns_);
    } catch (const InputError& error) {
      log_.warn(fmt::format("{}: the rows of output {} are lost: {}", shown(file(metrology_file)),
                            n, error.what()));
    }
  }
}

// A write that fails because the folder went in the meantime is reported as that.
template <class Write>
void ResultFolder::while_held(const Write& write) const {
  lock_.require_held();
  try {
    write();
  } catch (const std::exception&) {
    lock_.require_held();
    throw;
  }
}

// Nobody loses what is in the way of a file.
void ResultFolder::set_aside(const fs::path& strange, const char* how) const {
  fs::path aside;
  for (int n = 1; n == 1 || fs::exists(fs::symlink_status(aside)); ++n)
    aside = fmt::format("{}.aside-{}", strange.string(), n);
  fs::rename(strange, aside);
  log_.warn(fmt::format("{}: {} while the run writes it; what is there now is set aside as {}",
                        shown(strange), how, shown(aside.filename())));
}

void ResultFolder::set_strange_files_aside() const {
  for (const fs::path& each : find_files(path_, is_result)) {
    const fs::file_status status = fs::status(each);
    if (fs::is_directory(status)) set_aside(each, "became a folder");
    if (fs::is_fifo(status) || fs::is_socket(status)) set_aside(each, "became a pipe");
  }
  keep_metrics();
  const fs::path kept_recipe = file("recipe.toml");
  if (fs::is_regular_file(kept_recipe)) {
    if (read_file(kept_recipe) == recipe_.resolved) return;
    set_aside(kept_recipe, "was changed");
  } else {
    log_.warn(fmt::format("{}: was removed; it is written again", shown(kept_recipe)));
  }
  write_file(kept_recipe, recipe_.resolved);
}

void ResultFolder::keep_metrics() const {
  const fs::path metrics = file("metrics.csv");
  std::error_code error;
  if (fs::file_size(metrics, error) == metrics_.size() && !error) return;
  const bool is_there = fs::exists(metrics);
  if (is_there && !fs::is_character_file(metrics)) set_aside(metrics, "was changed");
  if (!is_there)
    log_.warn(fmt::format(
        "{}: was removed while the run writes it; it is written again with all its rows",
        shown(metrics)));
  write_file(metrics, metrics_);
}

void ResultFolder::write_output(const State& state, const Survey& survey) {
  while_held([&] {
    set_strange_files_aside();
    const int number = output_count();
    write_surface(file(numbered("surface", number, ".vtp")), state, survey,
                  current_step(state, recipe_.steps), recipe_.materials);
    const WholeLayers whole(state.layers);
    sections().write(
        path_, number, state.time, whole.get(), recipe_.title,
        moment_of(state, recipe_.steps) + ", t = " + plain_number(state.time, 4) + " s");
    const auto before =
        std::exchange(newest_, measure(whole.get(), written_.openings, state.feet_are_rounded));
    written_.openings = newest_->names;
    if (before) tell_unresolved(*before, state.time);
    metrology_rows_ += metrology_rows(written_.output_times.size(), state.time, *newest_, columns_);
    write_file(file(metrology_file), metrology_rows_);
    written_.output_times.push_back(state.time);
    add_hashes();
    std::vector<std::string> series;
    for (int n = 0; n <= number; ++n) series.push_back(numbered("surface", n, ".vtp"));
    write_series(file("surface.pvd"), series);
    // The checkpoint comes last: where it stands, the output is whole.
    write_state(numbered("state", number, ".vdb"), state);
    fs::remove(file(interrupted_state));
    fs::remove(file(earlier_interrupted_state));
  });
}

// What is etched where an opening ends in a few spacings depends on the grid and on noise. Films
// close openings as they should.
void ResultFolder::tell_unresolved(const Metrology& before, double time) {
  const double spacing = recipe_.domain.frame.spacing;
  for (const OpeningMetrology& each : newest_->openings) {
    const auto then = std::ranges::find_if(before.openings, [&](const OpeningMetrology& earlier) {
      return earlier.opening == each.opening && earlier.axis == each.axis;
    });
    if (then == before.openings.end() || !then->lowest_height || !each.lowest_height ||
        !each.bottom_cd)
      continue;
    const bool deepens = *each.lowest_height < *then->lowest_height - spacing;
    if (!deepens || *each.bottom_cd >= least_feature_width * spacing ||
        !unresolved_.insert(each.opening).second)
      continue;
    log_.warn(
        fmt::format("t = {:.4g} s: {} {} is still being etched where it is only {:.3g} nm wide, "
                    "{:.1f} grid spacings: its depth depends on the grid and on noise; use a "
                    "domain.spacing of {:.3g} nm or less",
                    time, each.is_trench ? "trench" : "hole", each.opening + 1, *each.bottom_cd,
                    *each.bottom_cd / spacing, *each.bottom_cd / least_feature_width));
  }
}

// What the grid leaves open at the feet of walls, where that is more than a spacing and much of the
// depth, or of a micro-trench that the grid holds.
void ResultFolder::tell_rounded_feet() const {
  constexpr double of_depth = 0.05;
  constexpr double of_micro_trench = 0.5;
  const double spacing = recipe_.domain.frame.spacing;
  std::set<int> told;
  for (const OpeningMetrology& each : newest_->openings) {
    if (!each.depth_error || *each.depth_error <= spacing) continue;
    const double micro_trench = each.micro_trenching.value_or(0);
    const bool has_micro_trench = micro_trench >= spacing;
    const double allowed = has_micro_trench
                               ? std::min(of_depth * *each.depth, of_micro_trench * micro_trench)
                               : of_depth * *each.depth;
    if (*each.depth_error <= allowed || !told.insert(each.opening).second) continue;
    const std::string also =
        has_micro_trench ? fmt::format(" and its micro-trench of {:.3g} nm", micro_trench) : "";
    log_.warn(fmt::format(
        "{} {}: its depth of {:.4g} nm{} may be wrong by {:.2g} nm, as the grid rounds the foot of "
        "a wall; use a domain.spacing of {:.2g} nm or less",
        each.is_trench ? "trench" : "hole", each.opening + 1, *each.depth, also, *each.depth_error,
        spacing * allowed / *each.depth_error));
  }
}

Sections& ResultFolder::sections() {
  if (sections_) return *sections_;
  // After a run is resumed, its earlier outputs are read again.
  sections_.emplace(recipe_.domain.frame, recipe_.outputs.sections, recipe_.materials);
  for (int n = 0; n < output_count(); ++n) {
    const fs::path state = file(numbered("state", n, ".vdb"));
    // One that was removed has no line in the pictures.
    if (!fs::exists(state)) continue;
    try {
      const SavedWafer wafer = read_wafer(state, recipe_.materials);
      sections_->add(wafer.time, wafer.layers);
    } catch (const InputError& error) {
      log_.warn(fmt::format("{}; pictures are drawn without it", error.what()));
    }
  }
  return *sections_;
}

Metrology ResultFolder::measure(const Layers& layers, const OpeningNames& known,
                                bool feet_are_rounded) {
  if (!start_) {
    start_ = output_count() == 0
                 ? scarp::measure(layers, recipe_.metrology)
                 : scarp::measure(whole_of(start_state(recipe_.domain.frame, recipe_.start)).layers,
                                  recipe_.metrology);
  }
  MetrologyOptions options = recipe_.metrology;
  options.feet_are_rounded = feet_are_rounded;
  return scarp::measure(layers, options, &*start_, known);
}

void ResultFolder::write_state(const std::string& name, const State& state) {
  written_.rows_hash = rows_hash_.hex();
  write_restart(file(name), state, written_, recipe_);
  last_checkpoint_ = file(name);
}

void ResultFolder::write_checkpoint(const State& state) {
  while_held([&] {
    set_strange_files_aside();
    // One that was refused must not take the place of a good one.
    std::error_code error;
    if (last_checkpoint_ == file(interrupted_state))
      fs::rename(file(interrupted_state), file(earlier_interrupted_state), error);
    if (error && error != std::errc::no_such_file_or_directory)
      throw fs::filesystem_error("rename", file(interrupted_state), error);
    write_state(interrupted_state, state);
  });
}

void ResultFolder::append_metrics(const State& after, std::size_t step, const Survey& survey,
                                  const Move& move) {
  while_held([&] {
    keep_metrics();
    const std::string row =
        metrics_row(after, step, survey, move, recipe_.steps, recipe_.simplification);
    append_to_file(file("metrics.csv"), row);
    metrics_ += row;
    rows_hash_.add(row);
  });
}

RunTotals ResultFolder::write_summary(const State& state, const Survey& survey,
                                      const StageTimer& total, double wall_seconds) {
  while_held([&] { set_strange_files_aside(); });
  RunTotals totals{.output_times = written_.output_times,
                   .rows_hash = rows_hash_.hex(),
                   .flux = flux_target(file("metrics.csv"), recipe_.flux),
                   .left_out = left_out_count(file("metrics.csv")),
                   .stages = total,
                   .wall_seconds = wall_seconds};
  while_held([&] {
    // The end of a recipe is an output; it may have been written before the run was resumed.
    if (!newest_)
      newest_ = measure(WholeLayers(state.layers).get(), written_.openings, state.feet_are_rounded);
    tell_rounded_feet();
    write_file(file("summary.json"), summary_text(state, survey, *newest_, recipe_, totals));
  });
  return totals;
}

void write_trial_output(const State& state, const Survey& survey, const Recipe& recipe) {
  const TemporaryFolder folder;
  ResultFolder(folder, recipe).write_output(state, survey);
}

}  // namespace scarp

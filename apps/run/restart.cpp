#include "apps/run/restart.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <sstream>

#include "apps/simulator/state_file.h"
#include "apps/simulator/symmetry.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"
#include "core/system/hash.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

// A line for each file: names that a run gives have no spaces.
std::string text_of(const std::map<std::string, std::string>& hashes) {
  std::string text;
  for (const auto& [name, hash] : hashes) text += fmt::format("{} {}\n", name, hash);
  return text;
}

std::map<std::string, std::string> hashes_of(const std::string& text) {
  std::map<std::string, std::string> hashes;
  std::istringstream words(text);
  for (std::string name, hash; words >> name >> hash;) hashes[name] = hash;
  return hashes;
}

// By their numbers: longer names are later.
bool is_older(const fs::path& a, const fs::path& b) {
  const std::string left = a.filename().string();
  const std::string right = b.filename().string();
  return std::pair(left.size(), left) < std::pair(right.size(), right);
}

Restart read_restart(const fs::path& file, const std::string& recipe_hash) {
  Checkpoint checkpoint = read_checkpoint(file);
  const CheckpointNotes& notes = checkpoint.notes;
  if (note_in(notes, "recipe_hash", file) != recipe_hash)
    throw InputError(fmt::format("{}: belongs to another recipe", shown(file)));
  WrittenSoFar written{.output_times = numbers_in(notes, "output_times_s", file),
                       .rows_hash = note_in(notes, "rows_hash", file),
                       .hashes = hashes_of(note_in(notes, "file_hashes", file)),
                       .openings = openings_in(notes, file)};
  return {
      .state = state_of(std::move(checkpoint), file), .file = file, .written = std::move(written)};
}

// A copy of an earlier one under a later name would be taken for the newest.
void require_number(const Restart& restart, std::optional<int> number) {
  const std::size_t written = restart.written.output_times.size();
  if (!number || static_cast<std::size_t>(*number) + 1 == written) return;
  throw InputError(fmt::format("{}: holds output {}, so it was renamed", shown(restart.file),
                               static_cast<int>(written) - 1));
}

// Rows that were lost with their file are not missed: it has begun anew.
void require_rows(const Restart& restart, const MetricsRows& rows) {
  if (rows.lines.empty()) return;
  const std::uint32_t time_step = restart.state.time_step;
  if (time_step > rows.end()) {
    throw InputError(fmt::format(
        "{}: line {} of metrics.csv is not the row of time step {}, before this checkpoint",
        shown(restart.file), rows.lines.size() + 2, rows.end()));
  }
  const std::span<const std::string> kept = rows.before(time_step);
  if (kept.empty() || restart.written.rows_hash.empty()) return;
  Hash hash;
  for (const std::string& row : kept) hash.add(row + '\n');
  if (hash.hex() == restart.written.rows_hash) return;
  throw InputError(
      fmt::format("{0}: lines 2 to {1} have changed since {2} was written, and will be written "
                  "again (to continue from {2} without them, move the file away)",
                  shown(restart.file.parent_path() / "metrics.csv"), kept.size() + 1,
                  shown(restart.file.filename())));
}

}  // namespace

std::string numbered(const std::string& stem, int number, const std::string& ending) {
  return fmt::format("{}_{:04}{}", stem, number, ending);
}

std::optional<int> output_number(const std::string& name, const std::string& stem,
                                 const std::string& ending) {
  if (!name.starts_with(stem + '_') || !name.ends_with(ending)) return std::nullopt;
  int number = 0;
  std::from_chars(name.data() + stem.size() + 1, name.data() + name.size(), number);
  if (name != numbered(stem, number, ending)) return std::nullopt;
  return number;
}

void write_restart(const fs::path& file, const State& state, const WrittenSoFar& written,
                   const Recipe& recipe) {
  write_state(file, state, recipe, written.openings,
              {{"output_times_s", joined(written.output_times)},
               {"rows_hash", written.rows_hash},
               {"file_hashes", text_of(written.hashes)}});
}

std::optional<Restart> newest_restart(std::span<const fs::path> checkpoints,
                                      const std::optional<MetricsRows>& rows,
                                      const std::string& recipe_hash, const Log& log) {
  // Outputs are numbered in the order of time; only checkpoints between them are not.
  std::vector<fs::path> newest_first(checkpoints.begin(), checkpoints.end());
  std::sort(newest_first.begin(), newest_first.end(),
            [](const fs::path& a, const fs::path& b) { return is_older(b, a); });
  std::optional<Restart> newest;
  for (const fs::path& file : newest_first) {
    try {
      Restart restart = read_restart(file, recipe_hash);
      const auto number = output_number(file.filename().string(), "state", ".vdb");
      require_number(restart, number);
      if (rows) require_rows(restart, *rows);
      if (!newest || restart.state.time_step > newest->state.time_step) {
        newest = std::move(restart);
      }
      if (number) break;
    } catch (const InputError& error) {
      log.warn(fmt::format("{}; continuing from an earlier checkpoint", error.what()));
    }
  }
  return newest;
}

Recipe read_runnable(const fs::path& file, const std::vector<std::string>& overrides) {
  return read_recipe(recipe_in(file, overrides), load_start);
}

SavedWafer read_wafer(const fs::path& file, Materials known) {
  Checkpoint checkpoint = read_checkpoint(file);
  SavedWafer wafer{.layers = whole_of({.layers = std::move(checkpoint.layers)}).layers,
                   .materials = std::move(known),
                   .time = number_in(checkpoint.notes, "time_s", file),
                   .openings = openings_in(checkpoint.notes, file)};
  const std::string names = note_in(checkpoint.notes, "materials", file);
  const auto each_line = [](const std::string& text, const auto& visit) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) visit(line);
  };
  each_line(names, [&](const std::string& name) {
    if (!wafer.materials.contains(name)) wafer.materials.add({.name = name});
  });
  name_materials(wafer.layers, names, wafer.materials, file);
  each_line(note_in(checkpoint.notes, "masks", file), [&](const std::string& name) {
    // A mask that is gone has no layer any more.
    if (!wafer.materials.contains(name)) wafer.materials.add({.name = name});
    wafer.metrology.masks.push_back(wafer.materials.id(name));
  });
  wafer.metrology.cd_heights = numbers_in(checkpoint.notes, "cd_heights_nm", file);
  wafer.metrology.angle_heights = numbers_in(checkpoint.notes, "angle_heights_nm", file);
  wafer.metrology.feet_are_rounded = note_in(checkpoint.notes, "feet_are_rounded", file) == "1";
  return wafer;
}

std::vector<fs::path> states_of(const fs::path& folder) {
  std::vector<fs::path> states;
  for (const auto& entry : fs::directory_iterator(folder))
    if (output_number(entry.path().filename().string(), "state", ".vdb")) states.push_back(entry);
  std::sort(states.begin(), states.end(), is_older);
  // One between outputs is later than they are, or it would be gone.
  if (fs::exists(folder / interrupted_state)) states.push_back(folder / interrupted_state);
  return states;
}

fs::path newest_state(const fs::path& where) {
  if (!fs::is_directory(where)) return where;
  const std::vector<fs::path> states = states_of(where);
  if (!states.empty()) return states.back();
  throw InputError(fmt::format("{}: holds no state_NNNN.vdb; give the folder of a run, or a state",
                               shown(where)));
}

}  // namespace scarp

#include "apps/run/restart.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>

#include "apps/simulator/symmetry.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"
#include "core/system/hash.h"
#include "levelset/grid/checkpoint.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

std::string recipe_hash(const Recipe& recipe) {
  Hash hash;
  hash.add(recipe.resolved);
  if (recipe.start) hash.add(recipe.start->hash);
  return hash.hex();
}

std::string joined(std::span<const double> numbers) {
  std::string text;
  for (const double number : numbers) {
    if (!text.empty()) text += ' ';
    text += format_number(number);
  }
  return text;
}

// For each void its first node, volume, heights, and when it was closed.
constexpr std::size_t numbers_per_void = 7;

std::vector<double> numbers_of(std::span<const VoidClosure> voids) {
  std::vector<double> numbers;
  for (const VoidClosure& each : voids) {
    const Region& region = each.region;
    numbers.insert(numbers.end(), region.first_node.begin(), region.first_node.end());
    numbers.insert(numbers.end(), {region.volume, region.lower, region.upper, each.time});
  }
  return numbers;
}

// Without images in files of earlier versions.
std::vector<VoidClosure> voids_of(std::span<const double> numbers, std::span<const double> images,
                                  const fs::path& file) {
  const std::size_t count = numbers.size() / numbers_per_void;
  if (numbers.size() % numbers_per_void != 0 || (!images.empty() && images.size() != count)) {
    throw InputError(
        fmt::format("{}: the entry voids is not whole; it is not of this version", shown(file)));
  }
  std::vector<VoidClosure> voids;
  for (; !numbers.empty(); numbers = numbers.subspan(numbers_per_void)) {
    const auto node = [&](std::size_t axis) { return static_cast<int>(numbers[axis]); };
    voids.push_back(
        {.region = {.first_node = {node(0), node(1), node(2)},
                    .volume = numbers[3],
                    .lower = numbers[4],
                    .upper = numbers[5],
                    .images = images.empty() ? 1 : static_cast<int>(images[voids.size()])},
         .time = numbers[6]});
  }
  return voids;
}

std::vector<double> images_of(std::span<const VoidClosure> voids) {
  std::vector<double> images;
  for (const VoidClosure& each : voids) images.push_back(each.region.images);
  return images;
}

// For each complete step when it ended, when its condition held (before everything: never), and
// what else is true of its end, as bits.
constexpr std::size_t numbers_per_step = 3;
constexpr double never = -1;
constexpr int out_of_time = 1;
constexpr int skipped = 2;
constexpr int ends_repeat = 4;

std::vector<double> numbers_of(std::span<const StepEnd> ends) {
  std::vector<double> numbers;
  for (const StepEnd& each : ends) {
    const int bits = (each.out_of_time ? out_of_time : 0) | (each.skipped ? skipped : 0) |
                     (each.ends_repeat ? ends_repeat : 0);
    numbers.insert(numbers.end(),
                   {each.time, each.reached.value_or(never), static_cast<double>(bits)});
  }
  return numbers;
}

std::vector<StepEnd> ends_of(std::span<const double> numbers, const fs::path& file) {
  if (numbers.size() % numbers_per_step != 0) {
    throw InputError(fmt::format("{}: the entry step_ends is not whole; it is not of this version",
                                 shown(file)));
  }
  std::vector<StepEnd> ends;
  for (; !numbers.empty(); numbers = numbers.subspan(numbers_per_step)) {
    const auto bits = static_cast<int>(numbers[2]);
    ends.push_back({.time = numbers[0],
                    .reached = numbers[1] >= 0 ? std::optional(numbers[1]) : std::nullopt,
                    .out_of_time = (bits & out_of_time) != 0,
                    .skipped = (bits & skipped) != 0,
                    .ends_repeat = (bits & ends_repeat) != 0});
  }
  return ends;
}

// For each opening its place, whether it is there, and two lists, each behind its length: parts;
// runs of nodes as pairs.
std::vector<double> numbers_of(const OpeningNames& openings) {
  std::vector<double> numbers;
  for (const NamedOpening& each : openings.known()) {
    numbers.insert(numbers.end(), {each.place[0], each.place[1], each.is_there ? 1.0 : 0.0});
    numbers.push_back(static_cast<double>(each.parts.size()));
    for (const std::size_t part : each.parts) numbers.push_back(static_cast<double>(part));
    numbers.push_back(static_cast<double>(each.nodes.size()));
    for (const NodeRun& run : each.nodes) {
      numbers.push_back(run.first);
      numbers.push_back(run.count);
    }
  }
  return numbers;
}

// Reads what numbers_of wrote, front to back.
class OpeningReader {
 public:
  OpeningReader(std::span<const double> numbers, const fs::path& file)
      : numbers_(numbers), file_(file) {}

  OpeningNames run() {
    std::vector<NamedOpening> openings;
    while (!numbers_.empty()) {
      NamedOpening& opening = openings.emplace_back();
      opening.place = {next(), next()};
      opening.is_there = next() != 0;
      for (auto left = count(); left > 0; --left) opening.parts.push_back(count());
      for (auto left = count(); left > 0; --left) {
        const std::uint32_t first = count();
        opening.nodes.push_back({.first = first, .count = count()});
      }
    }
    for (const NamedOpening& each : openings)
      for (const std::size_t part : each.parts)
        if (part >= openings.size()) refuse();
    return OpeningNames(std::move(openings));
  }

 private:
  double next() {
    if (numbers_.empty() || !std::isfinite(numbers_.front())) refuse();
    const double number = numbers_.front();
    numbers_ = numbers_.subspan(1);
    return number;
  }

  std::uint32_t count() {
    const double number = next();
    if (!(number >= 0 && number <= std::numeric_limits<std::uint32_t>::max())) refuse();
    return static_cast<std::uint32_t>(number);
  }

  [[noreturn]] void refuse() const {
    throw InputError(fmt::format("{}: the entry openings is not whole; it is not of this version",
                                 shown(file_)));
  }

  std::span<const double> numbers_;
  const fs::path& file_;
};

// Nothing, or one number.
std::string text_of(std::optional<double> number) { return number ? format_number(*number) : ""; }

std::optional<double> optional_of(std::span<const double> numbers) {
  return numbers.empty() ? std::nullopt : std::optional(numbers.front());
}

// Numbers as they lie in memory: a mesh is large, and every bit of it counts.
template <class T>
void append_bytes(std::string& bytes, std::span<const T> values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

std::string bytes_of(const TriMesh& mesh) {
  std::string bytes;
  append_bytes<Vec3f>(bytes, mesh.vertices);
  append_bytes<Triangle>(bytes, mesh.triangles);
  return bytes;
}

// The names in lines, then values.
std::string bytes_of(const SurfaceCoverages& coverages) {
  std::string bytes;
  for (const std::string& name : coverages.names) bytes += name + '\n';
  bytes += '\n';
  for (const std::vector<float>& values : coverages.values) append_bytes<float>(bytes, values);
  return bytes;
}

// The count and the time step in a line, then values.
std::string bytes_of(const EarlierFlux& flux) {
  std::string bytes = fmt::format("{} {}\n", flux.tallies.size(), format_number(flux.dt));
  for (const std::vector<float>& tally : flux.tallies) append_bytes<float>(bytes, tally);
  return bytes;
}

// Counts, time step, bound and distance in a line, then vertices, triangles and their materials.
std::string bytes_of(const KeptMesh& mesh) {
  std::string bytes =
      fmt::format("{} {} {} {} {}\n", mesh.facets.vertices.size(), mesh.facets.triangles.size(),
                  mesh.made_at, format_number(mesh.bound), format_number(mesh.max_distance));
  bytes += bytes_of(mesh.facets);
  append_bytes<MaterialId>(bytes, mesh.facets.materials);
  return bytes;
}

const std::string& note_of(const CheckpointNotes& notes, const std::string& key,
                           const fs::path& file) {
  const auto entry = notes.find(key);
  if (entry != notes.end()) return entry->second;
  throw InputError(fmt::format("{}: the entry {} is missing; this is not a checkpoint of a run",
                               shown(file), key));
}

// Reads an entry of what bytes_of wrote, front to back.
class EntryReader {
 public:
  EntryReader(const CheckpointNotes& notes, std::string name, const fs::path& file)
      : name_(std::move(name)), bytes_(note_of(notes, name_, file)), file_(file) {}

  SurfaceCoverages coverages(std::size_t facets) {
    SurfaceCoverages coverages;
    for (std::string_view name = line(); !name.empty(); name = line())
      coverages.names.emplace_back(name);
    for (std::size_t k = 0; k < coverages.names.size(); ++k)
      coverages.values.push_back(numbers<float>(facets));
    if (!bytes_.empty()) refuse();
    return coverages;
  }

  EarlierFlux earlier_flux(std::size_t facets) {
    EarlierFlux flux;
    std::size_t count = 0;
    std::istringstream head{std::string(line())};
    if (!(head >> count >> flux.dt) || count > bytes_.size()) refuse();
    for (std::size_t k = 0; k < count; ++k) flux.tallies.push_back(numbers<float>(facets));
    if (!bytes_.empty()) refuse();
    return flux;
  }

  KeptMesh kept_mesh() {
    KeptMesh kept;
    std::size_t vertices = 0;
    std::size_t facets = 0;
    std::istringstream head{std::string(line())};
    if (!(head >> vertices >> facets >> kept.made_at >> kept.bound >> kept.max_distance)) refuse();
    kept.facets = mesh(vertices, facets);
    if (!bytes_.empty()) refuse();
    return kept;
  }

 private:
  [[noreturn]] void refuse() const {
    throw InputError(fmt::format("{}: the entry {} is not whole; it is not of this version",
                                 shown(file_), name_));
  }

  std::string_view line() {
    const std::size_t end = bytes_.find('\n');
    if (end == std::string_view::npos) refuse();
    const std::string_view text = bytes_.substr(0, end);
    bytes_.remove_prefix(end + 1);
    return text;
  }

  template <class T>
  std::vector<T> numbers(std::size_t count) {
    if (count > bytes_.size() / sizeof(T)) refuse();
    std::vector<T> values(count);
    if (count > 0) std::memcpy(values.data(), bytes_.data(), count * sizeof(T));
    bytes_.remove_prefix(count * sizeof(T));
    return values;
  }

  TriMesh mesh(std::size_t vertices, std::size_t facets) {
    TriMesh mesh;
    mesh.vertices = numbers<Vec3f>(vertices);
    mesh.triangles = numbers<Triangle>(facets);
    mesh.materials = numbers<MaterialId>(facets);
    for (const Triangle& triangle : mesh.triangles)
      for (const std::uint32_t v : triangle)
        if (v >= vertices) refuse();
    return mesh;
  }

  std::string name_;
  std::string_view bytes_;
  const fs::path& file_;
};

std::pair<KeptMesh, SurfaceCoverages> read_surface(const CheckpointNotes& notes,
                                                   const fs::path& file) {
  KeptMesh mesh = EntryReader(notes, "mesh", file).kept_mesh();
  SurfaceCoverages coverages =
      EntryReader(notes, "coverages", file).coverages(mesh.facets.triangles.size());
  return {std::move(mesh), std::move(coverages)};
}

// The names of the layers' materials, a line each.
std::string names_of(const Layers& layers, const Materials& materials) {
  std::string names;
  for (const Layer& layer : layers.stack) names += materials[layer.material].name + '\n';
  return names;
}

// Numbers of materials are those of the recipe that wrote the file.
void name_materials(Layers& layers, const std::string& names, const Materials& materials,
                    const fs::path& file) {
  std::istringstream lines(names);
  for (Layer& layer : layers.stack) {
    std::string name;
    std::getline(lines, name);
    const std::optional<MaterialId> material = materials.find(name);
    if (!material) {
      throw InputError(
          fmt::format("{} holds the material {}, which this recipe does not know; add a table "
                      "[materials.{}] with its density",
                      shown(file), name, name));
    }
    layer.material = *material;
  }
}

std::string names_of(std::span<const MaterialId> ids, const Materials& materials) {
  std::string names;
  for (const MaterialId id : ids) names += materials[id].name + '\n';
  return names;
}

// Not in checkpoints of earlier versions.
std::string optional_note(const CheckpointNotes& notes, const std::string& key) {
  const auto entry = notes.find(key);
  return entry == notes.end() ? "" : entry->second;
}

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

CheckpointNotes notes_of(const State& state, const Recipe& recipe, const WrittenSoFar& written) {
  return {{"materials", names_of(state.layers, recipe.materials)},
          {"origin_s", format_number(state.origin.time)},
          {"origin_time_step", std::to_string(state.origin.time_step)},
          {"time_s", format_number(state.time)},
          {"step", std::to_string(state.step)},
          {"step_start_s", format_number(state.step_start)},
          {"step_start_height_nm", text_of(state.progress.start_height)},
          {"step_end_reached_s", text_of(state.progress.reached)},
          {"repeat_start_height_nm", text_of(state.repeat_start)},
          {"step_ends", joined(numbers_of(state.ends))},
          {"time_step", std::to_string(state.time_step)},
          {"seed", std::to_string(recipe.flux.seed)},
          {"output_times_s", joined(written.output_times)},
          {"voids", joined(numbers_of(state.voids))},
          {"void_images", joined(images_of(state.voids))},
          {"islands_removed", std::to_string(state.islands.count)},
          {"island_volume_nm3", format_number(state.islands.volume)},
          {"residue_volume_nm3", format_number(state.residue_volume)},
          {"feet_are_rounded", state.feet_are_rounded ? "1" : "0"},
          {"mesh", bytes_of(state.mesh)},
          {"coverages", bytes_of(state.coverages)},
          {"earlier_flux", bytes_of(state.earlier)},
          {"openings", joined(numbers_of(written.openings))},
          {"masks", names_of(recipe.metrology.masks, recipe.materials)},
          {"cd_heights_nm", joined(recipe.metrology.cd_heights)},
          {"rows_hash", written.rows_hash},
          {"file_hashes", text_of(written.hashes)},
          {"recipe_hash", recipe_hash(recipe)}};
}

std::vector<double> numbers_of(const CheckpointNotes& notes, const std::string& key,
                               const fs::path& file) {
  std::vector<double> numbers;
  std::istringstream text(note_of(notes, key, file));
  for (std::string word; text >> word;) numbers.push_back(std::strtod(word.c_str(), nullptr));
  return numbers;
}

std::vector<VoidClosure> read_voids(const CheckpointNotes& notes, const fs::path& file) {
  const bool has_images = notes.contains("void_images");
  return voids_of(numbers_of(notes, "voids", file),
                  has_images ? numbers_of(notes, "void_images", file) : std::vector<double>{},
                  file);
}

// Not known of checkpoints of earlier versions.
bool read_feet_are_rounded(const CheckpointNotes& notes) {
  return optional_note(notes, "feet_are_rounded") == "1";
}

// None in checkpoints of earlier versions.
OpeningNames read_openings(const CheckpointNotes& notes, const fs::path& file) {
  if (!notes.contains("openings")) return {};
  return OpeningReader(numbers_of(notes, "openings", file), file).run();
}

double number_of(const CheckpointNotes& notes, const std::string& key, const fs::path& file) {
  const std::vector<double> numbers = numbers_of(notes, key, file);
  if (numbers.size() == 1) return numbers.front();
  throw InputError(fmt::format(
      "{}: the entry {} is not a number; this is not a checkpoint of a run", shown(file), key));
}

// By their numbers: longer names are later.
bool is_older(const fs::path& a, const fs::path& b) {
  const std::string left = a.filename().string();
  const std::string right = b.filename().string();
  return std::pair(left.size(), left) < std::pair(right.size(), right);
}

Restart read_restart(const fs::path& file, const Recipe& recipe) {
  Checkpoint checkpoint = read_checkpoint(file);
  const auto value = [&](const char* key) { return number_of(checkpoint.notes, key, file); };
  const auto numbers = [&](const char* key) { return numbers_of(checkpoint.notes, key, file); };
  if (const auto hash = checkpoint.notes.find("recipe_hash");
      hash == checkpoint.notes.end() || hash->second != recipe_hash(recipe)) {
    throw InputError(fmt::format("{}: belongs to another recipe", shown(file)));
  }
  auto [mesh, coverages] = read_surface(checkpoint.notes, file);
  EarlierFlux earlier = EntryReader(checkpoint.notes, "earlier_flux", file)
                            .earlier_flux(mesh.facets.triangles.size());
  return {.state = {.layers = std::move(checkpoint.layers),
                    .origin = {value("origin_s"),
                               static_cast<std::uint32_t>(value("origin_time_step"))},
                    .time = value("time_s"),
                    .step = static_cast<std::size_t>(value("step")),
                    .step_start = value("step_start_s"),
                    .progress = {.start_height = optional_of(numbers("step_start_height_nm")),
                                 .reached = optional_of(numbers("step_end_reached_s"))},
                    .repeat_start = optional_of(numbers("repeat_start_height_nm")),
                    .ends = ends_of(numbers("step_ends"), file),
                    .time_step = static_cast<std::uint32_t>(value("time_step")),
                    .voids = read_voids(checkpoint.notes, file),
                    .islands = {.count = static_cast<std::size_t>(value("islands_removed")),
                                .volume = value("island_volume_nm3")},
                    .residue_volume = value("residue_volume_nm3"),
                    .feet_are_rounded = read_feet_are_rounded(checkpoint.notes),
                    .mesh = std::move(mesh),
                    .coverages = std::move(coverages),
                    .earlier = std::move(earlier)},
          .file = file,
          .written = {.output_times = numbers("output_times_s"),
                      .rows_hash = optional_note(checkpoint.notes, "rows_hash"),
                      .hashes = hashes_of(optional_note(checkpoint.notes, "file_hashes")),
                      .openings = read_openings(checkpoint.notes, file)}};
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
      fmt::format("{0}: lines 2 to {1} are not those that stood there when {2} was written, and "
                  "will be written "
                  "again (to go on from {2} instead, without them, move the file away)",
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
  write_checkpoint(file, state.layers, notes_of(state, recipe, written));
}

std::optional<Restart> newest_restart(std::span<const fs::path> checkpoints,
                                      const std::optional<MetricsRows>& rows, const Recipe& recipe,
                                      const Log& log) {
  // Outputs are numbered in the order of time; only checkpoints between them are not.
  std::vector<fs::path> newest_first(checkpoints.begin(), checkpoints.end());
  std::sort(newest_first.begin(), newest_first.end(),
            [](const fs::path& a, const fs::path& b) { return is_older(b, a); });
  std::optional<Restart> newest;
  for (const fs::path& file : newest_first) {
    try {
      Restart restart = read_restart(file, recipe);
      const auto number = output_number(file.filename().string(), "state", ".vdb");
      require_number(restart, number);
      if (rows) require_rows(restart, *rows);
      if (!newest || restart.state.time_step > newest->state.time_step) {
        newest = std::move(restart);
      }
      if (number) break;
    } catch (const InputError& error) {
      log.warn(fmt::format("{}; going on from an earlier checkpoint", error.what()));
    }
  }
  return newest;
}

State read_start_state(const fs::path& file, const Materials& materials) {
  Checkpoint checkpoint = read_checkpoint(file);
  const auto value = [&](const char* key) { return number_of(checkpoint.notes, key, file); };
  name_materials(checkpoint.layers, note_of(checkpoint.notes, "materials", file), materials, file);
  auto [mesh, coverages] = read_surface(checkpoint.notes, file);
  mesh.facets.materials.clear();  // numbers of the other recipe
  return whole_of({.layers = std::move(checkpoint.layers),
                   .time = value("time_s"),
                   .time_step = static_cast<std::uint32_t>(value("time_step")),
                   .voids = read_voids(checkpoint.notes, file),
                   .feet_are_rounded = read_feet_are_rounded(checkpoint.notes),
                   .mesh = std::move(mesh),
                   .coverages = std::move(coverages)});
}

Recipe read_runnable(const fs::path& file, const std::vector<std::string>& overrides) {
  const auto load = [](const fs::path& start, const Materials& materials) {
    const auto state = std::make_shared<const State>(read_start_state(start, materials));
    return StartState{start, state, state_hash(*state, materials)};
  };
  return read_recipe(file, overrides, load);
}

SavedWafer read_wafer(const fs::path& file, Materials known) {
  Checkpoint checkpoint = read_checkpoint(file);
  SavedWafer wafer{.layers = whole_of({.layers = std::move(checkpoint.layers)}).layers,
                   .materials = std::move(known),
                   .time = number_of(checkpoint.notes, "time_s", file),
                   .openings = read_openings(checkpoint.notes, file)};
  const std::string names = note_of(checkpoint.notes, "materials", file);
  const auto each_line = [](const std::string& text, const auto& visit) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) visit(line);
  };
  each_line(names, [&](const std::string& name) {
    if (!wafer.materials.contains(name)) wafer.materials.add({.name = name});
  });
  name_materials(wafer.layers, names, wafer.materials, file);
  each_line(optional_note(checkpoint.notes, "masks"), [&](const std::string& name) {
    // A mask that is gone has no layer any more.
    if (!wafer.materials.contains(name)) wafer.materials.add({.name = name});
    wafer.metrology.masks.push_back(wafer.materials.id(name));
  });
  if (checkpoint.notes.contains("cd_heights_nm"))
    wafer.metrology.cd_heights = numbers_of(checkpoint.notes, "cd_heights_nm", file);
  wafer.metrology.feet_are_rounded = read_feet_are_rounded(checkpoint.notes);
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

std::string state_hash(const State& state, const Materials& materials) {
  if (state.layers.frame.images() > 1) return state_hash(whole_of(copy_of(state)), materials);
  Hash result;
  for (const Layer& layer : state.layers.stack) {
    result.add(materials[layer.material].name);
    result.add("\n");
  }
  result.add_value(hash(state.layers));
  result.add_value(state.time);
  if (!state.coverages.names.empty()) {
    result.add(bytes_of(state.mesh.facets));
    result.add(bytes_of(state.coverages));
  }
  return result.hex();
}

}  // namespace scarp

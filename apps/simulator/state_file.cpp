#include "apps/simulator/state_file.h"

#include <fmt/format.h>

#include <cstdlib>
#include <cstring>
#include <sstream>

#include "apps/simulator/symmetry.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"
#include "core/system/hash.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

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

std::vector<VoidClosure> voids_of(std::span<const double> numbers, std::span<const double> images,
                                  const fs::path& file) {
  const std::size_t count = numbers.size() / numbers_per_void;
  if (numbers.size() % numbers_per_void != 0 || images.size() != count) {
    throw InputError(fmt::format(
        "{}: the entry voids is not complete; the file is not of this version", shown(file)));
  }
  std::vector<VoidClosure> voids;
  for (; !numbers.empty(); numbers = numbers.subspan(numbers_per_void)) {
    const auto node = [&](std::size_t axis) { return static_cast<int>(numbers[axis]); };
    voids.push_back({.region = {.first_node = {node(0), node(1), node(2)},
                                .volume = numbers[3],
                                .lower = numbers[4],
                                .upper = numbers[5],
                                .images = static_cast<int>(images[voids.size()])},
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
    throw InputError(fmt::format(
        "{}: the entry step_ends is not complete; the file is not of this version", shown(file)));
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

// Reads an entry of what bytes_of wrote, front to back.
class EntryReader {
 public:
  EntryReader(const CheckpointNotes& notes, std::string name, const fs::path& file)
      : name_(std::move(name)), bytes_(note_in(notes, name_, file)), file_(file) {}

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
    throw InputError(fmt::format(
        "{}: the entry {} is not complete; the file is not of this version", shown(file_), name_));
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

std::vector<MaterialId> materials_of(const Layers& layers) {
  std::vector<MaterialId> materials;
  for (const Layer& layer : layers.stack) materials.push_back(layer.material);
  return materials;
}

// Writes each member of a state as the entries that hold it.
class StateWriter {
 public:
  explicit StateWriter(CheckpointNotes& notes) : notes_(notes) {}

  void write(const char*, const Layers&) const {}  // not a note
  void write(const char* name, double value) { notes_[name] = format_number(value); }
  void write(const char* name, std::size_t value) { notes_[name] = std::to_string(value); }
  void write(const char* name, std::uint32_t value) { notes_[name] = std::to_string(value); }
  void write(const char* name, bool value) { notes_[name] = value ? '1' : '0'; }
  void write(const char* name, std::optional<double> value) { notes_[name] = text_of(value); }
  void write(const char*, const Origin& origin) {
    write("origin_s", origin.time);
    write("origin_time_step", origin.time_step);
  }
  void write(const char*, const EndProgress& progress) {
    write("step_start_height_nm", progress.start_height);
    write("step_end_reached_s", progress.reached);
  }
  void write(const char*, const RemovedSolid& islands) {
    write("islands_removed", islands.count);
    write("island_volume_nm3", islands.volume);
  }
  void write(const char* name, const std::vector<StepEnd>& ends) {
    notes_[name] = joined(numbers_of(ends));
  }
  void write(const char* name, const std::vector<VoidClosure>& voids) {
    notes_[name] = joined(numbers_of(voids));
    notes_["void_images"] = joined(images_of(voids));
  }
  void write(const char* name, const KeptMesh& mesh) { notes_[name] = bytes_of(mesh); }
  void write(const char* name, const SurfaceCoverages& coverages) {
    notes_[name] = bytes_of(coverages);
  }
  void write(const char* name, const EarlierFlux& flux) { notes_[name] = bytes_of(flux); }

 private:
  CheckpointNotes& notes_;
};

// Reads them back. What is known on facets comes after the mesh.
class StateReader {
 public:
  StateReader(Checkpoint checkpoint, const fs::path& file)
      : layers_(std::move(checkpoint.layers)), notes_(std::move(checkpoint.notes)), file_(file) {}

  void read(const char*, Layers& layers) { layers = std::move(layers_); }
  void read(const char* name, double& value) const { value = number_in(notes_, name, file_); }
  void read(const char* name, std::size_t& value) const { value = count<std::size_t>(name); }
  void read(const char* name, std::uint32_t& value) const { value = count<std::uint32_t>(name); }
  void read(const char* name, bool& value) const { value = note_in(notes_, name, file_) == "1"; }
  void read(const char* name, std::optional<double>& value) const {
    value = optional_of(numbers_in(notes_, name, file_));
  }
  void read(const char*, Origin& origin) const {
    read("origin_s", origin.time);
    read("origin_time_step", origin.time_step);
  }
  void read(const char*, EndProgress& progress) const {
    read("step_start_height_nm", progress.start_height);
    read("step_end_reached_s", progress.reached);
  }
  void read(const char*, RemovedSolid& islands) const {
    read("islands_removed", islands.count);
    read("island_volume_nm3", islands.volume);
  }
  void read(const char* name, std::vector<StepEnd>& ends) const {
    ends = ends_of(numbers_in(notes_, name, file_), file_);
  }
  void read(const char* name, std::vector<VoidClosure>& voids) const {
    voids =
        voids_of(numbers_in(notes_, name, file_), numbers_in(notes_, "void_images", file_), file_);
  }
  void read(const char* name, KeptMesh& mesh) {
    mesh = EntryReader(notes_, name, file_).kept_mesh();
    facet_count_ = mesh.facets.triangles.size();
  }
  void read(const char* name, SurfaceCoverages& coverages) const {
    coverages = EntryReader(notes_, name, file_).coverages(facet_count_);
  }
  void read(const char* name, EarlierFlux& flux) const {
    flux = EntryReader(notes_, name, file_).earlier_flux(facet_count_);
  }

 private:
  template <class T>
  T count(const char* name) const {
    return static_cast<T>(number_in(notes_, name, file_));
  }

  Layers layers_;
  CheckpointNotes notes_;
  const fs::path& file_;
  std::size_t facet_count_ = 0;
};

// Without what belongs to the recipe that it comes from.
State start_from(State left) {
  left.mesh.facets.materials.clear();  // numbers of the other recipe
  State start{.layers = std::move(left.layers),
              .time = left.time,
              .time_step = left.time_step,
              .voids = std::move(left.voids),
              .feet_are_rounded = left.feet_are_rounded,
              .mesh = std::move(left.mesh),
              .coverages = std::move(left.coverages)};
  return whole_of(std::move(start));
}

}  // namespace

std::string joined(std::span<const double> numbers) {
  std::string text;
  for (const double number : numbers) {
    if (!text.empty()) text += ' ';
    text += format_number(number);
  }
  return text;
}

const std::string& note_in(const CheckpointNotes& notes, const std::string& key,
                           const fs::path& file) {
  const auto entry = notes.find(key);
  if (entry != notes.end()) return entry->second;
  throw InputError(fmt::format("{}: the entry {} is missing; this is not a checkpoint of a run",
                               shown(file), key));
}

std::vector<double> numbers_in(const CheckpointNotes& notes, const std::string& key,
                               const fs::path& file) {
  std::vector<double> numbers;
  std::istringstream text(note_in(notes, key, file));
  for (std::string word; text >> word;) numbers.push_back(std::strtod(word.c_str(), nullptr));
  return numbers;
}

double number_in(const CheckpointNotes& notes, const std::string& key, const fs::path& file) {
  const std::vector<double> numbers = numbers_in(notes, key, file);
  if (numbers.size() == 1) return numbers.front();
  throw InputError(fmt::format(
      "{}: the entry {} is not a number; this is not a checkpoint of a run", shown(file), key));
}

std::string names_of(std::span<const MaterialId> ids, const Materials& materials) {
  std::string names;
  for (const MaterialId id : ids) names += materials[id].name + '\n';
  return names;
}

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

void write_state(const fs::path& file, const State& state, const Recipe& recipe,
                 const OpeningNames& openings, CheckpointNotes notes) {
  const Materials& materials = recipe.materials;
  notes["materials"] = names_of(materials_of(state.layers), materials);
  notes["masks"] = names_of(recipe.metrology.masks, materials);
  notes["cd_heights_nm"] = joined(recipe.metrology.cd_heights);
  notes["angle_heights_nm"] = joined(recipe.metrology.angle_heights);
  notes["seed"] = std::to_string(recipe.flux.options.seed);
  notes["recipe_hash"] = recipe.hash();
  notes["openings"] = joined(numbers_of(openings));
  StateWriter writer(notes);
  std::apply([&](const auto&... field) { (writer.write(field.name, field.value), ...); },
             fields_of(state));
  write_checkpoint(file, state.layers, notes);
}

OpeningNames openings_in(const CheckpointNotes& notes, const fs::path& file) {
  std::optional<OpeningNames> openings = opening_names_of(numbers_in(notes, "openings", file));
  if (openings) return std::move(*openings);
  throw InputError(fmt::format(
      "{}: the entry openings is not complete; the file is not of this version", shown(file)));
}

State state_of(Checkpoint checkpoint, const fs::path& file) {
  State state;
  StateReader reader(std::move(checkpoint), file);
  std::apply([&](const auto&... field) { (reader.read(field.name, field.value), ...); },
             fields_of(state));
  return state;
}

State read_start_state(const fs::path& file, const Materials& materials) {
  Checkpoint checkpoint = read_checkpoint(file);
  const std::string names = note_in(checkpoint.notes, "materials", file);
  name_materials(checkpoint.layers, names, materials, file);
  return start_from(state_of(std::move(checkpoint), file));
}

State start_state_from(const State& left, const Materials& its, const Materials& materials) {
  State state = copy_of(left);
  name_materials(state.layers, names_of(materials_of(state.layers), its), materials, "the start");
  return start_from(std::move(state));
}

StartState load_start(const fs::path& file, const Materials& materials) {
  const auto state = std::make_shared<const State>(read_start_state(file, materials));
  return {file, state, state_hash(*state, materials)};
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

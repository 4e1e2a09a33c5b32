#include "levelset/grid/checkpoint.h"

#include <xxhash.h>

#include <array>
#include <cstring>
#include <sstream>
#include <string_view>

#include "core/error.h"
#include "core/printable.h"
#include "core/system/atomic_file.h"
#include "core/system/read_file.h"
#include "levelset/grid/vdb.h"

namespace scarp {

namespace {

/// Raised when the meaning of a file changes.
constexpr std::int32_t format = 2;

constexpr std::string_view note_prefix = "note:";

/// Follows the .vdb content, which other readers ignore: damage is found before OpenVDB, which
/// leaks and may crash on damaged files, sees a byte.
struct Trailer {
  std::array<char, 8> mark{'s', 'c', 'a', 'r', 'p', 'v', 'd', 'b'};
  std::uint64_t size = 0;
  std::uint64_t hash = 0;

  explicit Trailer(std::string_view content)
      : size(content.size()), hash(XXH3_64bits(content.data(), content.size())) {}

  std::string bytes() const {
    std::string text(sizeof *this, '\0');
    std::memcpy(text.data(), this, sizeof *this);
    return text;
  }
};

/// The content of a file without its trailer.
std::string checked_content(std::string file) {
  if (file.size() < sizeof(Trailer)) {
    throw InputError("it is too short");
  }
  const std::string found = file.substr(file.size() - sizeof(Trailer));
  file.resize(file.size() - sizeof(Trailer));
  if (found != Trailer(file).bytes()) {
    throw InputError("it is truncated, damaged or was not written by scarp");
  }
  return file;
}

/// Notes may hold any bytes, OpenVDB's strings as well: no escaping is needed.
VdbMetadata file_metadata(const Layers& layers, const CheckpointNotes& notes) {
  const Frame& frame = layers.frame;
  VdbMetadata values{{"scarp_format", format},
                     {"spacing", frame.spacing},
                     {"two_dimensional", frame.two_dimensional},
                     {"hash", static_cast<std::int64_t>(hash(layers))}};
  for (int axis = 0; axis < 2; ++axis) {
    const std::string name(1, axis == 0 ? 'x' : 'y');
    values["cells_" + name] = frame.cells[axis];
    values["periodic_" + name] = frame.boundary[axis] == Boundary::periodic;
    if (frame.half[axis]) values["half_" + name] = true;
  }
  if (frame.axisymmetric) values["axisymmetric"] = true;
  if (frame.diagonal) values["diagonal"] = true;
  for (const auto& [key, value] : notes) {
    values[std::string(note_prefix) + key] = value;
  }
  return values;
}

/// Throws a std::exception if there is no such value of that type.
template <class Value>
Value value_of(const VdbMetadata& values, const std::string& name) {
  return std::get<Value>(values.at(name));
}

Frame read_frame(const VdbMetadata& values) {
  Frame frame;
  frame.spacing = value_of<double>(values, "spacing");
  for (int axis = 0; axis < 2; ++axis) {
    const std::string name(1, axis == 0 ? 'x' : 'y');
    frame.cells[axis] = value_of<std::int32_t>(values, "cells_" + name);
    frame.boundary[axis] =
        value_of<bool>(values, "periodic_" + name) ? Boundary::periodic : Boundary::reflective;
    frame.half[axis] = values.contains("half_" + name);
  }
  frame.two_dimensional = value_of<bool>(values, "two_dimensional");
  frame.axisymmetric = values.contains("axisymmetric");
  frame.diagonal = values.contains("diagonal");
  if (!(frame.spacing > 0) || frame.cells[0] < 1 || frame.cells[1] < 1) {
    throw InputError("its domain is empty");
  }
  return frame;
}

CheckpointNotes read_notes(const VdbMetadata& values) {
  CheckpointNotes notes;
  for (const auto& [name, value] : values) {
    if (name.starts_with(note_prefix)) {
      notes[name.substr(note_prefix.size())] = std::get<std::string>(value);
    }
  }
  return notes;
}

std::string layer_name(std::size_t n) { return "layer_" + std::to_string(n); }

/// A layer's grid, named by its place in the stack and placed in space.
VdbEntry entry_of(const Layers& layers, std::size_t n) {
  const Frame& frame = layers.frame;
  const Layer& layer = layers.stack[n];
  return {.name = layer_name(n),
          .spacing = frame.spacing,
          .origin = {frame.node_position(0, 0), frame.node_position(1, 0), 0},
          .metadata = {{"material", std::int32_t{layer.material}}},
          .grid = layer.phi.band().grid()};
}

Checkpoint read_vdb(std::istream& in) {
  const VdbFile file = VdbFile::read(in);
  const auto written = value_of<std::int32_t>(file.metadata, "scarp_format");
  if (written != format) {
    throw InputError("it has format " + std::to_string(written) + ", this version of scarp reads " +
                     std::to_string(format));
  }
  Checkpoint checkpoint{.layers = {.frame = read_frame(file.metadata), .stack = {}},
                        .notes = read_notes(file.metadata)};
  for (const VdbEntry& entry : file.grids) {
    if (entry.name != layer_name(checkpoint.layers.stack.size())) {
      throw InputError("it does not hold the layers of a wafer");
    }
    const auto material =
        static_cast<MaterialId>(value_of<std::int32_t>(entry.metadata, "material"));
    auto band = std::make_unique<Band>(checkpoint.layers.frame, entry.grid);
    checkpoint.layers.stack.push_back({material, LevelSet(std::move(band))});
  }
  if (checkpoint.layers.stack.empty()) {
    throw InputError("it holds no layers");
  }
  if (static_cast<std::int64_t>(hash(checkpoint.layers)) !=
      value_of<std::int64_t>(file.metadata, "hash")) {
    throw InputError("its content was changed or damaged");
  }
  return checkpoint;
}

}  // namespace

void write_checkpoint(const std::filesystem::path& path, const Layers& layers,
                      const CheckpointNotes& notes) {
  VdbFile vdb{.metadata = file_metadata(layers, notes), .grids = {}};
  for (std::size_t n = 0; n < layers.stack.size(); ++n) {
    vdb.grids.push_back(entry_of(layers, n));
  }
  std::ostringstream content(std::ios::binary);
  vdb.write(content);
  write_file(path, {content.view(), Trailer(content.view()).bytes()});
}

Checkpoint read_checkpoint(const std::filesystem::path& path) {
  const std::string file = read_file(path);
  // The only place where exceptions of OpenVDB are expected: they mean damaged files.
  try {
    std::istringstream content(checked_content(file), std::ios::binary);
    return read_vdb(content);
  } catch (const InputError& error) {
    throw InputError(shown(path) + ": not a checkpoint that can be read: " + error.what());
  } catch (const std::exception&) {
    // The library's own text may quote the damaged bytes.
    throw InputError(shown(path) + ": damaged or not a checkpoint of scarp");
  }
}

}  // namespace scarp

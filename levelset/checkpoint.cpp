#include "levelset/checkpoint.h"

#include <xxhash.h>

#include <array>
#include <cstring>
#include <sstream>
#include <string_view>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/read_file.h"
#include "levelset/vdb.h"

namespace scarp {

namespace {

/// Raised when the meaning of a file changes.
constexpr int format = 1;

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
openvdb::MetaMap notes_meta(const Layers& layers, const CheckpointNotes& notes) {
  const Frame& frame = layers.frame;
  openvdb::MetaMap meta;
  meta.insertMeta("scarp_format", openvdb::Int32Metadata(format));
  meta.insertMeta("spacing", openvdb::DoubleMetadata(frame.spacing));
  for (int axis = 0; axis < 2; ++axis) {
    const std::string name(1, axis == 0 ? 'x' : 'y');
    meta.insertMeta("cells_" + name, openvdb::Int32Metadata(frame.cells[axis]));
    meta.insertMeta("periodic_" + name,
                    openvdb::BoolMetadata(frame.boundary[axis] == Boundary::periodic));
  }
  meta.insertMeta("two_dimensional", openvdb::BoolMetadata(frame.two_dimensional));
  meta.insertMeta("hash", openvdb::Int64Metadata(static_cast<std::int64_t>(hash(layers))));
  for (const auto& [key, value] : notes) {
    meta.insertMeta(std::string(note_prefix) + key, openvdb::StringMetadata(value));
  }
  return meta;
}

Frame read_frame(const openvdb::MetaMap& meta) {
  Frame frame;
  frame.spacing = meta.metaValue<double>("spacing");
  for (int axis = 0; axis < 2; ++axis) {
    const std::string name(1, axis == 0 ? 'x' : 'y');
    frame.cells[axis] = meta.metaValue<openvdb::Int32>("cells_" + name);
    frame.boundary[axis] =
        meta.metaValue<bool>("periodic_" + name) ? Boundary::periodic : Boundary::reflective;
  }
  frame.two_dimensional = meta.metaValue<bool>("two_dimensional");
  if (!(frame.spacing > 0) || frame.cells[0] < 1 || frame.cells[1] < 1) {
    throw InputError("its domain is empty");
  }
  return frame;
}

CheckpointNotes read_notes(const openvdb::MetaMap& meta) {
  CheckpointNotes notes;
  for (auto entry = meta.beginMeta(); entry != meta.endMeta(); ++entry) {
    if (entry->first.starts_with(note_prefix)) {
      notes[entry->first.substr(note_prefix.size())] =
          static_cast<const openvdb::StringMetadata&>(*entry->second).value();
    }
  }
  return notes;
}

/// A shallow copy of a layer's grid, named by its place in the stack and placed in space.
PhiGrid::Ptr named_grid(const Layers& layers, std::size_t n) {
  const Frame& frame = layers.frame;
  const PhiGrid::Ptr grid = layers.stack[n].phi.band().storage().grid->copy();
  const auto transform = openvdb::math::Transform::createLinearTransform(frame.spacing);
  transform->postTranslate({frame.node_position(0, 0), frame.node_position(1, 0), 0});
  grid->setTransform(transform);
  grid->setName("layer_" + std::to_string(n));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->insertMeta("material", openvdb::Int32Metadata(layers.stack[n].material));
  return grid;
}

Checkpoint read_vdb(std::istream& in) {
  openvdb::io::Stream stream(in, /*delayLoad=*/false);
  const auto meta = stream.getMetadata();
  if (!meta || meta->metaValue<openvdb::Int32>("scarp_format") != format) {
    throw InputError("it was not written by this version of scarp");
  }
  Checkpoint checkpoint{.layers = {.frame = read_frame(*meta), .stack = {}},
                        .notes = read_notes(*meta)};
  for (const auto& base : *stream.getGrids()) {
    const auto grid = openvdb::gridPtrCast<PhiGrid>(base);
    if (!grid || grid->getName() != "layer_" + std::to_string(checkpoint.layers.stack.size())) {
      throw InputError("it does not hold the layers of a wafer");
    }
    auto band =
        std::make_unique<Band>(checkpoint.layers.frame, std::make_unique<Band::Storage>(grid));
    const auto material = static_cast<MaterialId>(grid->metaValue<openvdb::Int32>("material"));
    checkpoint.layers.stack.push_back({material, LevelSet(std::move(band))});
  }
  if (checkpoint.layers.stack.empty()) {
    throw InputError("it holds no layers");
  }
  if (static_cast<std::int64_t>(hash(checkpoint.layers)) != meta->metaValue<std::int64_t>("hash")) {
    throw InputError("its content was changed or damaged");
  }
  return checkpoint;
}

}  // namespace

void write_checkpoint(const std::filesystem::path& path, const Layers& layers,
                      const CheckpointNotes& notes) {
  openvdb::GridPtrVec grids;
  for (std::size_t n = 0; n < layers.stack.size(); ++n) {
    grids.push_back(named_grid(layers, n));
  }
  std::ostringstream content(std::ios::binary);
  openvdb::io::Stream stream(content);
  stream.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK);
  stream.write(grids, notes_meta(layers, notes));
  AtomicFile file(path);
  file.write(content.view());
  file.write(Trailer(content.view()).bytes());
  file.commit();
}

Checkpoint read_checkpoint(const std::filesystem::path& path) {
  initialize_openvdb();
  const std::string file = read_file(path);
  // The only place where exceptions of OpenVDB are expected: they tell of damaged files.
  try {
    std::istringstream content(checked_content(file), std::ios::binary);
    return read_vdb(content);
  } catch (const InputError& error) {
    throw InputError(path.string() + ": not a checkpoint that can be read: " + error.what());
  } catch (const std::exception&) {
    // The library's own text may quote the damaged bytes.
    throw InputError(path.string() + ": damaged or not a checkpoint of scarp");
  }
}

}  // namespace scarp

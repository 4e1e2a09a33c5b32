#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "levelset/grid/layers.h"

namespace scarp {

/// What a checkpoint says besides the layers, by name; the values may hold any bytes.
using CheckpointNotes = std::map<std::string, std::string>;

struct Checkpoint {
  Layers layers;
  CheckpointNotes notes;
};

/// Writes all layers and the notes to a .vdb file, which appears whole or not at all.
///
/// Bit-exact, the band's topology included. Opens in tools that read OpenVDB.
///
/// Throws: InputError if the file cannot be written (no permission, disk full).
void write_checkpoint(const std::filesystem::path& path, const Layers& layers,
                      const CheckpointNotes& notes);

/// Throws: InputError if the file is not there, is a pipe, is truncated or is not a checkpoint of
/// scarp.
Checkpoint read_checkpoint(const std::filesystem::path& path);

}  // namespace scarp

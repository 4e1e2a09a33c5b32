#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/simulator/state.h"
#include "levelset/grid/checkpoint.h"
#include "levelset/metrology/opening_names.h"

namespace scarp {

/// Writes a state, with what is to be known of its recipe, the openings that were numbered so far,
/// and more notes, to a file that appears whole or not at all. Throws: as AtomicFile.
void write_state(const std::filesystem::path& file, const State& state, const Recipe& recipe,
                 const OpeningNames& openings, CheckpointNotes notes = {});

/// The openings that were numbered up to a checkpoint.
///
/// Throws: InputError with the name of the file if it does not hold them.
OpeningNames openings_in(const CheckpointNotes& notes, const std::filesystem::path& file);

/// The state of a checkpoint of the same recipe.
///
/// Throws: InputError with the name of the file if it holds no state.
State state_of(Checkpoint checkpoint, const std::filesystem::path& file);

/// The state that another run left, for a recipe to start from: layers, materials by their names,
/// process time, closed voids, coverages.
///
/// Throws: InputError if it is not a checkpoint of a run, or holds a material that is not known.
State read_start_state(const std::filesystem::path& file, const Materials& materials);

/// The same of a state in memory, whose materials have other numbers.
State start_state_from(const State& left, const Materials& its, const Materials& materials);

/// For read_recipe(): reads states from files.
StartState load_start(const std::filesystem::path& file, const Materials& materials);

/// The hash over phi with its band, materials, coverages and process time by which runs are
/// compared.
std::string state_hash(const State& state, const Materials& materials);

/// The names of materials, a line each.
std::string names_of(std::span<const MaterialId> ids, const Materials& materials);

/// Gives layers the numbers that materials of these names have.
///
/// Throws: InputError with the name of the file if one is not known.
void name_materials(Layers& layers, const std::string& names, const Materials& materials,
                    const std::filesystem::path& file);

/// Numbers as an entry of a checkpoint has them.
std::string joined(std::span<const double> numbers);

// Entries of a checkpoint that have to be there. Throw: InputError with the name of the file.
const std::string& note_in(const CheckpointNotes& notes, const std::string& key,
                           const std::filesystem::path& file);
std::vector<double> numbers_in(const CheckpointNotes& notes, const std::string& key,
                               const std::filesystem::path& file);
double number_in(const CheckpointNotes& notes, const std::string& key,
                 const std::filesystem::path& file);

}  // namespace scarp

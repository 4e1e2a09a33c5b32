#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "levelset/polygon.h"

namespace scarp {

/// What to take from a GDSII file.
struct GdsSelection {
  std::string cell{};  ///< empty: the only cell that no other one refers to
  int layer = 0;
  std::optional<int> datatype{};  ///< empty: all
};

/// The shapes of one layer of a cell and of all cells below it: boundaries, boxes and paths (flush,
/// square, round and extended ends), with the shifts, turns, mirrors, magnifications and arrays of
/// their references. Loops may overlap; they mean their union.
///
/// Units:  nm, from the file's own database unit.
/// Throws: InputError with the name of the file if it cannot be read, is no GDSII file, ends early,
///         lacks the cell or the layer, has a cell that contains itself, cells more than 200 levels
///         deep, more than a million shapes on the layer, or points beyond 1 m.
/// Source: GDSII Stream Format Manual, release 6.0 (Calma, 1987).
std::vector<Loop> read_gds(const std::filesystem::path& file, const GdsSelection& selection);

/// As read_gds, of the content of a file that was read before.
std::vector<Loop> read_gds(const std::filesystem::path& file, std::string_view content,
                           const GdsSelection& selection);

}  // namespace scarp

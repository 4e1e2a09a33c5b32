#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "levelset/start/polygon.h"

namespace scarp {

/// A layer of a layout.
struct GdsLayer {
  int layer = 0;
  std::optional<int> datatype{};  ///< empty: all

  friend bool operator==(const GdsLayer&, const GdsLayer&) = default;
};

/// What to take from a GDSII file.
struct GdsSelection {
  std::string cell{};  ///< empty: the only cell that no other one refers to
  int layer = 0;
  std::optional<int> datatype{};  ///< empty: all
  /// Lower and upper corner of a box: shapes that cannot reach into it are left out. Units: nm.
  std::optional<std::array<Point2, 2>> window{};
  bool is_in_formula = false;  ///< messages name layers as a formula does
};

/// Shapes of a layout.
struct Layout {
  std::vector<Loop> loops;
  /// Corners of a box around all of the layer, also beyond the window.
  std::array<Point2, 2> extent{};
  /// What may be other than meant: several datatypes, an odd database unit, shapes without area.
  std::vector<std::string> doubts{};
};

/// The shapes of one layer of a cell and of all cells below it: boundaries, boxes and paths (flush,
/// square, round and extended ends; one of a single point has those alone), with the shifts, turns,
/// mirrors, magnifications and arrays of their references. Loops may overlap; they mean their
/// union.
///
/// Units:  nm, from the file's own database unit.
/// Throws: InputError with the name of the file if it cannot be read (see read_gds_library), lacks
///         the cell or the layer, has nothing on the layer that has an area, has a cell that
///         contains itself, cells more than 200 levels deep, more than a million shapes on the
///         layer within the window, or points beyond 1 m.
Layout read_gds(const std::filesystem::path& file, std::string_view content,
                const GdsSelection& selection);

/// The same of several layers.
///
/// Shape: one per layer; selection says all but these.
std::vector<Layout> read_gds_layers(const std::filesystem::path& file, std::string_view content,
                                    GdsSelection selection, std::span<const GdsLayer> layers);

}  // namespace scarp

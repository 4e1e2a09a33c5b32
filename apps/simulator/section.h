#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/frame.h"
#include "core/material.h"
#include "levelset/metrology/cross_section.h"

namespace scarp {

/// Where a cross-section is wanted: across an axis from side to side, or along a line.
///
/// Units: nm, lateral positions in the plane.
struct SectionLine {
  CutPlane plane;
  double left = 0;
  double right = 0;
  std::string lateral;  ///< the name of the lateral position: "x", "y", or "s" along a line
  std::string text{};   ///< as it is written; empty in two dimensions, which have but one section
};

/// Reads "y = 0 nm", "x = 1.5 um" or "from -1 um, 0 um to 1 um, 2 um".
///
/// Throws: InputError that says what is wrong and how it is written; it names no place.
SectionLine parse_section(std::string_view text, const Frame& frame);

/// Reads the ends of "from -1 um, 0 um to 1 um, 2 um".
///
/// Units:  nm.
/// Throws: as parse_section.
std::array<std::array<double, 2>, 2> parse_line(std::string_view text);

/// The outline of one layer in a cross-section.
struct LayerProfile {
  MaterialId material = 0;
  std::vector<Polyline> lines;
};

/// The layers along a line, bottom up, each the union of itself and those below.
///
/// Shape: surfaces as layer_surfaces gives them, one per layer.
std::vector<LayerProfile> cut(const Layers& layers, std::span<const TriMesh> surfaces,
                              const SectionLine& line);

/// The exposed surface: the lines of the uppermost layer that is there.
std::vector<Polyline> exposed_lines(std::span<const LayerProfile> profile);

/// A row per point: material, layer, line, lateral position and height.
///
/// Throws: as AtomicFile.
void write_section_csv(const std::filesystem::path& file, std::span<const LayerProfile> layers,
                       const SectionLine& line, const Materials& materials);

}  // namespace scarp

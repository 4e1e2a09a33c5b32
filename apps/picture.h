#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/material.h"
#include "levelset/cross_section.h"

namespace scarp {

/// The outline of one layer in a cross-section.
struct LayerProfile {
  MaterialId material = 0;
  std::vector<Polyline> lines;
};

/// A cross-section of the stack at one moment. Units: nm.
struct ProfileView {
  std::string title;
  std::vector<LayerProfile> layers;  ///< bottom up, each the union of itself and those below
  double left = 0;
  double right = 0;
};

/// Writes the cross-section as an SVG picture: materials filled, a scale in nm or um, a legend.
///
/// Throws: InputError when the file cannot be written.
void write_svg(const std::filesystem::path& file, const ProfileView& view,
               const Materials& materials);

}  // namespace scarp

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "apps/simulator/section.h"
#include "core/material.h"

namespace scarp {

/// A material has the same colour in every picture: red, green, blue.
std::array<std::uint8_t, 3> material_colour(MaterialId material);

/// The exposed surface at an earlier moment. Units: s of process time.
struct EarlierSurface {
  double time = 0;
  std::vector<Polyline> lines;
};

/// A cross-section of the stack at one moment. Units: nm.
struct ProfileView {
  std::string title;
  std::vector<LayerProfile> layers;  ///< bottom up, each the union of itself and those below
  double left = 0;
  double right = 0;
  std::vector<EarlierSurface> earlier{};  ///< drawn as lines over it, in the order of time
};

/// At most 40 of a series of surfaces, evenly spaced in their order, with the first and the last:
/// more contours would hide each other.
std::vector<EarlierSurface> some_of(std::span<const EarlierSurface> surfaces);

/// Writes the cross-section as an SVG picture: materials filled, a scale in nm or um, a legend,
/// and earlier surfaces as nested contours.
///
/// Throws: InputError when the file cannot be written.
void write_svg(const std::filesystem::path& file, const ProfileView& view,
               const Materials& materials);

}  // namespace scarp

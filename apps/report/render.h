#pragma once

#include <optional>

#include "apps/run/png_file.h"
#include "levelset/grid/layers.h"

namespace scarp {

/// Where a wafer is cut open: what lies at lower r[axis] is taken away. Units: nm.
struct RenderCut {
  int axis = 1;
  double position = 0;
};

/// Units: degrees, pixels.
struct RenderOptions {
  std::optional<RenderCut> cut{};
  double azimuth = 30;    ///< of the eye, from -y towards -x
  double elevation = 35;  ///< above the horizon, above 0 and up to 90
  int width = 1200;  ///< of the picture; less where it would be more than twice as high as this
  int sky_rays = 2;  ///< of each of the four samples of a pixel
};

/// The wafer as a block seen from above, in parallel projection: its surface coloured by material
/// and shaded by how much of the sky is seen from there, sides and cut with the materials within.
///
/// What is the same around an axis is revolved. The same to the last bit for any number of threads.
/// The sky is averaged over two by two pixels. Cost: four flights per pixel of surface, and as many
/// times sky_rays; 2 of them look smooth.
/// Throws: InputError of cross-sections (two dimensions), which have no depth.
Image render(const Layers& layers, const RenderOptions& options);

}  // namespace scarp

#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/material.h"
#include "core/tri_mesh.h"
#include "levelset/grid/layers.h"
#include "levelset/metrology/cross_section.h"

namespace scarp {

/// What a place on a face shows. Units: nm.
struct FacePlace {
  std::optional<MaterialId> material{};  ///< nothing in the gas
  double clearance = 0;  ///< to the next border, which is a line of some width; below 0 on it
};

/// An upright plane through a wafer, on a side of the domain or where it is cut open: the contours
/// that scarp section draws there, filled with the materials between them.
class CutFace {
 public:
  /// At r[axis] = position. Shape: surfaces as layer_surfaces gives them. line: half the width of a
  /// border; nm.
  CutFace(const Layers& layers, std::span<const TriMesh> surfaces, int axis, double position,
          double line);

  FacePlace at(double lateral, double z) const;

 private:
  using Point = std::array<double, 2>;
  struct Segment {
    Point from;
    Point to;
  };
  /// The contour of one layer: by columns, the segments that reach within the range of one.
  struct Contour {
    MaterialId material = 0;
    std::vector<std::vector<Segment>> columns;
  };

  std::size_t column_of(double lateral) const;

  double left_;
  double right_;
  double line_;
  double range_;  ///< how far borders are looked for, and how wide a column is
  std::vector<Contour> contours_;
};

}  // namespace scarp

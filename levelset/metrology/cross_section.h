// A public header: installed as scarp/levelset/metrology/cross_section.h.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"
#include "levelset/grid/layers.h"

namespace scarp {

/// A line in a cutting plane: its points as (lateral position, height). Closed if the first point
/// is repeated at the end. With the lateral position to
/// the right and the height upwards the gas lies to its left.
///
/// Units: nm.
struct Polyline {
  std::vector<std::array<double, 2>> points;

  friend bool operator==(const Polyline&, const Polyline&) = default;
};

/// An upright cutting plane. The lateral position in it is the distance from the origin along the
/// direction.
///
/// Units: nm; the direction is a unit vector.
struct CutPlane {
  std::array<double, 2> origin{};
  std::array<double, 2> along{1, 0};

  /// The plane r[axis] = position, axis 0 or 1: its lateral position is the other coordinate.
  static CutPlane across(int axis, double position);

  std::array<double, 2> place(double lateral) const {
    return {origin[0] + lateral * along[0], origin[1] + lateral * along[1]};
  }
};

/// A position moved off the sides of what is cut: a plane on them would have nothing beyond it.
double just_inside(double position, double lower, double upper);

/// Cuts a mesh with upright planes, each of which looks only at the facets near it. The mesh has to
/// stay.
class Slicer {
 public:
  explicit Slicer(const TriMesh& mesh);

  /// Where a plane cuts the mesh. Lines follow the facets, so sharp corners stay.
  std::vector<Polyline> cut(const CutPlane& plane) const;

 private:
  /// Some facets one after the other, seen from above.
  struct Run {
    std::array<float, 2> lower;
    std::array<float, 2> upper;
  };

  static constexpr std::size_t run_length = 32;

  static bool passes(const CutPlane& plane, const Run& run);

  const TriMesh& mesh_;
  std::vector<Run> runs_;
};

/// Where one plane cuts a mesh.
std::vector<Polyline> cross_section(const TriMesh& mesh, const CutPlane& plane);

/// Where the plane r[axis] = position (axis 0 or 1) cuts a mesh; a plane on a domain side is taken
/// just inside.
std::vector<Polyline> cross_section(const TriMesh& mesh, int axis, double position);

/// The lines of a cross-section and what lies beyond the sides of the domain, mirrored or wrapped
/// and joined, as far as the domain is wide: what a side has cut is whole. What lies on the other
/// sides is open.
///
/// Units: lower and upper are the lateral positions of the sides.
std::vector<Polyline> with_surroundings(const std::vector<Polyline>& lines, double lower,
                                        double upper, Boundary boundary);

/// The extracted surfaces of all layers, from the lowest up, to be cut several times; empty for a
/// layer that adds no material.
std::vector<TriMesh> layer_surfaces(const Layers& layers);

/// The part of lines between two lateral positions.
std::vector<Polyline> clipped(std::span<const Polyline> lines, double left, double right);

/// The solid above z = 0 less the gas below, between lines and the sides where they end.
///
/// Units: nm^2.
double area_above_zero(std::span<const Polyline> lines);

/// Volume of each layer's material, from the extracted surfaces; the lowest layer counts from
/// z = 0, so an etched wafer has a negative volume there.
///
/// Units: nm^3.
std::vector<double> material_volumes(const Layers& layers);

/// The same from the extracted surfaces of all layers, the lowest first. A layer without one adds
/// nothing.
std::vector<double> material_volumes(std::span<const TriMesh> surfaces, const Frame& frame);

}  // namespace scarp

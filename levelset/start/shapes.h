#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/frame.h"
#include "core/material.h"
#include "core/tri_mesh.h"
#include "levelset/grid/layers.h"
#include "levelset/start/polygon.h"

namespace scarp {

// Start geometries, applied in order from the bottom up. Lengths in nm, angles in rad. Positive
// tapers narrow an opening downwards and a solid upwards. z = 0 is the surface of the wafer.

/// All solid of a start geometry is made thicker by this many spacings, off the nodes.
inline constexpr double dilation = 1e-3;

/// Solid below z = 0. The first shape, and only the first.
struct WaferShape {
  MaterialId material = 0;
};

/// Fills everything below the highest point, and the given thickness more.
struct LayerShape {
  MaterialId material = 0;
  double thickness = 0;
};

/// Layers from the bottom up, all of them count times.
struct StackShape {
  std::vector<LayerShape> layers;
  int count = 1;
};

/// Copies of a shape on a lattice; its centre is that of the lattice. One along an axis: no copies.
struct Repeat {
  std::array<int, 2> count{1, 1};
  std::array<double, 2> pitch{};
};

/// What a trench or a hole cuts, and from which height its depth and its width are measured.
struct Cut {
  double depth = 0;
  double taper = 0;
  std::optional<MaterialId>
      depth_from{};                   ///< top of this material; else the highest of what is cut
  std::vector<MaterialId> through{};  ///< only these are cut; empty: everything
  double bottom_radius = 0;           ///< of the fillet between wall and floor
  double top_radius = 0;              ///< of the edge around the mouth
};

/// A groove, or parallel grooves, through the whole domain, along y (axis 1) or x (axis 0).
struct TrenchShape {
  double width = 0;
  double centre = 0;
  int along = 1;
  Cut cut{};
  Repeat repeat{};
  bool is_everywhere = false;  ///< no walls in the domain: all of it is cut
};

/// A round hole.
struct HoleShape {
  double radius = 0;
  std::array<double, 2> centre{};
  Cut cut{};
  Repeat repeat{};
};

/// A ridge through the whole domain, along y (axis 1) or x (axis 0); width is that of its foot.
struct FinShape {
  MaterialId material = 0;
  double width = 0;
  double height = 0;
  double centre = 0;
  int along = 1;
  double taper = 0;
  Repeat repeat{};
};

/// Outlines of mask openings and of resist.
struct SlotOutline {
  double width = 0;
  double centre = 0;
  int along = 1;
  Repeat repeat{};
};
struct CircleOutline {
  double radius = 0;
  std::array<double, 2> centre{};
  Repeat repeat{};
};
struct RectangleOutline {
  std::array<double, 2> size{};
  std::array<double, 2> centre{};
  double corner_radius = 0;
  Repeat repeat{};
};
using Outline = std::variant<SlotOutline, CircleOutline, RectangleOutline, PolygonOutline>;

/// A flat mask on top of everything; the outline, at the mask's foot, is cut out or is what stays.
struct MaskShape {
  enum class Outlines { opening, resist };
  MaterialId material = 0;
  double thickness = 0;
  double taper = 0;
  Outlines outlines = Outlines::opening;
  Outline outline{};
  bool is_ridge = false;  ///< part of the structure: no mask that metrology looks below
};

/// What is inside a closed mesh, or below an open patch that covers the domain. Of a material, it
/// is added to what is there; without one, what is inside, or above the patch, is removed.
///
/// The part of a closed mesh beyond a reflective side is left out; beyond a periodic one it comes
/// back on the other side.
struct MeshShape {
  std::shared_ptr<const TriMesh> mesh{};
  std::optional<MaterialId> material{};
};

/// What is inside closed loops of a cross-section, or below a line from side to side. Of a
/// material, it is added to what is there; without one, what is inside, or above the line, is
/// removed. Sides mirror or repeat it.
struct ProfileShape {
  std::vector<Loop> loops{};  ///< of (x, z); inside, an odd number of them surrounds a place
  bool is_line = false;       ///< one loop, which is open
  std::optional<MaterialId> material{};
};

using Shape = std::variant<WaferShape, LayerShape, StackShape, TrenchShape, HoleShape, FinShape,
                           MaskShape, MeshShape, ProfileShape>;

/// What is wrong with one key of one shape; key is as in a recipe ("width", "opening.width").
struct ShapeProblem {
  std::size_t shape = 0;
  std::string key;
  std::string message;
  bool is_opening = false;  ///< walls are too close to each other, or may be (polygons)
};

/// Everything that is wrong with a list of shapes; empty if nothing is.
std::vector<ShapeProblem> check_shapes(const Frame& frame, std::span<const Shape> shapes);

/// What shapes stand on that are applied to layers. Units: nm.
struct Ground {
  std::vector<MaterialId> materials{};
  double lowest = 0;
  double highest = 0;
};

/// The same of shapes that act on what is there (see place_shapes).
std::vector<ShapeProblem> check_shapes_on(const Frame& frame, std::span<const Shape> shapes,
                                          const Ground& ground);

/// Openings, ridges and walls that are narrower than a width, of shapes that are a geometry, by
/// themselves or on what is there. Of a shape that has several, the first.
///
/// Units: nm.
std::vector<ShapeProblem> narrow_features(const Frame& frame, std::span<const Shape> shapes,
                                          double width, const std::optional<Ground>& ground = {});

/// Bodies of meshes that lie wholly in solid and add nothing, or wholly in the open and cut
/// nothing: looked for at places of the surface and inside, a spacing apart or what makes some 50
/// 000 of them.
///
/// Shape: for shapes without a problem.
std::vector<ShapeProblem> idle_bodies(const Frame& frame, std::span<const Shape> shapes);

/// About the area of the walls that a shape adds to the surface, those of meshes not counted: to
/// know what a geometry takes before it is built. Units: nm^2.
double wall_area(const Frame& frame, const Shape& shape);

/// The layers that the shapes describe.
///
/// phi is the exact distance for planes, cones, the walls over polygons and the edges where two of
/// them meet. All solid is dilated, so that surfaces on nodes keep their corners. What meets is one
/// (see sheets.h).
///
/// Throws: InputError with the first problem that check_shapes finds.
Layers build_layers(const Frame& frame, std::span<const Shape> shapes);

}  // namespace scarp

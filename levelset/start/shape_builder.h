#pragma once

#include <array>
#include <functional>
#include <vector>

#include "core/frame.h"
#include "core/material.h"
#include "levelset/grid/distance.h"
#include "levelset/start/polygon_walls.h"
#include "levelset/start/shapes.h"

namespace scarp {

/// Signed distance at any point, negative inside.
using Solid = std::function<Distance(Vec3d)>;

/// How far the distance to a composed solid may be above its bound: that to an edge of 60 degrees.
inline constexpr double most_overestimate = 2;

/// Distance to the common part with its edge rounded: that of the parts shrunk by the radius, grown
/// again.
Distance round_intersect(Distance a, Distance b, double radius);

/// The region under and between the walls of a mask, images beyond the sides included.
Solid outline_solid(const Frame& frame, const Outline& outline, const WallHeights& heights);

/// The lowest and the highest point of a profile.
std::array<double, 2> heights_of(const ProfileShape& shape);

/// Its loops, a line from side to side closed at a height beyond all that is there.
std::vector<Loop> closed_profile(const ProfileShape& shape, double end);

/// The part of them in the domain where its sides repeat a line, the ends of which may differ in
/// height: a wall at the side then. All of them otherwise.
std::vector<Loop> in_period(const Frame& frame, const ProfileShape& shape, std::vector<Loop> loops);

/// The plane of a section as one seen from above: z is its second axis.
Frame profile_frame(const Frame& frame, const std::vector<Loop>& loops);

/// What is inside a profile, images beyond the sides included.
Solid profile_solid(const Frame& frame, const ProfileShape& shape, double end);

/// What shapes are applied to: layers, each of them solid together with those below it.
///
/// Heights in nm.
class ShapeTarget {
 public:
  virtual ~ShapeTarget() = default;

  virtual std::size_t layer_count() const = 0;
  virtual MaterialId material(std::size_t layer) const = 0;
  /// The highest solid, at least 0, and that of a material.
  virtual double highest() const = 0;
  virtual double top_of(MaterialId material) const = 0;
  /// Of all that was added, cut or not, and of all that was cut.
  virtual double upper() const = 0;
  virtual double lower() const = 0;
  /// Something of the surface lies there.
  virtual void reach_down_to(double z) = 0;
  /// Adds solid; it joins the top layer if that is of the same material.
  virtual void grow(MaterialId material, double top, Solid solid) = 0;
  /// Removes what is in gone from the materials first..last: layers below stay, layers above lose
  /// only what is no material of their own. The radius is that of the top layer's edges around the
  /// mouth.
  virtual void cut_run(std::size_t first, std::size_t last, const Solid& gone, double radius) = 0;
};

/// Adds a shape, or cuts it out. enough: what is further from a surface than this is far from it,
/// whatever is cut and rounded after. Units: nm.
void apply_shape(const Frame& frame, double enough, const Shape& shape, ShapeTarget& target);

}  // namespace scarp

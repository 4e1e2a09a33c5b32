#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/tri_mesh.h"
#include "core/vec3.h"

namespace scarp {

/// The point of a mesh that is closest to some place.
struct ClosestPoint {
  static constexpr std::uint32_t none = 0xffffffffU;

  std::uint32_t triangle = none;
  Vec3d point;
  std::array<double, 3> barycentric{};  ///< weights of the triangle's corners, sum 1
  double distance = std::numeric_limits<double>::infinity();
  /// No other triangle, whichever way it faces, is as near or nearer, not even but for rounding or
  /// the room that was asked for: for every direction that the triangle faces along it is the
  /// answer. Only closest_facing tells.
  bool is_alone = false;

  bool found() const { return triangle != none; }
};

/// The point of one triangle that is closest to r; a triangle of zero area is its edges. The
/// member `triangle` is left at none.
ClosestPoint closest_on_triangle(Vec3d r, const std::array<Vec3d, 3>& corners);

/// Answers closest-point queries on a fixed mesh; keeps its own copy of the triangles.
///
/// The same mesh gives the same tree and the same answers, on any machine. Equal distances go to
/// the lowest triangle. Reading from several threads is safe.
///
/// Units: as the mesh; distances in double precision.
/// Cost:  build 0.3 us per triangle, 75 bytes each; a query near the surface about 1 us at 100 k
///        triangles, far away more (every triangle at nearly the same distance is looked at).
class TriangleTree {
 public:
  static constexpr double unlimited = std::numeric_limits<double>::infinity();

  TriangleTree() = default;
  explicit TriangleTree(const TriMesh& mesh);

  bool empty() const { return triangles_.empty(); }

  /// Nothing is found if the mesh is further away than max_distance (or empty).
  ClosestPoint closest(Vec3d r, double max_distance = unlimited) const;

  /// Whether any triangle is no further away than that: cheaper than to find the closest.
  bool is_within(Vec3d r, double max_distance) const;

  /// As closest, but only among triangles whose outward normal has a positive dot product with
  /// direction. Of those that are as near, but for rounding, as on both sides of an edge, it is the
  /// one that faces most along it.
  ClosestPoint closest_facing(Vec3d r, Vec3d direction, double max_distance = unlimited) const;

  /// Triangles that are nearly as near as the closest.
  struct Others {
    double room = 0;                     ///< by how much they may be further away
    double cosine = 2;                   ///< of their normals to that of the closest: less than it
    std::vector<ClosestPoint> points{};  ///< of triangles that face along the direction as well
  };
  /// The same; adds the others, in no order, of the 31 that are nearest.
  ClosestPoint closest_facing(Vec3d r, Vec3d direction, double max_distance, Others& others) const;

  /// The triangles that may be closest to the points of a box, within a distance.
  class Neighbourhood;
  Neighbourhood neighbourhood(const Box& box, double max_distance) const;

  /// The same answers for a point of the box and a distance up to that of the neighbourhood; for
  /// many points close together they cost a third, whatever the size of the mesh.
  ///
  /// guess: a triangle that may well be the closest, or none. The better it is the less is looked
  /// at.
  ClosestPoint closest(Vec3d r, double max_distance, const Neighbourhood& near) const;
  ClosestPoint closest_facing(Vec3d r, Vec3d direction, double max_distance,
                              const Neighbourhood& near, std::uint32_t guess = ClosestPoint::none,
                              Others* others = nullptr) const;

 private:
  struct Node {
    Vec3f lower;
    std::uint32_t
        first;  ///< first triangle of a leaf; first of two neighbouring children otherwise
    Vec3f upper;
    std::uint32_t count;  ///< triangles of a leaf; 0 for an inner node
  };
  struct LeafTriangle {
    std::array<Vec3f, 3> corners;
    std::uint32_t id;
  };
  struct Builder;

  template <class Choice>
  ClosestPoint search(Vec3d r, double max_distance, const Choice& choice,
                      Others* others = nullptr) const;
  template <class Choice>
  ClosestPoint search_near(Vec3d r, double max_distance, const Neighbourhood& near,
                           const Choice& choice, std::uint32_t guess, Others* others) const;

  std::vector<Node> nodes_;
  std::vector<LeafTriangle> triangles_;
  std::vector<std::uint32_t> slots_;  ///< of each triangle in triangles_
};

class TriangleTree::Neighbourhood {
 private:
  friend class TriangleTree;

  Vec3d centre_;
  std::vector<std::uint32_t> slots_;
  /// Boxes of the triangles about the centre: all lower x, then upper x, lower y and so on. Grown
  /// by more than what single precision rounds.
  std::vector<float> boxes_;
};

}  // namespace scarp

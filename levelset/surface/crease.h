#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>

#include "core/vec3.h"
#include "levelset/grid/band.h"

namespace scarp {

// Where phi has a crease the surface has an edge or a corner. A distance is only smooth on one side
// of the surface there: on the other side nodes know the nearer of two faces. So what is read here
// looks away from the crease.

/// Grid faces whose mixed second difference of phi is below this have no corner worth finding: it
/// would be nearer than this, in spacings, to the chord. A right angle mostly has 0.5 and more.
inline constexpr float least_twist = 0.1F;

/// Where phi is zero between a node and the next along an axis, as part of the way.
///
/// Linear between the two nodes; but if phi is straight beyond one of them and markedly steeper
/// than between them, the other one belongs to another face, and the line from beyond is prolonged.
float cut_part(const Band& band, std::array<int, 3> node, int axis);

/// phi around many edges, at the six nodes along each from two before its first to two after its
/// second.
struct EdgeSamples {
  static constexpr int nodes = 6;
  static constexpr int before = 2;
  static constexpr int most = 3 * leaf_size;  ///< edges of a leaf

  alignas(64) float phi[nodes][most];

  /// at is phi of the first node, stride leads to the next.
  void set(int edge, const float* at, std::ptrdiff_t stride) {
    for (int n = 0; n < nodes; ++n) phi[n][edge] = at[(n - before) * stride];
  }
};

/// The same for many edges at once. Shape: parts has one entry per edge.
void cut_parts(const EdgeSamples& edges, int count, float* parts);

/// Unit normal of the surface where it cuts the edge from a node to the next along an axis.
Vec3d cut_normal(const Band& band, std::array<int, 3> node, int axis);

/// The point of a grid face where the tangents at its two cuts meet, if they meet at an angle.
///
/// The face is spanned by the axes (normal + 1) % 3 and (normal + 2) % 3 from its lowest node.
/// Nothing if the face is not cut exactly twice, if the surface is smooth there, or if the point is
/// so near to a cut that it would make a needle. Seen from both cells of the face the answer is
/// the same. Units: spacings from the node along the two axes; strictly inside the face.
std::optional<std::array<float, 2>> face_corner(const Band& band, std::array<int, 3> node,
                                                int normal);

/// Whose phi tells of the cut of the edge from a node along an axis.
using BandOfEdge = std::function<const Band&(std::array<int, 3> node, int axis)>;

/// The same where phi of several bands tells of the cuts: also where the twist is small, which is
/// that of none of them.
std::optional<std::array<float, 2>> face_corner(const Band& band, std::array<int, 3> node,
                                                int normal, const BandOfEdge& band_of_edge);

/// A plane through a point.
struct Tangent {
  Vec3d point;
  Vec3d normal;
};

/// The point that is on all planes as well as can be; where they leave it open, near start.
Vec3d meeting_point(std::span<const Tangent> planes, Vec3d start);

}  // namespace scarp

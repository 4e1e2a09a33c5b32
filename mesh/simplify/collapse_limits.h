#pragma once

#include "core/vec3.h"

namespace scarp::collapse_limits {

// What a collapse may do to the facets around it (collapse.h, pass_star.h).

/// Cosine of the angle that the normal of a facet may turn by in one collapse.
constexpr double lowest_cosine = 0.5;

/// The same for all the moves of vertices together.
constexpr double lowest_cosine_of_move = 0.87;

/// The same for all collapses together, against where it and its neighbours faced in the input:
/// many small turns make a large one. At the edge of a thin blade 45 degrees make a facet that
/// stands across it.
constexpr double lowest_cosine_in_all = 0.77;

/// The same where no facet around faces away: a chamfer along a right-angled edge is turned by 45
/// degrees against either side.
constexpr double lowest_cosine_of_chamfer = 0.7;
constexpr double lowest_cosine_around_chamfer = 0.3;

/// The same for needles, against the mean normal around.
constexpr double lowest_cosine_of_needle = 0.2;

/// The same for what becomes a sliver.
constexpr double lowest_cosine_of_sliver = 0.5;

// Measures of shape: twice the area over the square of the longest edge, .87 for equal sides.

/// A collapse may not leave a facet thinner than this, unless it was thinner before.
constexpr double too_thin = 1e-3;

/// Where thin facets are exact a facet counts as thinner than before below this part: along a
/// drawn edge they are all as thin but for rounding.
constexpr double as_thin = 0.9;

/// The normal of a facet thinner than this may lie anywhere; it has to agree with its neighbours.
constexpr double needle = 0.05;

/// A facet thinner than this may stand up from the surface and still lie within the bound.
constexpr double sliver = 0.2;

/// What float coordinates cannot tell from no area at all.
constexpr double without_area = 1e-5;

/// Cosine between the normals of two neighbours that counts as a fold.
constexpr double fold = -0.3;

/// Whether the normals of two neighbours make a fold that is sharper than the one before.
template <class T>
bool folds(Vec3<T> a, Vec3<T> b, Vec3<T> old_a, Vec3<T> old_b) {
  const T d = dot(a, b);
  if (!(d < 0)) return false;
  const T squares = dot(a, a) * dot(b, b);
  if (d * d < static_cast<T>(fold * fold) * squares) return false;
  const T old_d = dot(old_a, old_b);
  // Both negative, so the greater square is the sharper fold.
  return !(old_d < 0 && old_d * old_d * squares >= d * d * dot(old_a, old_a) * dot(old_b, old_b));
}

/// Whether the cosine between two vectors is at least the lowest one, which is positive.
inline bool agree(Vec3d a, Vec3d b, double lowest) {
  const double d = dot(a, b);
  return d > 0 && d * d >= lowest * lowest * dot(a, a) * dot(b, b);
}

}  // namespace scarp::collapse_limits

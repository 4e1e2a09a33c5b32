#pragma once

#include <array>
#include <cstddef>

#include "core/vec3.h"
#include "flux/sampling/polar_density.h"
#include "flux/sampling/portable_math.h"

namespace scarp {

/// A pair of uniform random numbers in [0, 1).
struct UnitSquare {
  double xi1 = 0;
  double xi2 = 0;
};

/// A unit direction with density cos(theta) / pi about the unit vector n (Lambert's law).
///
/// Continuous in xi, so that well spread pairs give well spread directions.
/// Source: concentric map of the disk, Shirley and Chiu 1997.
Vec3d sample_cosine(UnitSquare xi, Vec3d n);

/// Numbers for some directions, and the directions, each component by itself.
struct CosineSamples {
  static constexpr std::size_t most = 64;
  using Numbers = std::array<double, most>;

  Numbers xi1;
  Numbers xi2;
  std::array<Numbers, 3> n;
  std::array<Numbers, 3> u;
  std::size_t count = 0;

  void add(UnitSquare xi, Vec3d normal) {
    xi1[count] = xi.xi1;
    xi2[count] = xi.xi2;
    for (int axis = 0; axis < 3; ++axis) n[static_cast<std::size_t>(axis)][count] = normal[axis];
    ++count;
  }
  Vec3d direction(std::size_t k) const { return {u[0][k], u[1][k], u[2][k]}; }
};

/// The directions that sample_cosine gives, to the bit, but several at once.
void sample_cosines(CosineSamples& samples);

/// A unit direction with density (power + 1) / (2 pi) cos^power(theta) about -z.
Vec3d sample_source(UnitSquare xi, double power);
/// A unit direction with a tabulated density about -z.
Vec3d sample_source(UnitSquare xi, const PolarDensity& density);
/// The same to the bit, several at once. Normals do not matter.
void sample_sources(CosineSamples& samples, double power);
void sample_sources(CosineSamples& samples, const PolarDensity& density);

/// A unit direction about the vertical, the logarithm of whose slope is nearly uniform: from deep
/// down, openings of all widths are met about as often. Slopes are below 1.
Vec3d sample_skyward(UnitSquare xi);
/// Its density by solid angle.
double skyward_density(Vec3d u);

/// The vector with components x and y across a unit vector and `height` along it. Across steep
/// walls x points down, elsewhere where the axis says. Source: Duff et al. 2017, "Building an
/// orthonormal basis, revisited".
Vec3d about_axis(double x, double y, double height, Vec3d axis);

/// Sine and cosine of the angle 2 pi xi.
SineCosine sample_azimuth(double xi);

/// The direction of a flight in an infinitely long structure, seen along y. Exact for diffuse
/// emission and for cosine sources; (0, 0, 0) if u points along y.
inline Vec3d project_to_cross_section(Vec3d u) { return normalized(Vec3d{u.x, 0, u.z}); }

/// Weights of a triangle's corners at a uniformly distributed point.
/// Source: Heitz 2019, "A low-distortion map between triangle and square".
Vec3d sample_triangle(UnitSquare xi);

}  // namespace scarp

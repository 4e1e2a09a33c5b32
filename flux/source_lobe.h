#pragma once

#include <cstdint>
#include <vector>

#include "core/random.h"
#include "core/vec3.h"
#include "flux/sampling/sampling.h"
#include "flux/source_map.h"

namespace scarp {

/// How particles of a species leave the source plane.
struct SourceLobe {
  enum class Kind {
    cosine,  ///< power cosine about the direction: pdf (n + 1) / (2 pi) cos^n(theta) per particle
             ///< that crosses the plane; what points away from the wafer is drawn again
    beam,    ///< all particles along one direction; solved by shadow rays, without random numbers
    none,    ///< no particles from above: all come from the surface
  };
  Kind kind = Kind::cosine;
  double cosine_power = 1;
  PolarDensity table{};       ///< instead of the power, of the same particles; if it is not empty
  SourceMap map{};            ///< where on the source plane; even if it is empty
  Vec3d direction{0, 0, -1};  ///< axis of the lobe or beam, towards the wafer; unit vector
  bool rotating = false;      ///< the wafer turns: the azimuth of the direction is uniform

  bool is_upright() const { return direction.x == 0 && direction.y == 0; }
  /// All directions from above are equally bright, as those of a gas in equilibrium.
  bool is_lambert() const { return kind == Kind::cosine && table.empty() && cosine_power == 1; }
};

/// The radiance of a source that points straight down: particles through a plane across the
/// direction of sight, per solid angle, if one goes through the source plane. cosine > 0 is that of
/// the angle to the vertical.
double radiance(const SourceLobe& lobe, double cosine);

/// The direction in which a particle leaves a cosine source, by a point of the lobe.
///
/// Random numbers turn the wafer and draw again what a lobe that leans sends away from it.
Vec3d sample_lobe(const SourceLobe& lobe, UnitSquare xi, RandomStream& random);
/// The same in two steps, the first for several at once: about the vertical, then about the axis.
void sample_upright(const SourceLobe& lobe, CosineSamples& samples);
Vec3d about_lobe_axis(const SourceLobe& lobe, Vec3d upright, RandomStream& random);

/// Well spread directions of particles; a power of two of them is best.
std::vector<Vec3d> lobe_directions(const SourceLobe& lobe, std::uint32_t count);

/// The part of the particles of a cosine source whose directions are less than slope above the
/// wafer, sine by sine; to about a part in a thousand of all.
double part_below(const SourceLobe& lobe, double slope);

/// The unit vector of a beam. Angles that are multiples of 90 degrees give exact zeros and ones,
/// and opposite azimuths give exactly mirrored vectors. Units: rad.
Vec3d beam_direction(double tilt, double azimuth);

}  // namespace scarp

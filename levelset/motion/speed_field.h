#pragma once

#include <cstdint>
#include <vector>

#include "core/angular_factor.h"
#include "core/material.h"
#include "core/vec3.h"
#include "levelset/grid/layers.h"

namespace scarp {

/// A part of a speed that depends on the normal: at a node amplitude times factor(n), with the
/// normal that the scheme finds there.
///
/// Shape: 512 amplitudes per leaf of the band. Units: nm/s.
struct AngularSpeed {
  AngularFactor factor;
  std::vector<float> amplitude;
};

/// Speeds along the outward normal at the nodes of the top layer's band, > 0 grows.
///
/// Valid until the layers change. Shape: 512 values per leaf of the band. Units: nm/s.
struct SpeedField {
  std::vector<float> speed;
  std::vector<AngularSpeed> angular{};  ///< parts that depend on the normal, beside speed
  /// One per layer; nothing is ever taken away from a layer that does not move. May be empty.
  std::vector<bool> is_inert{};
  /// One per layer: no place of it recedes faster than that, >= 0. May be empty. Rounded up by a
  /// thousandth at most, so that it does not depend on which places were asked. Units: nm/s.
  std::vector<float> fastest_etch{};
  /// Some layers do not move, and speeds that depend on the normal let the others grow: where
  /// amplitudes are zero phi is the distance to what does not move, and tells nothing of the
  /// surface that grows.
  bool grows_beside_inert = false;
  /// Gas of closed voids: one bit per node, 8 words per leaf; empty if there are none.
  std::vector<std::uint64_t> closed{};
  /// The part of the nodes next to the surface that see another material than the facet does whose
  /// speed they take: what has become exposed since the facets were made.
  double newly_seen = 0;
};

/// At a node, of a surface with this normal. Units: nm/s.
float speed_along(const SpeedField& field, std::size_t node, const Vec3f& normal);

/// How fast something recedes, rounded up.
float fastest_etch(float speed);

/// Whether a crystal is etched somewhere.
bool etches_crystal(const SpeedField& field);

}  // namespace scarp

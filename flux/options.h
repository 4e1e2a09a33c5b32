#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/frame.h"

namespace scarp {

/// The most rays of a species: fixed-point sums hold as many.
inline constexpr std::uint64_t most_rays = std::uint64_t{1} << 32;

/// Units: lengths as in the mesh.
struct FluxOptions {
  enum class Engine {
    automatic,  ///< gather, or forward where it takes fewer flights to the target: in features that
                ///< are deep for how much sticks, and for lobes that reach down to the wafer
    forward,    ///< particles from the source, one by one
    gather,     ///< rays from the facets, and for what is re-emitted an exchange between them
  };
  /// What comes straight from the source is gathered for ions and tilted sources as well; there is
  /// no exchange for what goes on, which is followed by particles that start where it arrived.
  /// Beams are found by shadow rays whatever it says.
  Engine engine = Engine::automatic;
  Sides sides{};                 ///< where rays are mirrored or wrapped
  bool two_dimensional = false;  ///< rays travel in the x-z plane
  /// The mesh is the section of a surface of revolution about the z axis, from the axis at x = 0 to
  /// the upper end of the sides, the same all along y; what arrives is that of the whole surface
  /// (see Revolution).
  bool axisymmetric = false;
  /// Per facet: its ring, if the mesh is a surface of revolution about the z axis. Arrivals are
  /// those of whole rings.
  std::vector<std::uint32_t> rings{};
  double spacing = 0;          ///< of the grid; 0: as guessed_spacing()
  double target_error = 0.01;  ///< root mean square over the exposed surface, by area, of the
                               ///< error on patches of 4 x 4 spacings / max(flux, 0.05)
  /// What follows from each tally, if there are any: the target is then the root mean square over
  /// the exposed surface, by area, of the error on patches of the sum of a species' tallies, each
  /// times its response, in the unit of these. Beams have no target.
  ///
  /// Shape: [species][tally][facet].
  std::vector<std::vector<std::vector<float>>> responses{};
  /// Fixes the number of rays and switches the target off, when > 0.
  ///
  /// Forward: particles of each species, rounded up to whole batches of 32. Gather: rays from all
  /// facets together, which serve all species, shared out by area; at most as many, but never fewer
  /// than about 4096, which tell their error, and 4 or 8 from each element (see Elements; twice of
  /// that with particles that go on), even if that makes more. Elements are then two spacings wide.
  /// Rays along the lobe of a source with cosine power != 1 are not counted. Ions and tilted
  /// sources: half of it for rays from facets, those behind the facet included, half for particles
  /// that go on; all for rays if nothing does.
  std::uint64_t rays = 0;
  /// The most rays for the target, counted as rays and with the same least numbers.
  std::uint64_t max_rays = std::uint64_t{1} << 28;
  std::uint64_t memory_limit = std::uint64_t{1} << 30;  ///< in bytes, for the hits of gathered rays
  std::uint64_t seed = 1;
  std::uint32_t time_step = 0;  ///< part of the random number's key

  // What depends on the kind of domain.

  /// Along how many of the lateral axes rays travel: x alone in sections.
  int lateral_axes() const { return two_dimensional ? 1 : 2; }
  bool is_section() const { return lateral_axes() == 1; }
  /// Whether facets may be joined to elements. Those of sections are strips as long as the domain,
  /// few as they are, and rings are elements already.
  bool joins_facets() const { return !is_section() && rings.empty(); }
  /// Of a section through an axis: those of a part of the wafer around it in space, whose facets
  /// lie on rings.
  FluxOptions revolved(const Sides& part, std::vector<std::uint32_t> ring_of_facet) const {
    FluxOptions options = *this;
    options.axisymmetric = false;
    options.two_dimensional = false;
    options.sides = part;
    options.rings = std::move(ring_of_facet);
    return options;
  }
};

}  // namespace scarp

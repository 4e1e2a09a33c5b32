#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"
#include "flux/solve.h"

namespace scarp {

/// A surface of revolution about the z axis, from the cross-section of it: a quarter, between
/// mirrors at x = 0 and y = 0. It ends at a square with the outermost ring inside; what lies
/// between goes on level, so the wafer is an array of what is revolved.
///
/// Units: those of the section.
class Revolution {
 public:
  /// section: a strip as two dimensions have it, which does not change along y, from the axis at
  /// x = 0 on to the sides' upper end.
  /// Throws: InputError for a mesh that changes along y or reaches beyond the axis.
  Revolution(const TriMesh& section, const Sides& sides);

  const TriMesh& mesh() const { return mesh_; }
  Sides sides() const;
  /// Per facet: the number of its ring. Rings are flat cones, cut into 24 facets or pairs of
  /// them; where the two facets of a strip are of two materials, each has a ring of its own.
  const std::vector<std::uint32_t>& rings() const { return rings_; }

  /// From one value per facet of the section to one per facet of the quarter.
  std::vector<float> revolved(std::span<const float> of_section) const;
  /// Back, from the first facet of each ring; on the axis from that of a ring beside it.
  std::vector<float> on_section(std::span<const float> of_rings) const;

 private:
  class Builder;

  double radius_ = 0;
  TriMesh mesh_;
  std::vector<std::uint32_t> rings_;
  std::vector<std::uint32_t> section_facets_;  // per facet: one that is revolved to it
  std::vector<std::uint32_t> first_facets_;    // per facet of the section: of its ring
};

/// solve_flux of what a section is revolved to, with everything on facets of the section. Patches
/// are made of whole rings.
///
/// Throws: InputError for sources that are not the same all around.
std::vector<FluxField> solve_revolved(const TriMesh& section, std::span<const Species> species,
                                      const FluxOptions& options, const StickingFeedback& feedback,
                                      const SurfaceEmission& emission, KeptHits* hits);

}  // namespace scarp

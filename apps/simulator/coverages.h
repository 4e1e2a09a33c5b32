#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/tri_mesh.h"
#include "flux/solve.h"
#include "models/model_parts.h"

namespace scarp {

/// When coverages and fluxes fit each other.
struct CoverageOptions {
  double tolerance = 1e-4;    ///< the most that a coverage may still change, on any facet; in a
                              ///< cycle, the most that a step may err
  int most_iterations = 200;  ///< for one number of rays
};

/// Of fluxes that coverages follow from, relative.
double flux_tolerance(const CoverageOptions& options);

/// What covers the facets of a mesh.
///
/// Shape: values[c][f] is coverage names[c] of facet f.
struct SurfaceCoverages {
  std::vector<std::string> names{};
  std::vector<std::vector<float>> values{};
};

/// Coverages on the facets of another mesh of the surface, which may have moved in between.
///
/// Each facet takes the mean over its area of what lies closest. On the part of the old surface
/// that is still there, which has a new one within the reach, the mean over the area is then kept
/// to rounding: what the finer or coarser facets gave or took is shared out over all of them, in
/// proportion to what covers them where it is too much, to what is bare where it is too little. So
/// values stay within [0, 1] like their sum, and a coverage that is the same everywhere stays so.
/// What the surface has lost takes its coverage with it; what is new is bare.
///
/// Areas are those of the surface, with what goes around the axis of an axisymmetric frame.
///
/// Shape: as SurfaceCoverages::values. Units: the reach as the meshes, nm.
/// Cost:  about 4 microseconds per facet of each mesh.
std::vector<std::vector<float>> carried(std::span<const std::vector<float>> coverages,
                                        const TriMesh& from, const TriMesh& to, double reach,
                                        const Frame& frame);

/// The area that each coverage takes up of facets with these areas. Units: nm^2.
std::vector<double> covered_areas(std::span<const double> areas,
                                  std::span<const std::vector<float>> coverages);

/// How an iteration of coverages and fluxes ended.
struct CoverageFit {
  int iterations = 0;       ///< how often the flux was solved, for all numbers of rays together
  double change = 0;        ///< the largest that the last one brought to a coverage of a facet, or
                            ///< the largest error of a coverage in a step of a cycle ...
  std::uint32_t facet = 0;  ///< ... and where
  bool reached = true;      ///< it is within the tolerance
};

/// The largest difference of a coverage on a facet, and where.
struct CoverageChange {
  double size = 0;
  std::uint32_t facet = 0;
};
CoverageChange largest_change(std::span<const std::vector<float>> before,
                              std::span<const std::vector<float>> after);

/// Which species stick as what covers the surface lets them.
std::vector<bool> species_by_coverage(const Coverages& model, const SurfacePoints& points);

/// Sets the sticking of these species.
void set_covered_sticking(const Coverages& model, const SurfacePoints& points,
                          std::span<const std::vector<float>> coverages,
                          std::vector<std::vector<float>>& sticking);

/// Coverages and fluxes that fit each other, by turns.
///
/// Where particles cover the surface fewer of them stick, so more arrive elsewhere and cover it in
/// their turn. A relative change of all fluxes changes the sticking by less, and no relative change
/// of the sticking changes a flux by more: each turn is a contraction in the logarithm, so there is
/// one solution, and turns lead there from any start. From above, where all that arrives on an open
/// wafer arrives everywhere, they take the fewest turns; from coverages of the time step before,
/// fewer.
class CoverageIteration {
 public:
  /// The model and the mesh have to outlive it.
  ///
  /// Shape: the start as SurfaceCoverages::values on these facets, or empty.
  CoverageIteration(const BalancedCoverages& model, const TriMesh& facets,
                    std::vector<std::vector<float>> start, const CoverageOptions& options);

  /// For solve_flux; refers to this object.
  StickingFeedback feedback();

  /// Shape: as SurfaceCoverages::values.
  const std::vector<std::vector<float>>& coverages() const { return coverages_; }
  const CoverageFit& fit() const { return fit_; }

 private:
  bool update(std::span<const std::span<const float>> flux,
              std::vector<std::vector<float>>& sticking);
  std::vector<std::vector<float>> sticking_at(std::span<const std::span<const float>> flux) const;
  SurfacePoints points() const { return {.material = facets_.materials, .normal = normals_}; }

  const BalancedCoverages& model_;
  const TriMesh& facets_;
  CoverageOptions options_;
  std::vector<Vec3f> normals_;
  std::vector<std::vector<float>> coverages_;
  CoverageFit fit_;
  int iterations_of_round_ = 0;
  bool has_begun_ = false;
};

}  // namespace scarp

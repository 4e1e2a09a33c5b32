#pragma once

#include <memory>
#include <span>
#include <string>

#include "flux/rays/nearest_facet.h"
#include "flux/rays/ray.h"

namespace scarp {

/// Embree's tree of facets, which proposes what a straight flight may meet; NearestFacet decides.
///
/// The tree holds packs of up to four neighbours, each in a box that is wider than the facets by a
/// padding, and Embree's robust traversal passes every box that its ray goes through (Ize 2013).
/// What NearestFacet takes is met within half the padding of the facet's box. Embree's ray is the
/// same but for rounding to single precision: away from it by less than a unit of the domain's size
/// in its place and by one in its direction. That leaves nine of the ten units of half the padding
/// for other rounding. So the pack of every facet that the exact test would take is looked at
/// before the search ends, and a look leaves no such facet out (see FacetPack): also slivers,
/// ridges and surfaces seen edge on, for which Embree's own triangles have no such bound. The
/// choice is exact however close two facets are. Embree's instruction set, its threads, the shape
/// of its tree and of packs decide only which facets are tested in vain.
///
/// Source: Ize 2013, "Robust BVH ray traversal".
/// Cost: .4 us per facet to build, 75 bytes of memory.
class EmbreeTree {
 public:
  /// facets: stay where they are as long as the tree is used.
  /// domain_size: its width, length and height added up, in the unit of the facets.
  /// configuration: see embree_configuration().
  /// Throws: NumericalError with Embree's text where it fails.
  EmbreeTree(std::span<const SceneFacet> facets, double domain_size,
             const std::string& configuration);
  ~EmbreeTree();
  EmbreeTree(EmbreeTree&&) noexcept;
  EmbreeTree& operator=(EmbreeTree&&) noexcept;

  /// What a flight meets first on each side, up to t_end. Thread-safe.
  NearestFacet nearest(const Ray& ray, double t_end) const;

 private:
  struct Embree;
  std::unique_ptr<Embree> embree_;
  float padding_ = 0;
};

/// What the environment variable SCARP_EMBREE holds for rtcNewDevice, such as "isa=sse2"; empty
/// where it is not set, which stands for at most AVX2. No result depends on it.
/// Throws: InputError for keys and values that Embree would pass over in silence, for an
/// instruction set that the processor lacks, and for threads, which would bind the whole process.
std::string embree_configuration();

/// Such as 3.13.5.
std::string embree_version();

}  // namespace scarp

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/frame.h"
#include "mesh/simplify/collapse_mesh.h"

namespace scarp {

/// The sizes of the published method, per vertex: an edge is collapsed if it is shorter than the
/// size at either end.
///
/// Region 0 holds the features, where the surface bends; its size is l0. Step i collapses, in all
/// that lies outside the regions so far, what is shorter than l_i = l0 + i step_length; then the
/// ring of vertices that is next to the regions becomes region i and keeps that size. So the mesh
/// grows coarser with every ring around the features, and rings are those of the current mesh. An
/// edge between two regions belongs to the finer one, and so does a merged vertex.
///
/// Deviations: the printed curvature has a minus between the cotangents, here it is the plus of
/// Meyer et al.; within a step the cost decides, not the length, which is as accurate or better.
class Regions {
 public:
  struct Sizes {
    double l0 = 0;
    double step_length = 0;
    double l_max = 0;  ///< 0: no limit
  };

  /// is_feature and size_limit have an entry per vertex of the mesh; size_limit may be empty.
  Regions(const std::vector<bool>& is_feature, std::vector<float> size_limit, Sizes sizes);

  /// Per vertex.
  std::vector<float> sizes() const;

  /// Vertices have become one. merged_into: per vertex the one that it went into last, or itself.
  void merge(std::span<const std::uint32_t> merged_into);

  /// Goes on to the next size outside the regions. False if it is no greater.
  bool coarsen();

  /// Makes the ring around the regions a region that keeps the present size. False if there is no
  /// ring any more.
  bool enclose_ring(const CollapseMesh& mesh);

  /// What no ring reaches is flat: from now on it may become as coarse as l_max, or as coarse as
  /// the mesh allows.
  void release_rest();

  /// Raises every size that is smaller to l0.
  void raise(double l0);

 private:
  static constexpr std::uint16_t outside = 0xffff;

  Sizes sizes_;
  std::vector<std::uint16_t> region_;  ///< per vertex
  std::vector<double> size_;           ///< per region, rising; the last one holds outside as well
  std::vector<float> size_limit_;      ///< per vertex, or empty
};

/// The vertices where |curvature| is above the threshold, at most `most` of them: where there are
/// more, those that bend most.
std::vector<bool> find_features(std::span<const double> curvature, double threshold,
                                std::size_t most);

/// Mean length of the edges between features; of all edges if there are none.
double mean_feature_edge(const CollapseMesh& mesh, const std::vector<bool>& is_feature);

}  // namespace scarp

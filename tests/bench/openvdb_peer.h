#pragma once

// OpenVDB's own tools on the band of a level set, for comparison.

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetMorph.h>
#include <openvdb/tools/LevelSetTracker.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <vector>

#include "levelset/grid/band.h"
#include "levelset/grid/scheme.h"

namespace scarp::bench {

using PhiGrid = openvdb::FloatGrid;

/// The same leaves, masks and phi.
inline PhiGrid::Ptr grid_of(const Band& band) {
  openvdb::initialize();
  PhiGrid::Ptr grid = PhiGrid::create(LevelSet::half_width);
  for (const Leaf& leaf : band.leaves()) {
    const auto [i, j, k] = leaf.origin;
    auto* copy = grid->tree().touchLeaf({i, j, k});
    std::copy(leaf.phi + 0, leaf.phi + leaf_size, copy->buffer().data());
    PhiGrid::TreeType::LeafNodeType::NodeMaskType mask;
    for (int n = 0; n < leaf_edge; ++n) mask.getWord<std::uint64_t>(n) = leaf.active[n];
    copy->setValueMask(mask);
  }
  return grid;
}

/// A copy of the same leaves, masks and phi, as OpenVDB's tools want it; the surface must be
/// closed.
class OpenVdbPeer {
 public:
  explicit OpenVdbPeer(const LevelSet& phi) : grid_(grid_of(phi.band())) {
    // Missing leaves in the solid have no value of their own in the tree.
    openvdb::tools::signedFloodFill(grid_->tree());
    grid_->setGridClass(openvdb::GRID_LEVEL_SET);
    target_ = grid_->deepCopy();
    // The speed of LevelSetMorphing is phi of the source less that of the target: with a target
    // this far off nearly the same everywhere.
    for (auto value = target_->tree().beginValueAll(); value; ++value) {
      value.setValue(value.getValue() - far_off);
    }
    target_->tree().root().setBackground(LevelSet::half_width - far_off, false);
  }

  std::size_t active_count() const { return grid_->activeVoxelCount(); }
  float node(int i, int j, int k) const { return grid_->tree().getValue({i, j, k}); }

  /// Moves the surface outwards by `step` spacings, `steps` times. LevelSetMorphing has no
  /// differences of order 2: with eno2 it takes first order in space and two stages. Its
  /// re-distancing is of first, second and fifth order, with as many iterations as ours.
  /// Shape: the number of active nodes before every step.
  std::vector<std::size_t> grow(Scheme scheme, int steps, double step) {
    openvdb::tools::LevelSetMorphing<PhiGrid> morphing(*grid_, *target_);
    const bool fifth = scheme == Scheme::weno5;
    morphing.setSpatialScheme(fifth ? openvdb::math::HJWENO5_BIAS : openvdb::math::FIRST_BIAS);
    morphing.setTemporalScheme(fifth                    ? openvdb::math::TVD_RK3
                               : scheme == Scheme::eno2 ? openvdb::math::TVD_RK2
                                                        : openvdb::math::TVD_RK1);
    morphing.setTrackerSpatialScheme(fifth                    ? openvdb::math::HJWENO5_BIAS
                                     : scheme == Scheme::eno2 ? openvdb::math::SECOND_BIAS
                                                              : openvdb::math::FIRST_BIAS);
    morphing.setTrackerTemporalScheme(openvdb::math::TVD_RK1);
    morphing.setNormCount(iterations);
    std::vector<std::size_t> counts;
    for (int n = 0; n < steps; ++n) {
      counts.push_back(active_count());
      morphing.advect(0, static_cast<float>(step / far_off));
    }
    return counts;
  }

  /// The tracker alone, as it is unless told otherwise, on a surface that does not move.
  void track() { openvdb::tools::LevelSetTracker<PhiGrid>(*grid_).track(); }

  /// The number of vertices of the dual mesh.
  std::size_t mesh() const {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(*grid_, points, quads);
    return points.size();
  }

 private:
  static constexpr float far_off = 100;
  static constexpr int iterations = 2;

  PhiGrid::Ptr grid_;
  PhiGrid::Ptr target_;
};

}  // namespace scarp::bench

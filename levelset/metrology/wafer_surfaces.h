#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/material.h"
#include "core/tri_mesh.h"
#include "levelset/grid/layers.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/metrology/metrology.h"
#include "levelset/metrology/view_from_above.h"

namespace scarp {

/// The surfaces of all layers, and which of them are the structure's and the mask's.
class WaferSurfaces {
 public:
  WaferSurfaces(const Layers& layers, std::span<const MaterialId> masks);

  const Frame& frame() const { return layers_.frame; }

  /// Layers that are there are counted from below.
  std::size_t count() const { return present_.size(); }
  MaterialId material(std::size_t k) const { return layers_.stack[present_[k]].material; }
  const TriMesh& mesh(std::size_t k) const { return meshes_[k]; }
  const LevelSet& phi(std::size_t k) const { return layers_.stack[present_[k]].phi; }
  const Slicer& slicer(std::size_t k) const { return slicers_[k]; }
  const ViewFromAbove& view(std::size_t k) const { return views_[k]; }

  std::size_t exposed() const { return present_.size() - 1; }
  std::size_t structure() const { return structure_; }
  std::optional<std::size_t> top_mask() const { return top_mask_; }

  std::vector<MaterialVolume> volumes() const;

 private:
  /// Where a layer is not there, its surface is that of the one below.
  double upper_area(std::size_t n) const;

  const Layers& layers_;
  std::vector<TriMesh> meshes_;
  std::vector<ViewFromAbove> views_;
  std::vector<Slicer> slicers_;
  std::vector<std::size_t> present_;  ///< in the stack
  std::size_t structure_ = 0;
  std::optional<std::size_t> top_mask_;
};

}  // namespace scarp

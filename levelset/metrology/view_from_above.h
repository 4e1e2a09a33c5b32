// A public header: installed as scarp/levelset/metrology/view_from_above.h.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/tri_mesh.h"

namespace scarp {

/// What is seen of a surface at a place from above.
///
/// Units: nm.
struct SeenPoint {
  double height = 0;
  MaterialId material = 0;  ///< 0 of a surface without materials
};

/// Looks straight down on a surface: how high it is at a place, whatever hangs below.
///
/// Facets belong to it with their borders; where several meet, the one that comes first counts.
/// Upright facets are not seen. Refers to the mesh.
///
/// Units: places x and y in nm; those beyond the box around the mesh are taken on its border, as
///        sides of the domain are rounded in the mesh.
/// Cost:  linear in the facets to make, a few facets per place.
class ViewFromAbove {
 public:
  using Place = std::array<double, 2>;

  explicit ViewFromAbove(const TriMesh& surface);

  /// Nothing where there is no surface.
  std::optional<SeenPoint> at(const Place& place) const;

 private:
  std::size_t cell(int axis, double position) const;

  const TriMesh& surface_;
  Box box_;
  std::array<std::size_t, 2> cells_{1, 1};
  std::vector<std::uint32_t> first_;   ///< of each cell in facets_, and one more
  std::vector<std::uint32_t> facets_;  ///< of each cell in ascending order
};

}  // namespace scarp

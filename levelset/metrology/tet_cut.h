#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/vec3.h"

namespace scarp {

/// Vertices of tetrahedra that nested surfaces cut, with the value of every surface at each:
/// negative inside, none grows from a surface to the next.
///
/// Units: values in spacings.
class CutVertices {
 public:
  /// @param least values of less count as zero where a vertex lies on another surface
  CutVertices(int surface_count, double least);

  std::uint32_t add(const Vec3d& r, std::uint8_t sides, const double* values);

  /// Where a surface meets the edge between two vertices of opposite signs: one vertex whoever
  /// asks. Of the sides of the domain it lies on those that both ends do.
  std::uint32_t between(std::uint32_t a, std::uint32_t b, int surface);

  /// An order of places that shifts along x and y leave as it is: on opposite periodic sides
  /// everything is cut alike.
  bool is_before(std::uint32_t a, std::uint32_t b) const;

  int surface_count() const { return surface_count_; }
  std::size_t size() const { return positions_.size(); }
  const Vec3d& position(std::uint32_t v) const { return positions_[v]; }
  std::uint8_t sides(std::uint32_t v) const { return sides_[v]; }
  double value(std::uint32_t v, int surface) const { return values(v)[surface]; }
  const double* values(std::uint32_t v) const {
    return values_.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(surface_count_);
  }

 private:
  int surface_count_;
  double least_;
  std::vector<Vec3d> positions_;
  std::vector<std::uint8_t> sides_;
  std::vector<double> values_;
  std::vector<std::unordered_map<std::uint64_t, std::uint32_t>>
      cuts_;  ///< of each surface, by ends
};

/// Values at part t between two places, of which the surface is one that has its zero there. What
/// has the same values at both has it there, too; what is nearer than least is moved onto it.
void values_between(const double* a, const double* b, double t, int surface, int count,
                    double least, double* values);

/// A tetrahedron of positive volume, and the lowest surface that it lies inside of, or their
/// number.
struct CutTet {
  std::array<std::uint32_t, 4> v{};
  int label = 0;
};

/// Cuts a tetrahedron by all surfaces, from the first on. Two that share a face cut it alike.
void cut_tet(const std::array<std::uint32_t, 4>& tet, CutVertices& vertices,
             std::vector<CutTet>& pieces);

}  // namespace scarp

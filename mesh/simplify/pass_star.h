#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/system/huge_pages.h"
#include "mesh/lanes.h"
#include "mesh/simplify/collapse_mesh.h"
#include "mesh/simplify/star.h"

namespace scarp {

/// What passes know of a vertex or a facet, in one access to memory.
struct alignas(16) FloatRecord {
  float x = 0;
  float y = 0;
  float z = 0;
  float w = 0;
};

/// The first three numbers of a record; the fourth lane is 0.
inline FloatLanes vector_lanes(const FloatRecord& record) {
  constexpr FloatMask first_three{-1, -1, -1, 0};
  return reinterpret_cast<FloatLanes>(reinterpret_cast<FloatMask>(load(&record.x)) & first_three);
}

/// A copy of what is asked most of a mesh, in single precision.
///
/// Places are relative to the centre of the mesh; their rounding is 6e-8 of its size. They decide
/// about shapes and ranks; what is proven is proven in double precision.
///
/// Units: the power of two next to the mean length of an edge, so that powers of lengths are none
///        that single precision does not have. Only the exponents of numbers depend on it.
struct FloatMesh {
  double scale;                      ///< of lengths, against the unit of the mesh
  LargeVector<FloatRecord> r;        ///< per vertex: place
  LargeVector<FloatRecord> normals;  ///< per facet: twice the area vector; w: number of ErrorBound

  explicit FloatMesh(const CollapseMesh& mesh);

  float length(double a) const { return static_cast<float>(scale * a); }
  FloatRecord place(Vec3d a) const { return record(scale * a, 0); }
  /// n: twice an area vector; error: a length.
  FloatRecord normal(Vec3d n, double error = 0) const {
    return record(scale * scale * n, scale * error);
  }

 private:
  static FloatRecord record(Vec3d a, double w) {
    return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z),
            static_cast<float>(w)};
  }
};

/// The closed star of an edge whose ends are free, with its merged vertex, for the checks that
/// refuse most: as those of CollapseChecks, four facets at a time.
class PassStar {
 public:
  static constexpr int capacity = 28;  ///< facets

  /// False if there are more facets than the capacity, or the collapse would change the topology.
  bool gather(const HalfEdges& topology, std::uint32_t h);

  /// To be called after gather() and before all others.
  void place_at(const FloatMesh& floats, FloatRecord r);

  /// Whether no edge gets longer than the limit, or than one that it replaces.
  bool keeps_length(float limit) const;
  /// The same with a limit of its own for each vertex of the ring.
  bool keeps_lengths(std::span<const float> limits) const;

  /// Whether no facet turns too much or gets too thin: CollapseChecks::keeps_facets.
  bool keeps_facets(const CollapseMesh& mesh) const;
  /// CollapseChecks::makes_no_fold.
  bool makes_no_fold(const CollapseMesh& mesh, const FloatMesh& floats) const;

  /// By how much the sum of the shapes (facet_shape.h) grows, times the mean of twice the new areas
  /// over all the facets.
  float shape_growth(const FloatMesh& floats) const;

  /// Squared heights of the two ends over the new surface, together; 0 where it is no height field.
  float squared_heights_of_ends(const FloatMesh& floats) const;

  /// Whether ErrorBound will refuse, as good as surely: by its number where the merged vertex and
  /// the two ends lie, which is the greatest in four of five cases. What it does not refuse is not
  /// proven.
  bool exceeds(const FloatMesh& floats, float limit) const;

  const Star& star() const { return star_; }

 private:
  static constexpr int padded = capacity + 2 * float_lanes;
  using Row = std::array<float, padded>;

  /// A vector per facet or per vertex of the ring, in one array per coordinate.
  struct Rows {
    Row x;
    Row y;
    Row z;

    void put(int i, float a, float b, float c) {
      x[i] = a;
      y[i] = b;
      z[i] = c;
    }
  };
  struct Lanes3 {
    FloatLanes x;
    FloatLanes y;
    FloatLanes z;
  };
  static Lanes3 load_rows(const Rows& rows, int i) {
    return {load(&rows.x[i]), load(&rows.y[i]), load(&rows.z[i])};
  }

  class Heights;

  bool is_chamfer(const CollapseMesh& mesh, int i) const;

  Star star_;
  int at_origin_ = 0;  ///< so many facets are at u, the others at v
  FloatRecord u_{};    ///< from the merged vertex
  FloatRecord v_{};
  Rows ring_;         ///< from the merged vertex; the first one is repeated at the end
  Rows normals_;      ///< after the collapse
  Rows old_normals_;  ///< before it
  Row error_;
};

}  // namespace scarp

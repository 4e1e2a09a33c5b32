#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/vec3.h"
#include "levelset/grid/distance.h"
#include "levelset/start/polygon.h"

namespace scarp {

/// Where the walls over a polygon stand. Units: nm, rad.
struct WallHeights {
  double foot = 0;    ///< the loops are the outline at this height
  double top = 0;     ///< walls end here; at least foot
  double lowest = 0;  ///< below the foot they go straight down to here
  double slope = 0;   ///< between foot and top the region widens upwards by this angle
};

/// The outline at a distance from loops with the interior on the left: every edge moves outwards by
/// it, corners stay sharp.
std::vector<Loop> moved_outwards(const std::vector<Loop>& loops, double distance);

/// The walls that stand on the edges of a polygon with holes: signed distance, negative inside.
///
/// Exact to the walls between their lowest and upper end, corners and all, up to 12 spacings;
/// further away the value is +-12 spacings. Above and below the walls the sign is that of the
/// nearest edge of their rim, so that the common part with a slab ends in exact edges.
///
/// Shape:  loops as domain_loops makes them, images beyond the sides included.
/// Cost:   a look at the few walls that are nearest; building takes O(n log n) and, of upright
///         walls, a look for every four columns of nodes.
/// Source: sign by the mean normal of the nearest feature, Baerentzen and Aanaes 2005; here between
///         panels of equal weight, which have the same sign.
class PolygonWalls {
 public:
  PolygonWalls(const Frame& frame, const std::vector<Loop>& loops, const WallHeights& heights);

  Distance operator()(Vec3d r) const;

 private:
  /// A flat quadrangle, bottom left, bottom right, top right, top left seen from outside, with the
  /// directions that are outside next to it, to its sides and to its corners.
  struct Panel {
    std::array<Vec3d, 4> corners{};
    Vec3d normal{};
    std::array<Vec3d, 4> side_normals{};
    std::array<Vec3d, 4> corner_normals{};
    Vec3d lower{};
    Vec3d upper{};
  };
  struct Nearest {
    double square = 0;
    std::uint32_t panel = 0xffffffffU;  ///< of two at one distance, the lower one
    Vec3d point{};
    Vec3d outside{};
    bool on_face = false;
  };
  /// Of a tree of boxes: a leaf has panels one after the other in order_, an inner node two
  /// children one after the other in nodes_.
  struct Node {
    Vec3d lower{};
    Vec3d upper{};
    std::uint32_t first = 0;
    std::uint32_t count = 0;  ///< 0: inner
  };

  /// Squares of the plane, each with the panels that may be nearest to a point over or under it.
  /// Of upright walls only: nearest in the plane is nearest at any height there.
  struct Buckets {
    double width = 0;
    std::array<double, 2> origin{};
    std::array<std::size_t, 2> count{};
    std::vector<std::uint32_t> first{};  ///< in panels, of each square and after the last; or empty
    std::vector<std::uint32_t> panels{};

    std::optional<std::size_t> find(Vec3d r) const;
  };

  void add_walls(const Loop& loop, const WallHeights& heights);
  void find_boxes();
  void build_tree();
  void split(std::uint32_t node);
  void fill_buckets(const Frame& frame);
  template <class Visit>
  void visit_near(Vec3d r, const double& square, const Visit& visit) const;
  Nearest nearest(Vec3d r, double limit) const;
  void mark_insides(const std::vector<Loop>& loops);
  void find_overhead();
  double centre(int axis, std::size_t index) const;
  double far_sign(Vec3d r) const;
  std::size_t cell(int axis, double position) const;
  void visit(std::uint32_t n, Vec3d r, Nearest& nearest) const;

  double reach_;
  double cell_width_;
  std::array<double, 2> origin_{};
  std::array<std::size_t, 2> cells_{};
  std::vector<Panel> panels_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;  ///< of panels, as leaves have them
  Buckets buckets_;
  std::vector<bool> inside_;                   ///< at the foot, in the middle of each cell
  std::vector<std::vector<double>> overhead_;  ///< heights at which panels cross that line
};

}  // namespace scarp

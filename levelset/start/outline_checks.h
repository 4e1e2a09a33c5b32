#pragma once

#include <string>
#include <vector>

#include "core/frame.h"
#include "levelset/start/place_checks.h"
#include "levelset/start/polygon.h"
#include "levelset/start/shape_report.h"
#include "levelset/start/shapes.h"

namespace scarp {

/// Outlines of masks. Growth is by how much one lies further out at the top of the mask than at its
/// foot.
class OutlineChecks {
 public:
  /// within: what is inside the outline.
  OutlineChecks(const Frame& frame, ShapeReport& report, PlaceChecks& places, Between within)
      : frame_(frame), sides_(frame.sides()), report_(report), places_(places), outline_(within) {}

  void check(const std::string& prefix, const SlotOutline& s, double growth);
  void check(const std::string& prefix, const CircleOutline& s, double growth);
  void check(const std::string& prefix, const RectangleOutline& s, double growth);

  /// The walls must stand on their own at the foot and at the top.
  void check(const std::string& prefix, const PolygonOutline& outline, double growth);

 private:
  /// Of a rectangle whose foot reaches from side to side without its corners, that the rest does.
  bool reaches_sides(const std::string& prefix, const RectangleOutline& s, int axis, double growth);

  /// Says what leaves nothing of an outline in the domain: its place, its bias or its corners.
  void nothing_left(const std::string& prefix, const std::string& key, PolygonOutline outline,
                    double growth);

  /// The outline must not close below the top of the mask.
  void narrow_end(const std::string& prefix, double width);

  /// Loops that leave something of the domain inside have no edge within it when all of it is.
  bool covers_domain(const std::vector<Loop>& loops) const;

  bool in_domain(const Point2& point) const;

  /// No edge that ends in the domain has shrunk to nothing and turned over.
  bool same_directions(const std::vector<Loop>& before, const std::vector<Loop>& after) const;

  const Frame& frame_;
  Sides sides_;
  ShapeReport& report_;
  PlaceChecks& places_;
  Between outline_;
};

}  // namespace scarp

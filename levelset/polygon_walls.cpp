#include "levelset/polygon_walls.h"

#include <algorithm>
#include <cmath>

namespace scarp {

namespace {

/// Further than the band and the diagonal of a leaf, in spacings.
constexpr double reach = 12;

/// Width of the cells by which walls are looked up, in spacings.
constexpr double cell_spacings = 8;

Vec3d outward_normal(const Point2& a, const Point2& b) {
  return normalized(Vec3d{b[1] - a[1], a[0] - b[0], 0});
}

/// How a corner moves when its edges move outwards by 1.
Vec3d mitre(Vec3d before, Vec3d after) { return (before + after) / (1 + dot(before, after)); }

}  // namespace

std::vector<Loop> moved_outwards(const std::vector<Loop>& loops, double distance) {
  std::vector<Loop> moved = loops;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    const Loop& loop = loops[l];
    const std::size_t count = loop.size();
    for (std::size_t p = 0; p < count; ++p) {
      const Vec3d shift = mitre(outward_normal(loop[(p + count - 1) % count], loop[p]),
                                outward_normal(loop[p], loop[(p + 1) % count]));
      moved[l][p] = {loop[p][0] + distance * shift.x, loop[p][1] + distance * shift.y};
    }
  }
  return moved;
}

PolygonWalls::PolygonWalls(const Frame& frame, const std::vector<Loop>& loops,
                           const WallHeights& heights)
    : reach_(reach * frame.spacing), cell_width_(cell_spacings * frame.spacing) {
  for (const Loop& loop : loops) add_walls(loop, heights);
  const Sides sides = frame.sides();
  for (int axis = 0; axis < 2; ++axis) {
    // Leaves reach beyond the domain.
    origin_[axis] = sides.lower[axis] - cell_width_;
    cells_[axis] = static_cast<std::size_t>(sides.width(axis) / cell_width_) + 3;
  }
  sort_into_cells();
  mark_insides(loops);
  find_overhead();
}

void PolygonWalls::add_walls(const Loop& loop, const WallHeights& heights) {
  const std::size_t count = loop.size();
  const double rise = heights.top - heights.foot;
  const double sine = std::sin(heights.slope);
  const double cosine = std::cos(heights.slope);
  for (std::size_t p = 0; p < count; ++p) {
    const std::array<Point2, 4> points{loop[(p + count - 1) % count], loop[p],
                                       loop[(p + 1) % count], loop[(p + 2) % count]};
    std::array<Vec3d, 3> flat;  // normals of the walls before, here, after
    for (std::size_t k = 0; k < 3; ++k) flat[k] = outward_normal(points[k], points[k + 1]);
    std::array<Vec3d, 3> tilted;
    for (std::size_t k = 0; k < 3; ++k) tilted[k] = cosine * flat[k] - Vec3d{0, 0, sine};
    const double growth = rise * sine / cosine;
    const Vec3d left{points[1][0], points[1][1], heights.foot};
    const Vec3d right{points[2][0], points[2][1], heights.foot};
    const Vec3d top_left = left + growth * mitre(flat[0], flat[1]) + Vec3d{0, 0, rise};
    const Vec3d top_right = right + growth * mitre(flat[1], flat[2]) + Vec3d{0, 0, rise};
    const bool straight_on = heights.lowest < heights.foot;
    Panel upper{.corners = {left, right, top_right, top_left}, .normal = tilted[1]};
    upper.side_normals = {flat[1], tilted[1] + tilted[2], flat[1], tilted[0] + tilted[1]};
    upper.corner_normals = {flat[0] + flat[1], flat[1] + flat[2], flat[1] + flat[2],
                            flat[0] + flat[1]};
    if (straight_on) {
      const Vec3d down{0, 0, heights.lowest - heights.foot};
      Panel below{.corners = {left + down, right + down, right, left}, .normal = flat[1]};
      upper.side_normals[0] = flat[1] + tilted[1];
      below.side_normals = {flat[1], flat[1] + flat[2], flat[1] + tilted[1], flat[0] + flat[1]};
      below.corner_normals = {flat[0] + flat[1], flat[1] + flat[2], flat[1] + flat[2],
                              flat[0] + flat[1]};
      panels_.push_back(below);
    }
    panels_.push_back(upper);
  }
  for (Panel& panel : panels_) {
    panel.lower = panel.upper = panel.corners[0];
    for (const Vec3d& corner : panel.corners) {
      for (int axis = 0; axis < 3; ++axis) {
        panel.lower[axis] = std::min(panel.lower[axis], corner[axis]);
        panel.upper[axis] = std::max(panel.upper[axis], corner[axis]);
      }
    }
  }
}

std::size_t PolygonWalls::cell(int axis, double position) const {
  const double index = std::floor((position - origin_[axis]) / cell_width_);
  return static_cast<std::size_t>(std::clamp(index, 0.0, static_cast<double>(cells_[axis] - 1)));
}

void PolygonWalls::sort_into_cells() {
  near_.resize(cells_[0] * cells_[1]);
  for (std::size_t n = 0; n < panels_.size(); ++n) {
    const Panel& panel = panels_[n];
    const auto first = [&](int axis) { return cell(axis, panel.lower[axis] - reach_); };
    const auto last = [&](int axis) { return cell(axis, panel.upper[axis] + reach_); };
    for (std::size_t i = first(0); i <= last(0); ++i) {
      for (std::size_t j = first(1); j <= last(1); ++j) {
        near_[i * cells_[1] + j].push_back(static_cast<std::uint32_t>(n));
      }
    }
  }
}

double PolygonWalls::centre(int axis, std::size_t index) const {
  return origin_[axis] + (static_cast<double>(index) + 0.5) * cell_width_;
}

void PolygonWalls::mark_insides(const std::vector<Loop>& loops) {
  std::vector<std::vector<double>> crossings(cells_[1]);
  for (const Loop& loop : loops) {
    for (std::size_t p = 0; p < loop.size(); ++p) {
      const Point2& a = loop[p];
      const Point2& b = loop[(p + 1) % loop.size()];
      const std::size_t last = cell(1, std::max(a[1], b[1]));
      for (std::size_t j = cell(1, std::min(a[1], b[1])); j <= last; ++j) {
        const double y = centre(1, j);
        if ((a[1] > y) == (b[1] > y)) continue;
        crossings[j].push_back(a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
      }
    }
  }
  inside_.resize(cells_[0] * cells_[1]);
  for (std::size_t j = 0; j < cells_[1]; ++j) {
    for (std::size_t i = 0; i < cells_[0]; ++i) {
      // A wall right on the line counts as left of it, as in find_overhead.
      const auto left = std::count_if(crossings[j].begin(), crossings[j].end(),
                                      [&](double x) { return x <= centre(0, i); });
      inside_[i * cells_[1] + j] = left % 2 != 0;
    }
  }
}

void PolygonWalls::find_overhead() {
  overhead_.resize(inside_.size());
  for (const Panel& panel : panels_) {
    if (panel.normal.z == 0) continue;
    // Seen from above; a side that two panels share is taken the same way round in both.
    const auto covers = [&](double x, double y) {
      bool odd = false;
      for (std::size_t k = 0; k < 4; ++k) {
        Vec3d a = panel.corners[k];
        Vec3d b = panel.corners[(k + 1) % 4];
        if (a.y > b.y) std::swap(a, b);
        if ((a.y > y) == (b.y > y)) continue;
        odd = odd != (x < a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
      }
      return odd;
    };
    for (std::size_t i = cell(0, panel.lower.x); i <= cell(0, panel.upper.x); ++i) {
      for (std::size_t j = cell(1, panel.lower.y); j <= cell(1, panel.upper.y); ++j) {
        const Vec3d from{centre(0, i), centre(1, j), panel.corners[0].z};
        if (!covers(from.x, from.y)) continue;
        const double rise = dot(panel.corners[0] - from, panel.normal) / panel.normal.z;
        overhead_[i * cells_[1] + j].push_back(from.z + rise);
      }
    }
  }
}

/// Where no wall is near: the way to the middle of the cell, at the same height, crosses none.
double PolygonWalls::far_sign(Vec3d r) const {
  const std::size_t c = cell(0, r.x) * cells_[1] + cell(1, r.y);
  bool inside = inside_[c];
  for (const double z : overhead_[c]) inside = inside != (z < r.z);
  return inside ? -1 : 1;
}

void PolygonWalls::visit(const Panel& panel, Vec3d r, Nearest& nearest) {
  double to_box = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double away = std::max({panel.lower[axis] - r[axis], r[axis] - panel.upper[axis], 0.0});
    to_box += away * away;
  }
  if (to_box >= nearest.square) return;
  const auto offer = [&](Vec3d point, Vec3d outside, bool on_face) {
    const Vec3d away = r - point;
    const double square = dot(away, away);
    if (square < nearest.square) nearest = {square, point, outside, on_face};
  };
  bool above_face = true;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec3d from = panel.corners[k];
    const Vec3d edge = panel.corners[(k + 1) % 4] - from;
    // A point off the face beyond this side is nearest to a side or a corner.
    if (dot(cross(edge, r - from), panel.normal) >= 0) continue;
    above_face = false;
    const double square = dot(edge, edge);
    const double s = square > 0 ? dot(r - from, edge) / square : 0;
    if (s <= 0) {
      offer(from, panel.corner_normals[k], false);
    } else if (s >= 1) {
      offer(panel.corners[(k + 1) % 4], panel.corner_normals[(k + 1) % 4], false);
    } else {
      offer(from + s * edge, panel.side_normals[k], false);
    }
  }
  if (above_face) {
    offer(r - dot(r - panel.corners[0], panel.normal) * panel.normal, panel.normal, true);
  }
}

Distance PolygonWalls::operator()(Vec3d r) const {
  const double farthest = reach_ * reach_;
  Nearest nearest{.square = farthest, .point = {}, .outside = {}, .on_face = false};
  for (const std::uint32_t n : near_[cell(0, r.x) * cells_[1] + cell(1, r.y)]) {
    visit(panels_[n], r, nearest);
  }
  if (nearest.square == farthest) return {far_sign(r) * reach_, {}};
  const Vec3d away = r - nearest.point;
  const double distance = std::sqrt(nearest.square);
  const double sign = dot(away, nearest.outside) < 0 ? -1 : 1;
  if (nearest.on_face || distance == 0) return {sign * distance, normalized(nearest.outside)};
  return {sign * distance, (sign / distance) * away};
}

}  // namespace scarp

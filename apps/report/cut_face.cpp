#include "apps/report/cut_face.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace scarp {

namespace {

using Point = std::array<double, 2>;

double distance_to_segment(const Point& r, const Point& from, const Point& to) {
  const double along_x = to[0] - from[0];
  const double along_z = to[1] - from[1];
  const double square = along_x * along_x + along_z * along_z;
  const double there = (r[0] - from[0]) * along_x + (r[1] - from[1]) * along_z;
  const double t = square > 0 ? std::clamp(there / square, 0.0, 1.0) : 0;
  return std::hypot(r[0] - from[0] - t * along_x, r[1] - from[1] - t * along_z);
}

/// Whether a line straight upwards from r crosses it. What begins at the left end of a segment ends
/// before its right one, so that a line through a point of a contour crosses it once.
bool is_below(const Point& r, const Point& from, const Point& to) {
  if ((from[0] <= r[0]) == (to[0] <= r[0])) return false;
  const double t = (r[0] - from[0]) / (to[0] - from[0]);
  return r[1] < from[1] + t * (to[1] - from[1]);
}

}  // namespace

CutFace::CutFace(const Layers& layers, std::span<const TriMesh> surfaces, int axis, double position,
                 double line)
    : line_(line), range_(line + layers.frame.spacing) {
  const Sides sides = layers.frame.sides();
  const CutPlane plane =
      CutPlane::across(axis, just_inside(position, sides.lower[axis], sides.upper[axis]));
  left_ = sides.lower[1 - axis];
  right_ = sides.upper[1 - axis];
  const std::size_t count = 1 + column_of(right_);
  for (std::size_t n = 0; n < surfaces.size(); ++n) {
    if (surfaces[n].triangles.empty()) continue;
    Contour contour{.material = layers.stack[n].material, .columns = {}};
    contour.columns.resize(count);
    for (const Polyline& lines : cross_section(surfaces[n], plane)) {
      for (std::size_t k = 1; k < lines.points.size(); ++k) {
        const Segment segment{.from = lines.points[k - 1], .to = lines.points[k]};
        const auto [low, high] = std::minmax(segment.from[0], segment.to[0]);
        for (std::size_t c = column_of(low - range_); c <= column_of(high + range_); ++c)
          contour.columns[c].push_back(segment);
      }
    }
    contours_.push_back(std::move(contour));
  }
}

std::size_t CutFace::column_of(double lateral) const {
  return static_cast<std::size_t>((std::clamp(lateral, left_, right_) - left_) / range_);
}

// Layers are solid below: each is the union of itself and those below it. A place has the material
// of the lowest layer that holds it, as scarp section draws lower layers over higher ones. Contours
// that coincide with a lower one, where a layer adds nothing, are hidden by it.
FacePlace CutFace::at(double lateral, double z) const {
  // Contours end on the sides, where numbers are rounded.
  const Point r{just_inside(lateral, left_, right_), z};
  const std::size_t column = column_of(r[0]);
  FacePlace place{.material = {}, .clearance = range_ - line_};
  if (contours_.empty()) return place;
  const auto look_at = [&](const Contour& contour) {
    bool is_inside = false;
    double nearest = range_;
    for (const Segment& segment : contour.columns[column]) {
      nearest = std::min(nearest, distance_to_segment(r, segment.from, segment.to));
      if (is_below(r, segment.from, segment.to)) is_inside = !is_inside;
    }
    place.clearance = std::min(place.clearance, nearest - line_);
    return is_inside;
  };
  if (!look_at(contours_.back())) return place;
  for (const Contour& contour : contours_) {
    place.material = contour.material;
    if (&contour == &contours_.back() || look_at(contour)) break;
  }
  return place;
}

}  // namespace scarp

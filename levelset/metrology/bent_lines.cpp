#include "levelset/metrology/bent_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "levelset/grid/band.h"
#include "levelset/grid/differences.h"

namespace scarp {

namespace {

using Point = std::array<double, 2>;

/// How far a point is moved at most, in spacings: an arc of a radius of one spacing needs no more.
constexpr double farthest = 0.25;

/// What parabolas along x and y add to linear interpolation of phi in a cell, in spacings: along
/// each axis by the smallest of the second differences at both ends and at the next nodes. An edge
/// within the cell makes those at its ends alike, but not those beyond.
double bend(const LevelSet& phi, Vec3d r) {
  const Frame& frame = phi.frame();
  const Band& band = phi.band();
  Node corner{};
  std::array<double, 3> part{};
  for (int axis = 0; axis < 3; ++axis) {
    const double index = r[axis] / frame.spacing + frame.middle(axis);
    corner[axis] = static_cast<int>(std::floor(index));
    part[axis] = index - corner[axis];
  }
  double sum = 0;
  for (int axis = 0; axis < frame.lateral_axes(); ++axis) {
    const int a = (axis + 1) % 3;
    const int b = (axis + 2) % 3;
    double second = 0;
    for (int edge = 0; edge < 4; ++edge) {
      Node node = corner;
      node[a] += edge & 1;
      node[b] += edge >> 1;
      std::array<float, 6> along{};
      for (int n = 0; n < 6; ++n) {
        Node at = node;
        at[axis] += n - 2;
        along[n] = band.node(at[0], at[1], at[2]);
      }
      const auto difference = [&](int n) {
        return (along[n - 1] - along[n]) + (along[n + 1] - along[n]);
      };
      const double weight =
          ((edge & 1) != 0 ? part[a] : 1 - part[a]) * ((edge >> 1) != 0 ? part[b] : 1 - part[b]);
      second += weight *
                minmod(minmod(difference(1), difference(4)), minmod(difference(2), difference(3)));
    }
    sum -= 0.5 * part[axis] * (1 - part[axis]) * second;
  }
  return sum;
}

/// The points of a line at which it turns: those where it only passes from facet to facet of one
/// plane say nothing of where the surface is.
std::vector<Point> without_straight(const std::vector<Point>& points, double spacing) {
  constexpr double straight = 5e-5;  // spacings, above what rounding moves points by
  std::vector<Point> kept;
  for (std::size_t n = 0; n < points.size(); ++n) {
    if (n > 0 && n + 1 < points.size()) {
      const Point& from = kept.back();
      const double dx = points[n + 1][0] - from[0];
      const double dz = points[n + 1][1] - from[1];
      const double off = (points[n][0] - from[0]) * dz - (points[n][1] - from[1]) * dx;
      const double length = std::hypot(dx, dz);
      if (length > 0 && length < 1.9 * spacing && std::abs(off) < straight * spacing * length)
        continue;
    }
    kept.push_back(points[n]);
  }
  return kept;
}

/// The same by turns of the surface, in the plane of a line.
class Bender {
 public:
  Bender(const CutPlane& plane, const LevelSet& phi)
      : plane_(plane), phi_(phi), h_(phi.frame().spacing) {}

  Point on_wall(const Point& point) const {
    const auto [across, up] = gradient(point);
    const double steepness = std::abs(across) - std::abs(up);
    if (steepness <= 0) return point;
    const double away = -bend(phi_, place(point)) / across * std::min(1.0, fading * steepness);
    return {point[0] + h_ * std::clamp(away, -farthest, farthest), point[1]};
  }

  /// Points between two others of a line, if it turns the same way at both.
  void add_arc(const Point& from, const Point& to, std::vector<Point>& points) const {
    const double dx = to[0] - from[0];
    const double dz = to[1] - from[1];
    const double length = std::hypot(dx, dz);
    if (!(length > 0)) return;
    // How far the tangent, with the gas on its left, is turned to the left of the segment.
    const auto turn = [&](const Point& point) {
      const auto [across, up] = gradient(point);
      return std::atan2(-(up * dz + across * dx), up * dx - across * dz);
    };
    const double at_start = turn(from);
    const double at_end = -turn(to);
    const double least = std::min(std::abs(at_start), std::abs(at_end));
    const double most = std::max(std::abs(at_start), std::abs(at_end));
    if (!(at_start * at_end > 0) || most > widest_turn) return;
    // The mean, but nothing where a plane goes over into an edge.
    const double angle = std::min({0.5 * (least + most), 2 * least, fading * (widest_turn - most)});
    const double height = std::copysign(0.5 * std::tan(0.5 * angle), at_start);
    for (const double s : {0.25, 0.5, 0.75}) {
      const double off = 4 * s * (1 - s) * height;
      points.push_back({from[0] + s * dx - off * dz, from[1] + s * dz + off * dx});
    }
  }

 private:
  /// Nothing may change at once where a bound is passed: rounding would be seen.
  static constexpr double fading = 4;
  static constexpr double widest_turn = std::numbers::pi / 4.5;

  Vec3d place(const Point& point) const {
    const auto [x, y] = plane_.place(point[0]);
    return {x, y, point[1]};
  }

  /// Of phi along the plane and upwards.
  std::array<double, 2> gradient(const Point& point) const {
    constexpr double step = 0.25;  // spacings
    const auto slope = [&](double dx, double dz) {
      return (phi_.distance(place({point[0] + dx, point[1] + dz})) -
              phi_.distance(place({point[0] - dx, point[1] - dz}))) /
             (2 * step * h_);
    };
    return {slope(step * h_, 0), slope(0, step * h_)};
  }

  const CutPlane& plane_;
  const LevelSet& phi_;
  double h_;
};

}  // namespace

std::vector<Polyline> bent(std::vector<Polyline> lines, const CutPlane& plane,
                           const LevelSet& phi) {
  const Bender bender(plane, phi);
  for (Polyline& line : lines) {
    std::vector<Point> points;
    for (Point point : without_straight(line.points, phi.frame().spacing)) {
      point = bender.on_wall(point);
      if (!points.empty()) bender.add_arc(Point(points.back()), point, points);
      points.push_back(point);
    }
    line.points = std::move(points);
  }
  return lines;
}

}  // namespace scarp

#include "levelset/metrology/contour.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace scarp {

namespace {

using Point = Contour::Point;

/// Where a line passes a height, and whether it goes down there.
struct Crossing {
  double lateral = 0;
  bool falls = false;
  std::size_t line = 0;
  std::size_t segment = 0;
};

void add_crossings(std::span<const Point> points, double height, std::size_t line,
                   std::vector<Crossing>& crossings) {
  for (std::size_t n = 1; n < points.size(); ++n) {
    const auto& [x0, z0] = points[n - 1];
    const auto& [x1, z1] = points[n];
    // A point at this height counts as above it.
    if ((z0 >= height) == (z1 >= height)) continue;
    crossings.push_back({.lateral = x0 + (height - z0) / (z1 - z0) * (x1 - x0),
                         .falls = z1 < height,
                         .line = line,
                         .segment = n});
  }
}

double squared_to_segment(const Point& point, const Point& from, const Point& to) {
  const double dx = to[0] - from[0];
  const double dz = to[1] - from[1];
  const double length = dx * dx + dz * dz;
  const double along = (point[0] - from[0]) * dx + (point[1] - from[1]) * dz;
  const double t = length > 0 ? std::clamp(along / length, 0.0, 1.0) : 0.0;
  const double x = point[0] - (from[0] + t * dx);
  const double z = point[1] - (from[1] + t * dz);
  return x * x + z * z;
}

void sort_by_place(std::vector<Crossing>& crossings) {
  std::stable_sort(crossings.begin(), crossings.end(),
                   [](const Crossing& a, const Crossing& b) { return a.lateral < b.lateral; });
}

double overlap(const Gap& a, const Gap& b) {
  return std::min(a.right, b.right) - std::max(a.left, b.left);
}

/// Up to a lateral position beyond which the rest of a line is left out; from the given segment
/// forwards.
std::vector<Point> until(std::span<const Point> points, std::size_t segment, double lateral) {
  std::vector<Point> kept;
  for (std::size_t n = segment; n < points.size(); ++n) {
    if (points[n][0] > lateral) {
      const auto& [x0, z0] = points[n - 1];
      const auto& [x1, z1] = points[n];
      if (x0 < lateral) kept.push_back({lateral, z0 + (lateral - x0) / (x1 - x0) * (z1 - z0)});
      return kept;
    }
    kept.push_back(points[n]);
  }
  return kept;
}

/// The same backwards, by turning the picture around.
std::vector<Point> since(std::span<const Point> points, std::size_t segment, double lateral) {
  std::vector<Point> turned;
  for (std::size_t n = points.size(); n-- > 0;) turned.push_back({-points[n][0], points[n][1]});
  std::vector<Point> kept = until(turned, points.size() - segment, -lateral);
  std::reverse(kept.begin(), kept.end());
  for (Point& point : kept) point[0] = -point[0];
  return kept;
}

/// A parabola y = c0 + c1 x + c2 x^2 by least squares, about the mean of x.
struct Parabola {
  double centre = 0;
  double c0 = 0;
  double c1 = 0;
  double c2 = 0;

  double vertex() const { return centre - c1 / (2 * c2); }
};

Parabola fit_parabola(std::span<const double> x, std::span<const double> y) {
  const auto count = static_cast<double>(x.size());
  Parabola fit{.centre = std::accumulate(x.begin(), x.end(), 0.0) / count};
  // The normal equations.
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t n = 0; n < x.size(); ++n) {
    const double u = x[n] - fit.centre;
    const Eigen::Vector3d powers{1, u, u * u};
    matrix += powers * powers.transpose();
    right += y[n] * powers;
  }
  const Eigen::Vector3d solution = matrix.ldlt().solve(right);
  fit.c0 = solution[0];
  fit.c1 = solution[1];
  fit.c2 = solution[2];
  return fit;
}

/// The largest of values at heights, and where: a single sample says little of where a flat maximum
/// lies, a parabola through what is within a quarter of the rise says more.
WidthAt maximum(std::span<const double> heights, std::span<const double> values) {
  const auto top =
      static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
  const double least = *std::min_element(values.begin(), values.end());
  const double limit = values[top] - 0.25 * (values[top] - least);
  std::size_t first = top;
  while (first > 0 && values[first - 1] >= limit) --first;
  std::size_t last = top;
  while (last + 1 < values.size() && values[last + 1] >= limit) ++last;
  WidthAt result{.width = values[top], .height = heights[top]};
  if (last - first < 4) return result;
  const std::size_t count = last - first + 1;
  const Parabola fit = fit_parabola(heights.subspan(first, count), values.subspan(first, count));
  if (!(fit.c2 < 0)) return result;
  const double vertex = fit.vertex();
  if (vertex < heights[first] && vertex > heights[last]) result.height = vertex;
  return result;
}

std::vector<double> widths_of(const Walls& walls, double sign) {
  std::vector<double> widths;
  for (std::size_t n = 0; n < walls.heights.size(); ++n)
    widths.push_back(sign * (walls.right[n] - walls.left[n]));
  return widths;
}

/// Indices of values that alternate between low and high ones, each at least the threshold away
/// from the next: the extremes of what goes up and down by more than noise. The ends count as low
/// or high as anything else.
std::vector<std::size_t> extremes(std::span<const double> values, double threshold) {
  std::vector<std::size_t> found;
  std::size_t low = 0;
  std::size_t high = 0;
  int direction = 0;  // 1: looking for a high one
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (values[n] < values[low]) low = n;
    if (values[n] > values[high]) high = n;
    if (direction >= 0 && values[high] - values[n] >= threshold) {
      found.push_back(high);
      low = n;
      direction = -1;
      high = n;
    } else if (direction <= 0 && values[n] - values[low] >= threshold) {
      found.push_back(low);
      high = n;
      direction = 1;
      low = n;
    }
  }
  return found;
}

constexpr double least_cusp = 0.25;  // spacings

/// Where a wall comes farthest into the gas: the lows of how far it lies behind a straight line
/// through it. The ends, which may cut a scallop off, are none.
std::vector<std::size_t> cusps_of(std::span<const Point> wall, double threshold) {
  std::vector<double> heights;
  std::vector<double> laterals;
  for (const auto& [x, z] : wall) {
    heights.push_back(z);
    laterals.push_back(x);
  }
  const std::optional<WallFit> line = fit_wall(heights, laterals);
  if (!line) return {};
  // Walls have the gas on their left: one that goes down has its solid at lower positions.
  const double outwards = heights.back() < heights.front() ? -1 : 1;
  std::vector<double> recess;
  for (std::size_t n = 0; n < heights.size(); ++n)
    recess.push_back(outwards * (laterals[n] - line->lateral(heights[n])));
  const std::vector<std::size_t> found = extremes(recess, threshold);
  std::vector<std::size_t> cusps;
  for (std::size_t n = 1; n < found.size(); ++n)
    if (recess[found[n]] < recess[found[n - 1]]) cusps.push_back(found[n]);
  return cusps;
}

/// The circle through points by algebraic least squares (Kasa 1976).
struct Circle {
  double z = 0;
  double radius = 0;
  double deviation = 0;  ///< root mean square
};

std::optional<Circle> fit_circle(std::span<const Point> points) {
  if (points.size() < 4) return std::nullopt;
  const auto count = static_cast<double>(points.size());
  const auto place = [](const Point& point) { return Eigen::Vector2d(point[0], point[1]); };
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Point& point : points) mean += place(point) / count;
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  Eigen::Vector2d rest = Eigen::Vector2d::Zero();
  for (const Point& point : points) {
    const Eigen::Vector2d away = place(point) - mean;
    squares += away * away.transpose();
    rest += 0.5 * away.squaredNorm() * away;
  }
  if (!(squares.determinant() > 0)) return std::nullopt;
  const Eigen::Vector2d centre = squares.inverse() * rest;
  Circle circle{.z = mean[1] + centre[1],
                .radius = std::sqrt(centre.squaredNorm() + squares.trace() / count)};
  double deviations = 0;
  for (const Point& point : points)
    deviations += std::pow((place(point) - mean - centre).norm() - circle.radius, 2);
  circle.deviation = std::sqrt(deviations / count);
  return circle;
}

/// One scallop, from cusp to cusp as far as the mesh has them.
struct Scallop {
  double middle = 0;  ///< height
  double deepest = 0;
  std::optional<Circle> circle{};

  double depth(double pitch) const {
    if (!circle || circle->radius < 0.5 * pitch) return deepest;
    return circle->radius - std::sqrt(circle->radius * circle->radius - 0.25 * pitch * pitch);
  }
};

Scallop scallop_of(std::span<const Point> points, double spacing) {
  const Point& a = points.front();
  const Point& b = points.back();
  const double dx = b[0] - a[0];
  const double dz = b[1] - a[1];
  Scallop found{.middle = 0.5 * (a[1] + b[1])};
  std::vector<Point> inner;
  for (const Point& point : points) {
    const double behind = (point[0] - a[0]) * dz - (point[1] - a[1]) * dx;
    found.deepest = std::max(found.deepest, std::abs(behind) / std::hypot(dx, dz));
    if (std::min(std::abs(point[1] - a[1]), std::abs(point[1] - b[1])) >= 0.75 * spacing)
      inner.push_back(point);
  }
  found.circle = fit_circle(inner);
  if (found.circle && found.circle->deviation > 0.1 * spacing) found.circle.reset();
  if (found.circle) found.middle = found.circle->z;
  return found;
}

/// The slope at the upper edge of a wall, by the points between which it lies, and the steep part
/// below it.
struct Facet {
  std::size_t first = 0;
  std::size_t last = 0;
  std::size_t steep = 0;
  std::size_t end = 0;
  double width = 0;  ///< of all that slopes
};

std::optional<Facet> find_facet(std::span<const Point> wall, double spacing) {
  constexpr double flat = 0.2679491924311227;   // tan 15 degrees
  constexpr double steep = 3.7320508075688776;  // tan 75 degrees
  const double enough = 2 * spacing;
  const double noise = 0.25 * spacing;
  Facet facet;
  double pending = 0;  // what slopes below steep parts
  double drop = 0;     // of the steep part so far
  double gentle = 0;   // length of what is not steep since
  std::size_t pending_last = 0;
  for (std::size_t n = 1; n < wall.size(); ++n) {
    const double across = std::abs(wall[n][0] - wall[n - 1][0]);
    const double fall = wall[n - 1][1] - wall[n][1];
    if (fall > 0 && fall >= steep * across) {
      if (drop == 0) facet.steep = n - 1;
      drop += fall;
      gentle = 0;
      facet.end = n;
      if (drop >= enough) return facet;
      continue;
    }
    gentle += std::hypot(across, fall);
    if (fall >= flat * across) {
      pending += across;
      pending_last = n;
      if (facet.width == 0 && pending == across) facet.first = n - 1;
    }
    if (gentle < noise && drop > 0) continue;
    drop = 0;
    facet.width += pending;
    if (pending > 0) facet.last = pending_last;
    pending = 0;
  }
  return std::nullopt;
}

constexpr std::size_t stretch_length = 16;  // segments

}  // namespace

Contour::Contour(std::vector<Point> points, const Mouth& mouth)
    : points_(std::move(points)), mouth_(mouth) {
  for (std::size_t n = 0; n + 1 < points_.size(); n += stretch_length) {
    Stretch stretch{.lowest = points_[n][1], .highest = points_[n][1]};
    for (std::size_t k = n; k < std::min(n + stretch_length + 1, points_.size()); ++k) {
      stretch.lowest = std::min(stretch.lowest, points_[k][1]);
      stretch.highest = std::max(stretch.highest, points_[k][1]);
    }
    stretches_.push_back(stretch);
  }
}

std::optional<Gap> Contour::gap(double height) const {
  std::vector<Crossing> crossings;
  const auto add_crossings_of = [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin / stretch_length; n * stretch_length + 1 < end; ++n) {
      if (!(stretches_[n].lowest < height && height <= stretches_[n].highest)) continue;
      const std::size_t from = std::max(begin, n * stretch_length);
      const std::size_t to = std::min(end, (n + 1) * stretch_length + 1);
      add_crossings(std::span(points_).subspan(from, to - from), height, 0, crossings);
    }
  };
  if (height < mouth_.height) {
    // In the order of the contour: a pocket that walls part from the mouth lies in between.
    add_crossings_of(std::max<std::size_t>(mouth_.first, 1) - 1,
                     std::min(mouth_.last + 2, points_.size()));
    if (crossings.empty() || !crossings.front().falls || crossings.back().falls)
      return std::nullopt;
    return Gap{.left = crossings.front().lateral, .right = crossings.back().lateral};
  }
  add_crossings_of(0, points_.size());
  sort_by_place(crossings);
  std::optional<Gap> best;
  for (std::size_t n = 1; n < crossings.size(); ++n) {
    if (!crossings[n - 1].falls || crossings[n].falls) continue;
    const Gap gap{.left = crossings[n - 1].lateral, .right = crossings[n].lateral};
    if (!best || overlap(gap, mouth_.gap) > overlap(*best, mouth_.gap)) best = gap;
  }
  return best;
}

std::size_t Contour::lowest_index() const {
  return static_cast<std::size_t>(
      std::min_element(points_.begin(), points_.end(),
                       [](const Point& a, const Point& b) { return a[1] < b[1]; }) -
      points_.begin());
}

Point Contour::lowest() const { return points_[lowest_index()]; }

std::optional<double> Contour::floor(double lateral) const {
  std::optional<double> lowest;
  for (std::size_t n = 1; n < points_.size(); ++n) {
    const auto& [x0, z0] = points_[n - 1];
    const auto& [x1, z1] = points_[n];
    // Floors go to the right, roofs to the left.
    if (!(x0 <= lateral && lateral < x1)) continue;
    const double height = z0 + (lateral - x0) / (x1 - x0) * (z1 - z0);
    if (!lowest || height < *lowest) lowest = height;
  }
  return lowest;
}

std::span<const Point> Contour::left_side() const {
  return std::span(points_).first(lowest_index() + 1);
}

std::span<const Point> Contour::right_side() const {
  return std::span(points_).subspan(lowest_index());
}

std::span<const Point> Contour::left_wall(double lowest) const {
  const auto is_below = [&](const Point& point) { return point[1] < lowest; };
  const auto end =
      std::find_if(points_.begin() + std::ptrdiff_t(mouth_.first), points_.end(), is_below);
  return {points_.begin(), end};
}

std::span<const Point> Contour::right_wall(double lowest) const {
  const auto is_below = [&](const Point& point) { return point[1] < lowest; };
  const auto after = points_.rend() - std::ptrdiff_t(std::min(mouth_.last + 1, points_.size()));
  return {std::find_if(after, points_.rend(), is_below).base(), points_.end()};
}

std::optional<Contour> find_contour(std::span<const Polyline> lines, double lateral, double height,
                                    std::array<double, 2> fields) {
  std::vector<Crossing> crossings;
  for (std::size_t n = 0; n < lines.size(); ++n)
    add_crossings(lines[n].points, height, n, crossings);
  sort_by_place(crossings);
  for (std::size_t n = 1; n < crossings.size(); ++n) {
    const Crossing& left = crossings[n - 1];
    const Crossing& right = crossings[n];
    if (!left.falls || right.falls || left.lateral > lateral || right.lateral < lateral) continue;
    if (left.line != right.line || left.segment > right.segment) return std::nullopt;
    const std::vector<Point>& points = lines[left.line].points;
    std::vector<Point> contour = since(points, left.segment, fields[0]);
    const Contour::Mouth mouth{.gap = {.left = left.lateral, .right = right.lateral},
                               .height = height,
                               .first = contour.size(),
                               .last = contour.size() + right.segment - left.segment - 1};
    contour.insert(contour.end(), points.begin() + static_cast<std::ptrdiff_t>(left.segment),
                   points.begin() + static_cast<std::ptrdiff_t>(right.segment));
    const std::vector<Point> rest = until(points, right.segment, fields[1]);
    contour.insert(contour.end(), rest.begin(), rest.end());
    return Contour(std::move(contour), mouth);
  }
  return std::nullopt;
}

Walls sample_walls(const Contour& contour, double highest, double lowest, double spacing) {
  constexpr double least_count = 64;
  constexpr double most_count = 4096;
  const double wanted = std::ceil(4 * (highest - lowest) / spacing);
  const auto count = static_cast<int>(std::clamp(wanted, least_count, most_count));
  Walls walls;
  for (int n = 0; n < count; ++n) {
    const double height = highest - (n + 0.5) * (highest - lowest) / count;
    const std::optional<Gap> gap = contour.gap(height);
    if (!gap) continue;
    walls.heights.push_back(height);
    walls.left.push_back(gap->left);
    walls.right.push_back(gap->right);
  }
  return walls;
}

std::optional<WallFit> fit_wall(std::span<const double> heights, std::span<const double> laterals) {
  if (heights.size() < 2) return std::nullopt;
  const auto count = static_cast<double>(heights.size());
  const double mean_z = std::accumulate(heights.begin(), heights.end(), 0.0) / count;
  const double mean_x = std::accumulate(laterals.begin(), laterals.end(), 0.0) / count;
  double zz = 0;
  double xz = 0;
  for (std::size_t n = 0; n < heights.size(); ++n) {
    zz += (heights[n] - mean_z) * (heights[n] - mean_z);
    xz += (heights[n] - mean_z) * (laterals[n] - mean_x);
  }
  if (!(zz > 0)) return std::nullopt;
  WallFit fit{.at_zero = mean_x - xz / zz * mean_z, .slope = xz / zz};
  double squares = 0;
  for (std::size_t n = 0; n < heights.size(); ++n) {
    const double residual = laterals[n] - fit.lateral(heights[n]);
    squares += residual * residual;
  }
  fit.deviation = std::sqrt(squares / count);
  return fit;
}

std::optional<WidthAt> widest(const Walls& walls) {
  if (walls.heights.empty()) return std::nullopt;
  return maximum(walls.heights, widths_of(walls, 1));
}

std::optional<WidthAt> narrowest(const Walls& walls) {
  if (walls.heights.empty()) return std::nullopt;
  const WidthAt found = maximum(walls.heights, widths_of(walls, -1));
  return WidthAt{.width = -found.width, .height = found.height};
}

std::optional<Scallops> scallops(std::span<const Point> wall, double highest, double lowest,
                                 double spacing) {
  std::vector<Point> points;
  for (const Point& point : wall)
    if (point[1] <= highest && point[1] >= lowest) points.push_back(point);
  const std::vector<std::size_t> cusps = cusps_of(points, least_cusp * spacing);
  if (cusps.size() < 3) return std::nullopt;
  std::vector<Scallop> each;
  for (std::size_t n = 1; n < cusps.size(); ++n)
    each.push_back(
        scallop_of(std::span(points).subspan(cusps[n - 1], cusps[n] - cusps[n - 1] + 1), spacing));

  const auto pitch_between = [&](std::size_t a, std::size_t b) {
    return std::abs(each[a].middle - each[b].middle) / static_cast<double>(b - a);
  };
  const std::size_t last = each.size() - 1;
  Scallops mean{.pitch = pitch_between(0, last)};
  for (std::size_t n = 0; n <= last; ++n) {
    const double pitch = pitch_between(n > 0 ? n - 1 : 0, std::min(n + 1, last));
    mean.amplitude += each[n].depth(pitch) / static_cast<double>(each.size());
  }
  return mean;
}

std::optional<double> facet_width(std::span<const Point> wall, double field, double spacing) {
  const std::optional<Facet> facet = find_facet(wall, spacing);
  if (!facet) return std::nullopt;
  // Without what lies next to its ends.
  std::vector<double> heights;
  std::vector<double> laterals;
  for (std::size_t n = facet->first; n <= facet->last && facet->width > 4 * spacing; ++n) {
    if (std::abs(wall[n][0] - wall[facet->first][0]) < spacing) continue;
    if (std::abs(wall[n][0] - wall[facet->last][0]) < spacing) continue;
    heights.push_back(wall[n][1]);
    laterals.push_back(wall[n][0]);
  }
  const std::optional<WallFit> line = fit_wall(heights, laterals);
  if (!line) return facet->width;
  if (line->deviation > 0.1 * spacing) {
    const auto circle = fit_circle(wall.subspan(facet->first, facet->last - facet->first + 1));
    constexpr double part = std::numbers::sqrt2 / 2;  // sin 75 degrees - sin 15 degrees
    return circle && circle->deviation < 0.1 * spacing ? part * circle->radius : facet->width;
  }
  // The line meets the wall below where both have the same lateral position.
  const auto& [x0, z0] = wall[facet->steep];
  const auto& [x1, z1] = wall[facet->end];
  const double steep = (x1 - x0) / (z1 - z0);
  const double corner = (x0 - steep * z0 - line->at_zero) / (line->slope - steep);
  return std::abs(line->lateral(field) - line->lateral(corner));
}

double gas_above(std::span<const Polyline> lines, double lateral, double lower, double upper) {
  // A line that goes to the right has its gas above it.
  std::vector<std::pair<double, bool>> crossings;  // height, and whether it is a floor
  for (const Polyline& line : lines) {
    for (std::size_t n = 1; n < line.points.size(); ++n) {
      const auto& [x0, z0] = line.points[n - 1];
      const auto& [x1, z1] = line.points[n];
      if ((x0 <= lateral) == (x1 <= lateral)) continue;
      const double height = z0 + (lateral - x0) / (x1 - x0) * (z1 - z0);
      crossings.emplace_back(height, x1 > x0);
    }
  }
  std::ranges::sort(crossings);
  double gas = 0;
  for (std::size_t n = 1; n < crossings.size(); ++n) {
    if (!crossings[n - 1].second || crossings[n].second) continue;
    gas += std::max(0.0,
                    std::min(crossings[n].first, upper) - std::max(crossings[n - 1].first, lower));
  }
  return gas;
}

DistanceToLines::DistanceToLines(std::span<const Polyline> lines) {
  constexpr std::size_t longest = 16;  // segments
  for (const Polyline& line : lines) {
    for (std::size_t n = 0; n + 1 < line.points.size(); n += longest) {
      const std::size_t count = std::min(longest + 1, line.points.size() - n);
      Stretch stretch{std::span(line.points).subspan(n, count), line.points[n], line.points[n]};
      for (const auto& [x, z] : stretch.points) {
        stretch.lower = {std::min(stretch.lower[0], x), std::min(stretch.lower[1], z)};
        stretch.upper = {std::max(stretch.upper[0], x), std::max(stretch.upper[1], z)};
      }
      stretches_.push_back(stretch);
    }
  }
}

// What lies in boxes further away than the nearest so far is not looked at.
double DistanceToLines::operator()(const Point& point) const {
  const auto squared_to_box = [&](const Stretch& stretch) {
    double squared = 0;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double nearest = std::clamp(point[axis], stretch.lower[axis], stretch.upper[axis]);
      squared += (point[axis] - nearest) * (point[axis] - nearest);
    }
    return squared;
  };
  double nearest = std::numeric_limits<double>::infinity();
  const auto look_at = [&](const Stretch& stretch) {
    for (std::size_t n = 1; n < stretch.points.size(); ++n)
      nearest =
          std::min(nearest, squared_to_segment(point, stretch.points[n - 1], stretch.points[n]));
  };
  if (stretches_.empty()) return nearest;
  const Stretch& first = *std::ranges::min_element(stretches_, {}, squared_to_box);
  look_at(first);
  for (const Stretch& stretch : stretches_)
    if (&stretch != &first && squared_to_box(stretch) < nearest) look_at(stretch);
  return std::sqrt(nearest);
}

}  // namespace scarp

#include "apps/report/measured_contour.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "apps/run/restart.h"
#include "apps/simulator/section.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/number_table.h"
#include "core/system/read_file.h"
#include "levelset/metrology/contour.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

using Point = Contour::Point;

double lateral_of(const Point& point) { return point[0]; }
double height_of(const Point& point) { return point[1]; }

constexpr std::array everywhere{-std::numeric_limits<double>::infinity(),
                                std::numeric_limits<double>::infinity()};

bool is_closed(const Polyline& line) { return line.points.front() == line.points.back(); }

double signed_area(const Polyline& loop) {
  double area = 0;
  for (std::size_t n = 1; n < loop.points.size(); ++n) {
    const auto& [x0, z0] = loop.points[n - 1];
    const auto& [x1, z1] = loop.points[n];
    area += 0.5 * (x0 * z1 - x1 * z0);
  }
  return area;
}

/// The outline of a void from its highest point on, so that it has walls as an opening has.
Polyline from_highest(Polyline loop) {
  loop.points.pop_back();
  std::rotate(loop.points.begin(), std::ranges::max_element(loop.points, {}, &height_of),
              loop.points.end());
  loop.points.push_back(loop.points.front());
  return loop;
}

/// With the gas on its left, as lines of a cross-section have it; a closed one, which is a void,
/// from its highest point on.
Polyline read_contour(const fs::path& file) {
  const std::array columns{Column{.name = "x", .dimension = Dimension::length},
                           Column{.name = "z", .dimension = Dimension::length}};
  Polyline contour;
  for (const std::vector<double>& row : read_csv(file, read_file(file), columns).values)
    contour.points.push_back({row[0], row[1]});
  if (contour.points.size() < 3)
    throw InputError(fmt::format("{}: a contour has three points or more", shown(file)));
  if (!is_closed(contour)) {
    if (contour.points.front()[0] > contour.points.back()[0]) std::ranges::reverse(contour.points);
    return contour;
  }
  if (signed_area(contour) < 0) std::ranges::reverse(contour.points);
  return from_highest(std::move(contour));
}

/// A place on a line: what lies before it has fewer points.
struct Place {
  double squared = std::numeric_limits<double>::infinity();  ///< distance to what is sought
  std::size_t segment = 0;                                   ///< up to this point
  Point point{};
};

Place nearest_place(const Polyline& line, const Point& sought) {
  Place nearest;
  for (std::size_t n = 1; n < line.points.size(); ++n) {
    const auto& [x0, z0] = line.points[n - 1];
    const auto& [x1, z1] = line.points[n];
    const double squared_length = (x1 - x0) * (x1 - x0) + (z1 - z0) * (z1 - z0);
    const double along = (sought[0] - x0) * (x1 - x0) + (sought[1] - z0) * (z1 - z0);
    const double t = squared_length > 0 ? std::clamp(along / squared_length, 0.0, 1.0) : 0.0;
    const Point point{std::lerp(x0, x1, t), std::lerp(z0, z1, t)};
    const double squared = std::pow(sought[0] - point[0], 2) + std::pow(sought[1] - point[1], 2);
    if (squared < nearest.squared) nearest = {.squared = squared, .segment = n, .point = point};
  }
  return nearest;
}

/// The part of the lines between the places nearest to two points, of the line that both are
/// nearest to. Unlike what lies between two lateral positions it has all of an opening that is
/// wider below than the field on which the contour begins.
Polyline between(std::span<const Polyline> lines, const Point& first, const Point& last) {
  Polyline part;
  double least = std::numeric_limits<double>::infinity();
  for (const Polyline& line : lines) {
    const Place from = nearest_place(line, first);
    const Place to = nearest_place(line, last);
    if (from.squared + to.squared >= least || from.segment > to.segment) continue;
    least = from.squared + to.squared;
    part.points.assign(1, from.point);
    part.points.insert(part.points.end(),
                       line.points.begin() + static_cast<std::ptrdiff_t>(from.segment),
                       line.points.begin() + static_cast<std::ptrdiff_t>(to.segment));
    part.points.push_back(to.point);
  }
  return part;
}

/// Some of one line lies below or above some of another.
bool overlap(const Polyline& a, const Polyline& b) {
  const auto [a_left, a_right] = std::ranges::minmax(a.points, {}, &lateral_of);
  const auto [b_left, b_right] = std::ranges::minmax(b.points, {}, &lateral_of);
  return a_left[0] <= b_right[0] && b_left[0] <= a_right[0];
}

/// Points of a line at most so far apart.
std::vector<Point> points_on(const Polyline& line, double most) {
  std::vector<Point> points{line.points.front()};
  for (std::size_t n = 1; n < line.points.size(); ++n) {
    const Point& from = line.points[n - 1];
    const Point& to = line.points[n];
    const double parts = std::ceil(std::hypot(to[0] - from[0], to[1] - from[1]) / most);
    for (double part = 1; part <= parts; ++part)
      points.push_back(
          {std::lerp(from[0], to[0], part / parts), std::lerp(from[1], to[1], part / parts)});
  }
  return points;
}

/// From one line to another, in spacings.
DistanceStatistics distances(const Polyline& from, const Polyline& to, double spacing) {
  std::vector<double> values;
  const DistanceToLines distance(std::span(&to, 1));
  for (const Point& point : points_on(from, 0.25 * spacing))
    values.push_back(distance(point) / spacing);
  return statistics(values);
}

/// What of a profile a contour is to be compared with: of a void the nearest void, of all else the
/// exposed surface from end to end. A void that the wafer lacks is compared with that, too.
Polyline counterpart(const Polyline& measured, std::span<const Polyline> profile, double spacing,
                     std::vector<std::string>& warnings) {
  std::vector<Polyline> openings;
  std::vector<Polyline> voids;
  for (const Polyline& line : profile) {
    if (!is_closed(line))
      openings.push_back(line);
    else if (signed_area(line) > 0 && overlap(line, measured))
      voids.push_back(line);
  }
  if (is_closed(measured) && !voids.empty()) {
    const auto apart = [&](const Polyline& each) {
      return distances(measured, each, spacing).mean;
    };
    return from_highest(*std::ranges::min_element(voids, {}, apart));
  }
  if (openings.empty()) throw InputError("the wafer has no surface where the contour is");
  if (is_closed(measured)) {
    warnings.emplace_back(
        "the contour is closed, so it is that of a void, and the wafer has none there; leave that "
        "of an opening open, from field to field");
    const auto [left, right] = std::ranges::minmax(measured.points, {}, &lateral_of);
    return between(openings, left, right);
  }
  if (!voids.empty()) {
    warnings.emplace_back(
        "the wafer has a void below the contour, which is open and says nothing about it; "
        "compare a void with a contour whose last point is its first");
  }
  return between(openings, measured.points.front(), measured.points.back());
}

/// The deepest opening of a contour, or the void that it goes around; nothing without walls.
std::optional<Contour> opening_of(const Polyline& line) {
  const std::vector<Point>& points = line.points;
  const auto lowest = std::ranges::min_element(points, {}, &height_of);
  const double field = 0.5 * (points.front()[1] + points.back()[1]);
  const double middle = 0.5 * (field + (*lowest)[1]);
  // Where walls pass the middle on either side of the lowest point, which lies beside them where
  // the opening leans.
  const auto is_above = [&](const Point& point) { return point[1] >= middle; };
  const auto right = std::find_if(lowest, points.end(), is_above);
  const auto left = std::find_if(std::reverse_iterator(lowest), points.rend(), is_above);
  if (right == points.end() || left == points.rend()) return std::nullopt;
  const auto lateral = [&](const Point& below, const Point& above) {
    return std::lerp(below[0], above[0], (middle - below[1]) / (above[1] - below[1]));
  };
  const double lateral_left = lateral(*std::prev(left), *left);
  const double lateral_right = lateral(*std::prev(right), *right);
  return find_contour(std::span(&line, 1), 0.5 * (lateral_left + lateral_right), middle,
                      everywhere);
}

/// Widths and depth of a profile beside those of the contour.
class ContourValues {
 public:
  ContourValues(double spacing, const Tolerances& allowed) : spacing_(spacing), allowed_(allowed) {}

  std::vector<ComparedValue> compare(const Contour& first, const Polyline& profile) const {
    const double field = field_of(first.points());
    const double deep = depth(first);
    const double middle = field - 0.5 * deep;
    const std::optional<Gap> gap = first.gap(middle);
    std::vector<ComparedValue> values;
    if (!gap) return values;
    const auto second =
        find_contour(std::span(&profile, 1), 0.5 * (gap->left + gap->right), middle, everywhere);
    values.push_back(value("depth_nm", deep, second ? depth(*second) : dip(profile, *gap)));
    const std::array parts{std::pair{"top_cd_nm", 0.1}, std::pair{"middle_cd_nm", 0.5},
                           std::pair{"bottom_cd_nm", 0.9}};
    for (const auto& [name, part] : parts) {
      const double height = field - part * deep;
      const std::optional<Gap> a = first.gap(height);
      const std::optional<Gap> b = second ? second->gap(height) : std::nullopt;
      if (a) values.push_back(value(name, a->width(), width(b)));
    }
    return values;
  }

 private:
  static double field_of(const std::vector<Point>& points) {
    return 0.5 * (points.front()[1] + points.back()[1]);
  }

  static double depth(const Contour& contour) {
    return field_of(contour.points()) - contour.lowest()[1];
  }

  /// How deep a profile is that does not reach the middle of the contour's opening.
  static double dip(const Polyline& profile, const Gap& gap) {
    double deepest = 0;
    for (const Polyline& part : clipped(std::span(&profile, 1), gap.left, gap.right))
      for (const Point& point : part.points)
        deepest = std::max(deepest, field_of(profile.points) - point[1]);
    return deepest;
  }

  static std::optional<double> width(const std::optional<Gap>& gap) {
    return gap ? std::optional(gap->width()) : std::nullopt;
  }

  // What the profile lacks has no verdict, but a line.
  ComparedValue value(const char* name, double first, std::optional<double> second) const {
    ComparedValue result{.name = name, .first = {.count = 1, .mean = first}};
    if (!second) return result;
    result.second = {.count = 1, .mean = *second};
    result.difference = *second - first;
    result.tolerance = allowed_.length_cells * spacing_ + allowed_.length_part * std::abs(first);
    result.verdict = judge(std::abs(*result.difference), *result.tolerance, true);
    return result;
  }

  double spacing_;
  const Tolerances& allowed_;
};

}  // namespace

Comparison compare_with_contour(const fs::path& where, const fs::path& file,
                                const std::string& text, const Tolerances& tolerances) {
  const Polyline measured = read_contour(file);
  const RunRecord run = read_run(where);
  const SavedWafer wafer = read_wafer(run.outputs.back().state);
  const double spacing = wafer.layers.frame.spacing;
  const SectionLine line = parse_section(text, wafer.layers.frame);
  const auto [left, right] = std::ranges::minmax(measured.points, {}, &lateral_of);
  if (left[0] < line.left - spacing || right[0] > line.right + spacing) {
    throw InputError(fmt::format(
        "{}: goes from {:.6g} to {:.6g} nm, the wafer from {:.6g} to {:.6g} nm; move it there",
        shown(file), left[0], right[0], line.left, line.right));
  }
  Comparison result{.first = shown(file.filename()),
                    .second = shown(where),
                    .spacing = spacing,
                    .tolerances = tolerances};
  if (!run.is_complete) result.warnings.push_back(incomplete_warning(run));
  const std::vector<Polyline> profile =
      exposed_lines(cut(wafer.layers, layer_surfaces(wafer.layers), line));
  const Polyline seen = counterpart(measured, profile, spacing, result.warnings);
  if (const std::optional<Contour> opening = opening_of(measured)) {
    const bool is_seen = is_closed(measured) == is_closed(seen);
    result.values =
        ContourValues(spacing, tolerances).compare(*opening, is_seen ? seen : Polyline{});
    for (ComparedValue& each : result.values) each.time = wafer.time;
  } else {
    result.warnings.emplace_back(
        "the contour has no opening between two walls, so neither depth nor widths are compared");
  }

  ComparedDistance apart{.time = wafer.time,
                         .forward = distances(measured, seen, spacing),
                         .reverse = distances(seen, measured, spacing),
                         .mean_tolerance = tolerances.mean_distance,
                         .p99_tolerance = tolerances.p99_distance};
  apart.mean_verdict =
      judge(apart.worst(&DistanceStatistics::mean), tolerances.mean_distance, true);
  apart.p99_verdict = judge(apart.worst(&DistanceStatistics::p99), tolerances.p99_distance, true);
  result.distances = {apart};
  result.profiles = {{.time = wafer.time, .first = {measured}, .second = {seen}}};
  return result;
}

}  // namespace scarp

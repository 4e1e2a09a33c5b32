#include "apps/measured_contour.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/restart.h"
#include "apps/section.h"
#include "core/error.h"
#include "core/number_table.h"
#include "levelset/contour.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

using Point = Contour::Point;

/// Its points from left to right, as lines of a cross-section have them.
Polyline read_contour(const fs::path& file) {
  const std::array columns{Column{.name = "x", .dimension = Dimension::length},
                           Column{.name = "z", .dimension = Dimension::length}};
  Polyline contour;
  for (const std::vector<double>& row : read_csv(file, columns).values)
    contour.points.push_back({row[0], row[1]});
  if (contour.points.size() < 3)
    throw InputError(fmt::format("{}: a contour has three points or more", file.string()));
  if (contour.points.front()[0] > contour.points.back()[0]) std::ranges::reverse(contour.points);
  return contour;
}

/// Points of lines at most so far apart.
std::vector<Point> points_on(std::span<const Polyline> lines, double most) {
  std::vector<Point> points;
  for (const Polyline& line : lines) {
    for (std::size_t n = 0; n < line.points.size(); ++n) {
      const Point& to = line.points[n];
      if (n > 0) {
        const Point& from = line.points[n - 1];
        const auto parts = std::ceil(std::hypot(to[0] - from[0], to[1] - from[1]) / most);
        for (double part = 1; part < parts; ++part)
          points.push_back({from[0] + part / parts * (to[0] - from[0]),
                            from[1] + part / parts * (to[1] - from[1])});
      }
      points.push_back(to);
    }
  }
  return points;
}

DistanceStatistics distances_to(std::span<const Polyline> lines, std::span<const Point> points,
                                double spacing) {
  std::vector<double> values;
  const DistanceToLines distance(lines);
  for (const Point& point : points) values.push_back(distance(point) / spacing);
  return statistics(values);
}

/// Widths and depth of a profile beside those of the contour, if it has an opening.
class ContourValues {
 public:
  ContourValues(const Polyline& measured, double spacing, const Tolerances& allowed)
      : measured_(measured), spacing_(spacing), allowed_(allowed) {
    fields_ = {measured.points.front()[0], measured.points.back()[0]};
    field_ = 0.5 * (measured.points.front()[1] + measured.points.back()[1]);
    lowest_ = *std::ranges::min_element(measured.points, {}, [](const Point& p) { return p[1]; });
  }

  std::vector<ComparedValue> compare(std::span<const Polyline> profile) const {
    const double middle = 0.5 * (field_ + lowest_[1]);
    std::vector<ComparedValue> values;
    const auto first = find_contour(std::span(&measured_, 1), lowest_[0], middle, fields_);
    const auto gap = first ? first->gap(middle) : std::nullopt;
    if (!gap) return values;
    const auto second = find_contour(profile, 0.5 * (gap->left + gap->right), middle, fields_);
    // An opening that the profile lacks is not deep.
    values.push_back(value("depth_nm", depth(*first), second ? depth(*second) : 0));
    const std::array parts{std::pair{"top_cd_nm", 0.1}, std::pair{"middle_cd_nm", 0.5},
                           std::pair{"bottom_cd_nm", 0.9}};
    for (const auto& [name, part] : parts) {
      const double height = field_ - part * (field_ - lowest_[1]);
      const std::optional<Gap> a = first->gap(height);
      const std::optional<Gap> b = second ? second->gap(height) : std::nullopt;
      if (a) values.push_back(value(name, a->width(), width(b)));
    }
    return values;
  }

 private:
  static double depth(const Contour& contour) {
    const double field = 0.5 * (contour.points().front()[1] + contour.points().back()[1]);
    return field - contour.lowest()[1];
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

  const Polyline& measured_;
  double spacing_;
  const Tolerances& allowed_;
  std::array<double, 2> fields_{};
  double field_ = 0;
  Point lowest_{};
};

}  // namespace

Comparison compare_with_contour(const fs::path& where, const fs::path& file,
                                const std::string& text, const Tolerances& tolerances) {
  const Polyline measured = read_contour(file);
  const RunRecord run = read_run(where);
  const SavedWafer wafer = read_wafer(run.outputs.back().state);
  const double spacing = wafer.layers.frame.spacing;
  const SectionLine line = parse_section(text, wafer.layers.frame);
  const std::vector<Polyline> profile =
      exposed_lines(cut(wafer.layers, layer_surfaces(wafer.layers), line));
  const double left = measured.points.front()[0];
  const double right = measured.points.back()[0];
  if (left < line.left - spacing || right > line.right + spacing) {
    throw InputError(fmt::format(
        "{}: goes from {:.6g} to {:.6g} nm, the wafer from {:.6g} to {:.6g} nm; move it there",
        file.string(), left, right, line.left, line.right));
  }
  const std::vector<Polyline> seen = clipped(profile, left, right);

  const double step = 0.25 * spacing;
  const std::span<const Polyline> reference(&measured, 1);
  ComparedDistance apart{.time = wafer.time,
                         .forward = distances_to(profile, points_on(reference, step), spacing),
                         .reverse = distances_to(reference, points_on(seen, step), spacing),
                         .mean_tolerance = tolerances.mean_distance,
                         .p99_tolerance = tolerances.p99_distance};
  apart.mean_verdict =
      judge(apart.worst(&DistanceStatistics::mean), tolerances.mean_distance, true);
  apart.p99_verdict = judge(apart.worst(&DistanceStatistics::p99), tolerances.p99_distance, true);

  Comparison result{.first = file.filename().string(),
                    .second = where.string(),
                    .spacing = spacing,
                    .tolerances = tolerances};
  if (!run.is_complete) result.warnings.push_back(incomplete_warning(run));
  result.values = ContourValues(measured, spacing, tolerances).compare(profile);
  for (ComparedValue& each : result.values) each.time = wafer.time;
  result.distances = {apart};
  result.profiles = {{.time = wafer.time, .first = {measured}, .second = seen}};
  return result;
}

}  // namespace scarp

#include "levelset/metrology/metrology.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/parallel.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/metrology/openings.h"
#include "levelset/metrology/section_measurement.h"
#include "levelset/metrology/view_from_above.h"
#include "levelset/metrology/wafer_surfaces.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"

namespace scarp {

namespace {

using Value = std::optional<double>;

constexpr int most_sections = 64;
constexpr int least_for_roughness = 8;

/// What is summed up over sections.
constexpr std::array averaged{
    &OpeningMetrology::depth,           &OpeningMetrology::depth_error,
    &OpeningMetrology::aspect_ratio,    &OpeningMetrology::micro_trenching_error,
    &OpeningMetrology::top_cd,          &OpeningMetrology::middle_cd,
    &OpeningMetrology::bottom_cd,       &OpeningMetrology::neck_cd,
    &OpeningMetrology::neck_depth,      &OpeningMetrology::bow,
    &OpeningMetrology::bow_depth,       &OpeningMetrology::sidewall_angle,
    &OpeningMetrology::left_angle,      &OpeningMetrology::right_angle,
    &OpeningMetrology::micro_trenching, &OpeningMetrology::facet_width,
    &OpeningMetrology::scallop_pitch,   &OpeningMetrology::scallop_amplitude,
    &OpeningMetrology::wall_roughness,  &OpeningMetrology::undercut,
    &OpeningMetrology::mask_thickness,  &OpeningMetrology::bottom_height,
    &OpeningMetrology::lowest_height};

constexpr std::array averaged_of_films{&FilmMetrology::top, &FilmMetrology::wall,
                                       &FilmMetrology::bottom, &FilmMetrology::conformality};

/// The mean of those that are there.
template <class Sections, class Member>
Value mean_of(const Sections& sections, const Member& member) {
  double sum = 0;
  int count = 0;
  for (const auto& section : sections) {
    if (const Value value = member(section)) {
      sum += *value;
      ++count;
    }
  }
  return count > 0 ? Value(sum / count) : std::nullopt;
}

/// Three standard deviations of the widths.
Value line_width_roughness(std::span<const OpeningMetrology> sections) {
  const Value average = mean_of(sections, [](const auto& each) { return each.middle_cd; });
  double squares = 0;
  int count = 0;
  for (const OpeningMetrology& section : sections) {
    if (!section.middle_cd) continue;
    squares += (*section.middle_cd - *average) * (*section.middle_cd - *average);
    ++count;
  }
  if (count < least_for_roughness) return std::nullopt;
  return 3 * std::sqrt(squares / (count - 1));
}

OpeningMetrology mean_section(std::span<const OpeningMetrology> sections, double h) {
  OpeningMetrology result = sections.front();
  result.section_count = static_cast<int>(sections.size());
  for (const auto member : averaged)
    result.*member = mean_of(sections, [&](const auto& each) { return each.*member; });
  for (std::size_t n = 0; n < result.cd_at.size(); ++n)
    result.cd_at[n] = mean_of(sections, [&](const auto& each) { return each.cd_at[n]; });
  for (std::size_t n = 0; n < result.angle_at.size(); ++n)
    for (std::size_t side = 0; side < 2; ++side)
      result.angle_at[n][side] =
          mean_of(sections, [&](const auto& each) { return each.angle_at[n][side]; });
  for (std::size_t n = 0; n < result.films.size(); ++n) {
    for (const auto member : averaged_of_films) {
      result.films[n].*member =
          mean_of(sections, [&](const auto& each) { return each.films[n].*member; });
    }
  }
  for (FilmMetrology& film : result.films) {
    film.step_coverage = ratio(film.bottom, film.top, least_film * h);
    film.wall_coverage = ratio(film.wall, film.top, least_film * h);
  }
  result.line_width_roughness = line_width_roughness(sections);
  return result;
}

/// Where sections lie across an axis: one through a hole and in two dimensions, else evenly spaced
/// along the trench.
std::vector<double> section_positions(const Frame& frame, int axis, const Opening& opening) {
  const Sides sides = frame.sides();
  // One on a periodic side may lie beyond it.
  if (!opening.through[axis])
    return {opening.centre[axis] +
            (opening.centre[axis] < sides.lower[axis] ? sides.width(axis) : 0)};
  if (!frame.varies_along(axis)) return {0};
  const int count = std::min(frame.cells[axis], most_sections);
  std::vector<double> positions(static_cast<std::size_t>(count));
  for (int n = 0; n < count; ++n)
    positions[static_cast<std::size_t>(n)] =
        sides.lower[axis] + (n + 0.5) * sides.width(axis) / count;
  return positions;
}

std::optional<OpeningMetrology> measure_opening(const WaferSurfaces& surfaces,
                                                const MetrologyOptions& options,
                                                const OpeningMap& map, std::size_t number,
                                                int axis) {
  const Opening& opening = map.openings()[number];
  const std::vector<double> positions = section_positions(surfaces.frame(), axis, opening);
  std::vector<std::optional<OpeningMetrology>> found(positions.size());
  parallel_for(positions.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      std::optional<OpeningRow> row = map.row(number, 1 - axis, positions[n]);
      if (!row) continue;
      // Of a hole it is known better than from the nodes of one row.
      if (!opening.through[axis])
        row->centre = copy_near(surfaces.frame(), 1 - axis, opening.centre[1 - axis], row->centre);
      found[n] = measure_section(surfaces, options, axis, positions[n], *row);
    }
  });
  std::vector<OpeningMetrology> sections;
  for (const auto& each : found)
    if (each) sections.push_back(*each);
  if (sections.empty()) return std::nullopt;
  OpeningMetrology result = mean_section(sections, surfaces.frame().spacing);
  result.is_trench = opening.through[0] || opening.through[1];
  result.width = opening.width;
  result.axis = axis;
  return result;
}

/// An opening across y, across x, or both; the same around an axis.
std::vector<OpeningMetrology> measure_both_ways(const WaferSurfaces& surfaces,
                                                const MetrologyOptions& options,
                                                const OpeningMap& map, std::size_t n) {
  const auto [along_x, along_y] = map.openings()[n].through;
  std::vector<OpeningMetrology> found;
  if (along_x && along_y) return found;  // what is left around pillars
  if (!along_x)
    if (auto across_y = measure_opening(surfaces, options, map, n, 1))
      found.push_back(*std::move(across_y));
  if (along_y) return found;
  if (surfaces.frame().is_around_axis()) {
    if (found.empty()) return found;
    found.push_back(found.back());
    found.back().axis = 0;
  } else if (auto across_x = measure_opening(surfaces, options, map, n, 0)) {
    found.push_back(*std::move(across_x));
  }
  return found;
}

std::vector<OpeningMetrology> measure_openings(const WaferSurfaces& surfaces,
                                               const MetrologyOptions& options,
                                               const OpeningMap& map, OpeningNames& names) {
  const std::vector<std::size_t> numbers = names.add(map);
  std::vector<OpeningMetrology> openings;
  for (std::size_t n = 0; n < numbers.size(); ++n) {
    for (OpeningMetrology& each : measure_both_ways(surfaces, options, map, n)) {
      each.opening = static_cast<int>(numbers[n]);
      each.centre = names.known()[numbers[n]].place;
      openings.push_back(std::move(each));
    }
  }
  std::ranges::stable_sort(openings, {}, &OpeningMetrology::opening);
  return openings;
}

/// The opening itself at the start, in a section across the same axis; of one that came later the
/// nearest.
const OpeningMetrology* counterpart(const OpeningMetrology& opening, const Metrology& start,
                                    const Frame& frame) {
  const OpeningMetrology* nearest = nullptr;
  const auto away = [&](const OpeningMetrology& other) {
    const auto along = [&](int axis) {
      return copy_near(frame, axis, other.centre[axis], opening.centre[axis]) -
             opening.centre[axis];
    };
    return std::hypot(along(0), along(1));
  };
  for (const OpeningMetrology& other : start.openings) {
    if (other.axis != opening.axis || other.is_trench != opening.is_trench) continue;
    if (other.opening == opening.opening) return &other;
    if (nearest == nullptr || away(other) < away(*nearest)) nearest = &other;
  }
  return nearest;
}

void compare_with_start(OpeningMetrology& now, const Metrology& start, const Frame& frame) {
  const OpeningMetrology* const then = counterpart(now, start, frame);
  if (then == nullptr) return;
  if (now.lowest_height && then->bottom_height)
    now.etched_depth = *then->bottom_height - *now.lowest_height;
  if (now.mask_thickness && then->mask_thickness)
    now.mask_loss = *then->mask_thickness - *now.mask_thickness;
  now.selectivity = ratio(now.etched_depth, now.mask_loss, least_film * frame.spacing);
}

/// Against the opening with the widest top.
void compare_depths(std::vector<OpeningMetrology>& openings) {
  const OpeningMetrology* widest = nullptr;
  std::set<int> numbers;
  for (const OpeningMetrology& each : openings) {
    if (!each.top_cd || !each.depth) continue;
    numbers.insert(each.opening);
    if (widest == nullptr || *each.top_cd > *widest->top_cd) widest = &each;
  }
  if (numbers.size() < 2) return;
  const double depth = *widest->depth;
  for (OpeningMetrology& each : openings)
    if (each.depth) each.arde_lag = 1 - *each.depth / depth;
}

std::vector<VoidMetrology> measure_voids(const Layers& layers, const OpenGas& gas) {
  const std::vector<TriMesh> surfaces = void_surfaces(layers, gas);
  std::vector<VoidMetrology> voids;
  for (std::size_t n = 0; n < gas.voids.size(); ++n) {
    const Box box = bounding_box(surfaces[n]);
    VoidMetrology found{.centre = 0.5 * (box.lower + box.upper),
                        .lower = gas.voids[n].lower,
                        .upper = gas.voids[n].upper,
                        .volume = gas.voids[n].volume};
    // The solid around it that is missing.
    found.area = -area_above_zero(cross_section(surfaces[n], 1, found.centre.y));
    voids.push_back(found);
  }
  std::ranges::stable_sort(voids, std::ranges::greater{}, &VoidMetrology::volume);
  return voids;
}

}  // namespace

Metrology measure(const Layers& layers, const MetrologyOptions& options, const Metrology* start,
                  const OpeningNames& known) {
  const WaferSurfaces surfaces(layers, options.masks);
  std::vector<const ViewFromAbove*> below;
  for (std::size_t k = 0; k < surfaces.exposed(); ++k) below.push_back(&surfaces.view(k));
  const OpeningMap map(surfaces.view(surfaces.exposed()), layers.frame, below);
  const OpenGas gas = open_gas(layers);

  Metrology found;
  const TriMesh& exposed = surfaces.mesh(surfaces.exposed());
  const Box box = bounding_box(gas.voids.empty() ? exposed : extract_surface(layers, gas));
  found.highest = box.upper.z;
  found.lowest = box.lower.z;
  if (map.openings().empty()) found.surface_roughness = map.height_deviation();
  if (known.known().empty() && start != nullptr) {
    found.names = start->names;
  } else {
    found.names = known;
  }
  found.openings = measure_openings(surfaces, options, map, found.names);
  for (OpeningMetrology& each : found.openings)
    if (start != nullptr) compare_with_start(each, *start, layers.frame);
  compare_depths(found.openings);
  for (const OpeningMetrology& each : found.openings)
    if (each.depth_error)
      found.lowest_error = std::max(found.lowest_error.value_or(0), *each.depth_error);
  found.voids = measure_voids(layers, gas);
  found.volumes = surfaces.volumes();
  return found;
}

}  // namespace scarp

#include "levelset/metrology/metrology.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "core/parallel.h"
#include "levelset/grid/differences.h"
#include "levelset/metrology/bent_lines.h"
#include "levelset/metrology/contour.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/metrology/openings.h"
#include "levelset/metrology/view_from_above.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"

namespace scarp {

namespace {

using Value = std::optional<double>;

constexpr std::array<double, 3> cd_depths{0.1, 0.5, 0.9};  // top, middle, bottom, by the depth
constexpr std::array<double, 2> angle_depths{0.2, 0.8};
constexpr double least_bow = 0.1;     // spacings: less is noise and has no place
constexpr double least_film = 0.01;   // spacings: less has no ratios
constexpr double least_above = 1e-3;  // spacings: less is where two layers have one surface
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

Value mean(Value a, Value b) {
  if (a && b) return 0.5 * (*a + *b);
  return a ? a : b;
}

Value sum(Value a, Value b) { return a && b ? Value(*a + *b) : std::nullopt; }

Value ratio(Value a, Value b, double least) {
  return a && b && *b > least ? Value(*a / *b) : std::nullopt;
}

/// What rounded feet of walls may do to the lowest point and to the micro-trench: half a spacing,
/// and by the width of the floor the more the deeper the micro-trench is that the grid holds, and
/// for one that it has lost. It is no more than the depth.
///
/// Calibrated by ./dev bench feet errors, see docs/levelset.md.
double foot_error(double micro_trench, double depth, double floor_width, double h) {
  constexpr double of_foot = 0.5;
  constexpr double of_micro_trench = 5;
  constexpr double of_spacing = 6;
  const double error =
      h * (of_foot + (of_micro_trench * micro_trench + of_spacing * h) / std::max(floor_width, h));
  return std::min(error, depth);
}

/// The surfaces of all layers, and which of them are the structure's and the mask's.
class WaferSurfaces {
 public:
  WaferSurfaces(const Layers& layers, std::span<const MaterialId> masks) : layers_(layers) {
    for (std::size_t n = 0; n < layers.stack.size(); ++n) {
      if (!adds_material(layers, n)) continue;
      meshes_.push_back(extract_surface(layers.stack[n].phi));
      present_.push_back(n);
    }
    for (const TriMesh& mesh : meshes_) {
      views_.emplace_back(mesh);
      slicers_.emplace_back(mesh);
    }
    structure_ = present_.size() - 1;
    for (std::size_t k = present_.size(); k-- > 1;) {
      if (std::ranges::find(masks, material(k)) == masks.end()) continue;
      if (!top_mask_) top_mask_ = k;
      structure_ = k - 1;
    }
  }

  const Frame& frame() const { return layers_.frame; }

  /// Layers that are there are counted from below.
  std::size_t count() const { return present_.size(); }
  MaterialId material(std::size_t k) const { return layers_.stack[present_[k]].material; }
  const TriMesh& mesh(std::size_t k) const { return meshes_[k]; }
  const LevelSet& phi(std::size_t k) const { return layers_.stack[present_[k]].phi; }
  const Slicer& slicer(std::size_t k) const { return slicers_[k]; }
  const ViewFromAbove& view(std::size_t k) const { return views_[k]; }

  std::size_t exposed() const { return present_.size() - 1; }
  std::size_t structure() const { return structure_; }
  std::optional<std::size_t> top_mask() const { return top_mask_; }

  std::vector<MaterialVolume> volumes() const {
    const std::vector<double> each = material_volumes(meshes_, layers_.frame);
    std::vector<MaterialVolume> volumes;
    for (std::size_t n = 0; n < each.size(); ++n) {
      const MaterialId material = this->material(n);
      const auto same = std::ranges::find(volumes, material, &MaterialVolume::material);
      const MaterialVolume own{.material = material, .volume = each[n], .area = upper_area(n)};
      if (same == volumes.end()) {
        volumes.push_back(own);
      } else {
        same->volume += own.volume;
        same->area += own.area;
      }
    }
    return volumes;
  }

 private:
  /// Where a layer is not there, its surface is that of the one below.
  double upper_area(std::size_t n) const {
    const TriMesh& mesh = meshes_[n];
    const std::vector<double> areas = areas_around(mesh, layers_.frame);
    std::vector<double> own(mesh.vertices.size(), 1);
    if (n > 0) {
      const LevelSet& below = layers_.stack[n - 1].phi;
      std::ranges::transform(mesh.vertices, own.begin(), [&](const Vec3f& r) {
        return below.distance({r.x, r.y, r.z}) > least_above * layers_.frame.spacing ? 1 : 0;
      });
    }
    double sum = 0;
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
      for (const std::uint32_t v : mesh.triangles[f]) sum += areas[f] * own[v] / 3;
    return sum;
  }

  const Layers& layers_;
  std::vector<TriMesh> meshes_;
  std::vector<ViewFromAbove> views_;
  std::vector<Slicer> slicers_;
  std::vector<std::size_t> present_;  ///< in the stack
  std::size_t structure_ = 0;
  std::optional<std::size_t> top_mask_;
};

/// The surface of a layer in the section; field and floor are heights seen from above.
struct SectionCut {
  std::vector<Polyline> lines;
  std::array<double, 2> fields{};
  double field = 0;
  double floor = 0;
  std::optional<Contour> contour{};  ///< if it is deep enough to be called an opening

  double middle() const { return 0.5 * (field + floor); }
};

/// Cuts the surfaces of layers in the section across an axis.
class Slicing {
 public:
  Slicing(const WaferSurfaces& surfaces, int axis, double position, const OpeningRow& row)
      : surfaces_(surfaces), axis_(axis), position_(position), row_(row) {}

  SectionCut cut(std::size_t k) const {
    const Sides sides = surfaces_.frame().sides();
    const int along = 1 - axis_;
    const CutPlane plane =
        CutPlane::across(axis_, just_inside(position_, sides.lower[axis_], sides.upper[axis_]));
    SectionCut cut{
        .lines = with_surroundings(bent(surfaces_.slicer(k).cut(plane), plane, surfaces_.phi(k)),
                                   sides.lower[along], sides.upper[along], sides.boundary[along])};
    cut.fields = {height(k, row_.left_field), height(k, row_.right_field)};
    cut.field = 0.5 * (cut.fields[0] + cut.fields[1]);
    cut.floor = height(k, row_.centre);
    if (is_deep(cut.field - cut.floor, surfaces_.frame().spacing)) {
      cut.contour =
          find_contour(cut.lines, row_.centre, cut.middle(), {row_.left_field, row_.right_field});
    }
    return cut;
  }

 private:
  double height(std::size_t k, double lateral) const {
    const Sides sides = surfaces_.frame().sides();
    std::array<double, 2> place{};
    const int along = 1 - axis_;
    place[axis_] = position_;
    place[along] = lateral;
    const double width = sides.width(along);
    if (sides.boundary[along] == Boundary::periodic) {
      place[along] -= width * std::floor((lateral - sides.lower[along]) / width);
    } else {
      if (place[along] < sides.lower[along]) place[along] = 2 * sides.lower[along] - place[along];
      if (place[along] > sides.upper[along]) place[along] = 2 * sides.upper[along] - place[along];
    }
    const std::optional<SeenPoint> seen = surfaces_.view(k).at(place);
    return seen ? seen->height : 0;
  }

  const WaferSurfaces& surfaces_;
  int axis_;
  double position_;
  const OpeningRow& row_;
};

/// Depth, widths and walls by the contour of a section. field: its height seen from above.
class ShapeMeasurement {
 public:
  ShapeMeasurement(const Contour& contour, double field, bool feet_are_rounded, double h)
      : contour_(contour),
        field_(field),
        depth_(field - contour.lowest()[1]),
        feet_are_rounded_(feet_are_rounded),
        h_(h) {}

  void run(OpeningMetrology& found) const {
    const auto at = [&](double part) { return field_ - part * depth_; };
    const auto cd = [&](double part) {
      const std::optional<Gap> gap = contour_.gap(at(part));
      return gap ? Value(gap->width()) : std::nullopt;
    };
    found.depth = depth_;
    found.top_cd = cd(cd_depths[0]);
    found.middle_cd = cd(cd_depths[1]);
    found.bottom_cd = cd(cd_depths[2]);
    found.aspect_ratio = ratio(depth_, found.top_cd, 0);

    measure_necks(found);
    measure_walls(sample_walls(contour_, at(angle_depths[0]), at(angle_depths[1]), h_), found);
    if (const std::optional<Gap> gap = contour_.gap(at(cd_depths[2]))) {
      const Value floor = contour_.floor(0.5 * (gap->left + gap->right));
      if (floor) found.micro_trenching = *floor - contour_.lowest()[1];
    }
    if (feet_are_rounded_) {
      found.depth_error =
          foot_error(found.micro_trenching.value_or(0), depth_, found.bottom_cd.value_or(0), h_);
      if (found.micro_trenching) found.micro_trenching_error = found.depth_error;
    }
    measure_scallops(found);
  }

 private:
  void measure_necks(OpeningMetrology& found) const {
    // What bulges over the mouth may stand above the field.
    const auto highest = [](std::span<const Contour::Point> side) {
      double top = -1e300;
      for (const Contour::Point& point : side) top = std::max(top, point[1]);
      return top;
    };
    const double top = std::min(highest(contour_.left_side()), highest(contour_.right_side()));
    const double bottom = field_ - cd_depths[2] * depth_;
    if (const auto neck = narrowest(sample_walls(contour_, top, bottom, h_))) {
      found.neck_cd = neck->width;
      found.neck_depth = field_ - neck->height;
    }
    const double from = field_ - cd_depths[0] * depth_;
    const auto bow = widest(sample_walls(contour_, from, field_ - depth_, h_));
    if (!bow || !found.top_cd) return;
    found.bow = std::max(0.0, bow->width - *found.top_cd);
    if (*found.bow >= least_bow * h_) found.bow_depth = field_ - bow->height;
  }

  static void measure_walls(const Walls& walls, OpeningMetrology& found) {
    constexpr double upright = 0.5 * std::numbers::pi;
    const std::optional<WallFit> left = fit_wall(walls.heights, walls.left);
    const std::optional<WallFit> right = fit_wall(walls.heights, walls.right);
    if (!left || !right) return;
    found.left_angle = upright + std::atan(left->slope);
    found.right_angle = upright - std::atan(right->slope);
    found.sidewall_angle = mean(found.left_angle, found.right_angle);
    found.wall_roughness =
        std::sqrt(0.5 * (left->deviation * left->deviation + right->deviation * right->deviation));
  }

  void measure_scallops(OpeningMetrology& found) const {
    const auto at = [&](double part) { return field_ - part * depth_; };
    const auto ripples = [&](std::span<const Contour::Point> wall) {
      return scallops(wall, at(cd_depths[0]), at(cd_depths[2]), h_);
    };
    const std::optional<Scallops> left = ripples(contour_.left_wall(at(cd_depths[2])));
    const std::optional<Scallops> right = ripples(contour_.right_wall(at(cd_depths[2])));
    const auto of = [](const std::optional<Scallops>& each, double Scallops::*member) {
      return each ? Value((*each).*member) : std::nullopt;
    };
    found.scallop_pitch = mean(of(left, &Scallops::pitch), of(right, &Scallops::pitch));
    found.scallop_amplitude = mean(of(left, &Scallops::amplitude), of(right, &Scallops::amplitude));
  }

  const Contour& contour_;
  double field_;
  double depth_;
  bool feet_are_rounded_;
  double h_;
};

Value mean_facet_width(const Contour& contour, double field, double h) {
  const std::span<const Contour::Point> right = contour.right_side();
  const std::vector<Contour::Point> from_above(right.rbegin(), right.rend());
  return mean(facet_width(contour.left_side(), field, h), facet_width(from_above, field, h));
}

// The mesh cuts up to a spacing off the foot of a mask that is undercut, and off the wall below.
// So both are asked further away, and continue from there towards the interface.

/// Widths at the interface between a mask and the walls below it.
class WidthsAtMask {
 public:
  WidthsAtMask(double interface, double h) : interface_(interface), h_(h) {}

  /// Up to a spacing above what was the floor once phi still is the distance to that, and up to two
  /// the mesh knows of it. Thin masks have no other places.
  Value of_mask(const Contour& mask) const {
    const Value far = width(mask, 3);
    if (far) return along_line(width(mask, 2), far, 2, 3);
    return along_line(width(mask, 1.25), width(mask, 2.5), 1.25, 2.5);
  }

  /// By a line, bent as the wall is further down as well. Shallow walls have no place that is
  /// further away both from the mask and from the floor.
  Value below(const Contour& walls) const {
    for (const int first : {2, 1}) {
      std::array<Value, 4> at;
      for (int n = 0; n < 4; ++n) at[n] = width(walls, -first - n);
      if (!at[static_cast<std::size_t>(first)]) continue;
      const Value straight = along_line(at[0], at[1], first, first + 1);
      if (!at[2] || !at[3]) return straight;
      const double upper = *at[0] - 2 * *at[1] + *at[2];
      const double lower = *at[1] - 2 * *at[2] + *at[3];
      return *straight + 0.5 * first * (first + 1) * minmod(upper, lower);
    }
    return width(walls, -0.75);
  }

 private:
  /// How wide an opening is some spacings above an interface.
  Value width(const Contour& contour, double above) const {
    const std::optional<Gap> gap = contour.gap(interface_ + above * h_);
    return gap ? Value(gap->width()) : std::nullopt;
  }

  /// By the line through the widths at two places.
  static Value along_line(Value near, Value far, double away, double further) {
    return near && far ? Value(*near + away / (further - away) * (*near - *far)) : near;
  }

  double interface_;
  double h_;
};

/// Measures one opening in the plane r[axis] = position.
class SectionMeasurement {
 public:
  SectionMeasurement(const WaferSurfaces& surfaces, const MetrologyOptions& options, int axis,
                     double position, const OpeningRow& row)
      : surfaces_(surfaces), options_(options), h_(surfaces.frame().spacing), row_(row) {
    const Slicing slicing(surfaces, axis, position, row_);
    for (std::size_t k = 0; k < surfaces.count(); ++k) cuts_.push_back(slicing.cut(k));
  }

  OpeningMetrology run() const {
    OpeningMetrology found;
    const SectionCut& structure = cuts_[surfaces_.structure()];
    found.bottom_height = structure.floor;
    found.lowest_height = structure.contour ? structure.contour->lowest()[1] : structure.floor;
    if (structure.contour)
      ShapeMeasurement(*structure.contour, structure.field, options_.feet_are_rounded, h_)
          .run(found);
    measure_films(found);
    measure_mask(found);
    const SectionCut& exposed = cuts_.back();
    if (exposed.contour) found.facet_width = mean_facet_width(*exposed.contour, exposed.field, h_);
    for (const double height : options_.cd_heights)
      found.cd_at.push_back(cd_at(height, structure, exposed));
    for (const double height : options_.angle_heights)
      found.angle_at.push_back(angles_at(height, structure, exposed));
    return found;
  }

 private:
  static std::optional<Gap> gap_at(double height, const SectionCut& structure,
                                   const SectionCut& exposed) {
    const SectionCut& cut = height < structure.field ? structure : exposed;
    return cut.contour ? cut.contour->gap(height) : std::nullopt;
  }

  static Value cd_at(double height, const SectionCut& structure, const SectionCut& exposed) {
    const std::optional<Gap> gap = gap_at(height, structure, exposed);
    return gap ? Value(gap->width()) : std::nullopt;
  }

  /// By the walls a spacing above and below: what is nearer to a foot or an edge has no angle.
  std::array<Value, 2> angles_at(double height, const SectionCut& structure,
                                 const SectionCut& exposed) const {
    const std::optional<Gap> lower = gap_at(height - h_, structure, exposed);
    const std::optional<Gap> upper = gap_at(height + h_, structure, exposed);
    if (!lower || !upper) return {};
    return {std::atan2(2 * h_, lower->left - upper->left),
            std::atan2(2 * h_, upper->right - lower->right)};
  }

  /// Between surface k and the one below it.
  FilmMetrology film(std::size_t k) const {
    const SectionCut& upper = cuts_[k];
    const SectionCut& lower = cuts_[k - 1];
    FilmMetrology found{.material = surfaces_.material(k)};
    const std::array<double, 2> sides{row_.left_field, row_.right_field};
    double top = 0;
    for (std::size_t n = 0; n < 2; ++n)
      top += 0.5 * (upper.fields[n] - lower.fields[n] -
                    gas_above(upper.lines, sides[n], lower.fields[n], upper.fields[n]));
    found.top = top;
    found.bottom =
        upper.floor - lower.floor - gas_above(upper.lines, row_.centre, lower.floor, upper.floor);
    if (!upper.contour || !lower.contour) return found;
    const Polyline wall{.points = lower.contour->points()};
    const DistanceToLines below({&wall, 1});
    if (const std::optional<Gap> gap = upper.contour->gap(lower.middle())) {
      found.wall = mean(below({gap->left, lower.middle()}), below({gap->right, lower.middle()}));
    }
    double thinnest = 1e300;
    double thickest = 0;
    for (const Contour::Point& point : upper.contour->points()) {
      const double thickness = below(point);
      thinnest = std::min(thinnest, thickness);
      thickest = std::max(thickest, thickness);
    }
    found.conformality = ratio(thinnest, thickest, least_film * h_);
    return found;
  }

  void measure_films(OpeningMetrology& found) const {
    for (std::size_t k = 1; k < cuts_.size(); ++k) {
      const FilmMetrology each = film(k);
      const auto same = std::ranges::find(found.films, each.material, &FilmMetrology::material);
      if (same == found.films.end()) {
        found.films.push_back(each);
        continue;
      }
      same->top = sum(same->top, each.top);
      same->wall = sum(same->wall, each.wall);
      same->bottom = sum(same->bottom, each.bottom);
      same->conformality = std::nullopt;
    }
  }

  void measure_mask(OpeningMetrology& found) const {
    // Where nothing is left of it there is none; where it only is gone here, it is 0 thick.
    if (!surfaces_.top_mask()) return;
    found.mask_thickness = 0;
    for (const FilmMetrology& film : found.films) {
      if (std::ranges::find(options_.masks, film.material) != options_.masks.end())
        found.mask_thickness = sum(found.mask_thickness, film.top);
    }
    found.undercut = undercut(*surfaces_.top_mask());
  }

  Value undercut(std::size_t top_mask) const {
    const SectionCut& structure = cuts_[surfaces_.structure()];
    if (!structure.contour) return std::nullopt;
    const std::optional<Contour> mask =
        find_contour(cuts_[top_mask].lines, row_.centre, structure.field + 0.5 * h_,
                     {row_.left_field, row_.right_field});
    if (!mask) return std::nullopt;
    const WidthsAtMask widths(structure.field, h_);
    const Value above = widths.of_mask(*mask);
    const Value below = widths.below(*structure.contour);
    if (!above || !below) return std::nullopt;
    return 0.5 * (*below - *above);
  }

  const WaferSurfaces& surfaces_;
  const MetrologyOptions& options_;
  double h_;
  OpeningRow row_;
  std::vector<SectionCut> cuts_;
};

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
      found[n] = SectionMeasurement(surfaces, options, axis, positions[n], *row).run();
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

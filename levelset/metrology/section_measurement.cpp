#include "levelset/metrology/section_measurement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "levelset/grid/differences.h"
#include "levelset/metrology/bent_lines.h"
#include "levelset/metrology/contour.h"

namespace scarp {

namespace {

using Value = std::optional<double>;

constexpr std::array<double, 3> cd_depths{0.1, 0.5, 0.9};  // top, middle, bottom, by the depth
constexpr std::array<double, 2> angle_depths{0.2, 0.8};
constexpr double least_bow = 0.1;  // spacings: less is noise and has no place

Value mean(Value a, Value b) {
  if (a && b) return 0.5 * (*a + *b);
  return a ? a : b;
}

Value sum(Value a, Value b) { return a && b ? Value(*a + *b) : std::nullopt; }

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

}  // namespace

std::optional<double> ratio(std::optional<double> a, std::optional<double> b, double least) {
  return a && b && *b > least ? std::optional(*a / *b) : std::nullopt;
}

OpeningMetrology measure_section(const WaferSurfaces& surfaces, const MetrologyOptions& options,
                                 int axis, double position, const OpeningRow& row) {
  return SectionMeasurement(surfaces, options, axis, position, row).run();
}

}  // namespace scarp

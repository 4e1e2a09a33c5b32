#include "levelset/start/shape_builder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "levelset/grid/welded.h"
#include "levelset/start/covered_axis.h"
#include "levelset/start/mesh_solid.h"

namespace scarp {

Distance round_intersect(Distance a, Distance b, double radius) {
  if (radius == 0) return intersect(a, b);
  a.value += radius;
  b.value += radius;
  Distance both = intersect(a, b);
  both.value -= radius;
  both.bound = both.value;
  return both;
}

namespace {

/// Images of a shape count within this many spacings of it: more than a leaf and the band.
constexpr double image_reach = 16;

constexpr double infinite = std::numeric_limits<double>::infinity();

/// What is no part of a profile is this many spacings away: further than walls are seen.
constexpr double profile_reach = 32;

/// From walls that are nowhere. Units: nm.
constexpr double far_inside = 1e12;

Solid below(double z) {
  return [z](Vec3d r) { return Distance{r.z - z, {0, 0, 1}}; };
}

Solid above(double z) {
  return [z](Vec3d r) { return Distance{z - r.z, {0, 0, -1}}; };
}

/// Between two planes that are width apart at height z; opens upwards by the angle slope on each
/// side. axis is the one across.
Solid slab(int axis, double centre, double width, double z, double slope) {
  return [=, cosine = std::cos(slope), sine = std::sin(slope)](Vec3d r) {
    const double half = 0.5 * width;
    const auto wall = [&](double side) {
      Vec3d normal;
      normal[axis] = side * cosine;
      normal.z = -sine;
      return Distance{(side * (r[axis] - centre) - half) * cosine - (r.z - z) * sine, normal};
    };
    return intersect(wall(-1), wall(1));
  };
}

/// A round cone of the given radius at height z that opens upwards by the angle slope.
Solid cone(std::array<double, 2> centre, double radius, double z, double slope) {
  return [=, cosine = std::cos(slope), sine = std::sin(slope)](Vec3d r) {
    const Vec3d from_axis{r.x - centre[0], r.y - centre[1], 0};
    const double rho = length(from_axis);
    const Vec3d outward = rho > 0 ? from_axis / rho : Vec3d{1, 0, 0};
    return Distance{(rho - radius) * cosine - (r.z - z) * sine,
                    cosine * outward - Vec3d{0, 0, sine}};
  };
}

Solid common(Solid a, Solid b) {
  return [a = std::move(a), b = std::move(b)](Vec3d r) { return intersect(a(r), b(r)); };
}

/// Walls that are tapered from a height on, where they are as wide as upright ones, and upright
/// below it: those of masks and fins over what is not flat.
Solid upright_below(const std::function<Solid(double slope)>& walls, double slope) {
  if (slope == 0) return walls(0);
  return [slope, tapered = walls(slope), upright = walls(0)](Vec3d r) {
    return slope > 0 ? unite(tapered(r), upright(r)) : intersect(tapered(r), upright(r));
  };
}

Solid round_common(Solid a, Solid b, double radius) {
  return [a = std::move(a), b = std::move(b), radius](Vec3d r) {
    return round_intersect(a(r), b(r), radius);
  };
}

/// Copies on a lattice around a centre. They are far enough from each other that the nearest one
/// counts.
Solid repeated(const Repeat& repeat, std::array<double, 2> centre, Solid one) {
  if (repeat.count == std::array{1, 1}) return one;
  return [repeat, centre, one = std::move(one)](Vec3d r) {
    for (int axis = 0; axis < 2; ++axis) {
      if (repeat.count[axis] == 1) continue;
      const double middle = 0.5 * (repeat.count[axis] - 1);
      const double nearest = std::round((r[axis] - centre[axis]) / repeat.pitch[axis] + middle);
      r[axis] -= (std::clamp(nearest, 0.0, 2 * middle) - middle) * repeat.pitch[axis];
    }
    return one(r);
  };
}

Solid outside(Solid a) {
  return [a = std::move(a)](Vec3d r) { return complement(a(r)); };
}

/// Where a shape lies along x and y; infinite where it goes on for ever.
struct Extent {
  std::array<double, 2> lower{-infinite, -infinite};
  std::array<double, 2> upper{infinite, infinite};

  void set(int axis, double centre, double half) {
    lower[axis] = centre - half;
    upper[axis] = centre + half;
  }
  bool is_infinite(int axis) const { return upper[axis] == infinite; }
};

/// The half of what a shape and its copies take along an axis. growth: of a wall, by its taper.
double half_extent(double width, const Repeat& repeat, int axis, double growth) {
  return 0.5 * width + 0.5 * (repeat.count[axis] - 1) * repeat.pitch[axis] + growth;
}

Extent extent_of_slab(int axis, double centre, double width, const Repeat& repeat, double growth) {
  Extent extent;
  extent.set(axis, centre, half_extent(width, repeat, axis, growth));
  return extent;
}

Extent extent_of_box(std::array<double, 2> centre, std::array<double, 2> size, const Repeat& repeat,
                     double growth) {
  Extent extent;
  for (int axis = 0; axis < 2; ++axis) {
    extent.set(axis, centre[axis], half_extent(size[axis], repeat, axis, growth));
  }
  return extent;
}

/// The shape together with its copies beyond periodic sides, wherever they reach.
Solid with_copies(const Frame& frame, int axis, const Extent& extent, Solid shape) {
  const double reach = image_reach * frame.spacing;
  return [axis, width = frame.sides().width(axis), lower = extent.lower[axis] - reach,
          upper = extent.upper[axis] + reach, shape = std::move(shape)](Vec3d r) {
    Distance all = shape(r);
    const double last = std::floor((upper - r[axis]) / width);
    for (double n = std::ceil((lower - r[axis]) / width); n <= last; ++n) {
      if (n == 0) continue;
      Vec3d copy = r;
      copy[axis] += n * width;
      all = unite(all, shape(copy));
    }
    return all;
  };
}

/// The shape, whose centre is in the domain, together with its mirror images: beyond the sides, to
/// where nodes are.
Solid with_mirror_images(const Frame& frame, int axis, Solid shape) {
  return [axis, sides = frame.sides(), reach = image_reach * frame.spacing,
          shape = std::move(shape)](Vec3d r) {
    Distance all = shape(r);
    for (const double wall : {sides.lower[axis], sides.upper[axis]}) {
      if (std::abs(r[axis] - wall) > reach) continue;
      Vec3d image = r;
      image[axis] = 2 * wall - r[axis];
      Distance seen = shape(image);
      seen.normal[axis] *= -1;
      all = unite(all, seen);
    }
    return all;
  };
}

/// The shape together with what the domain sides make of it.
Solid with_images(const Frame& frame, const Extent& extent, Solid shape) {
  for (int axis = 0; axis < 2; ++axis) {
    if (extent.is_infinite(axis)) continue;
    shape = frame.boundary[axis] == Boundary::periodic
                ? with_copies(frame, axis, extent, std::move(shape))
                : with_mirror_images(frame, axis, std::move(shape));
  }
  return shape;
}

}  // namespace

Solid outline_solid(const Frame& frame, const Outline& outline, const WallHeights& heights) {
  const double z = heights.foot;
  const double slope = heights.slope;
  const double wider = std::abs((heights.top - heights.foot) * std::tan(slope));
  if (const auto* polygon = std::get_if<PolygonOutline>(&outline)) {
    const double growth = (heights.top - heights.foot) * std::tan(slope);
    const auto walls =
        std::make_shared<const PolygonWalls>(frame, domain_loops(frame, *polygon, growth), heights);
    return [walls](Vec3d r) { return (*walls)(r); };
  }
  if (const auto* slot = std::get_if<SlotOutline>(&outline)) {
    const auto walls = [&](double by) {
      return slab(1 - slot->along, slot->centre, slot->width, z, by);
    };
    return with_images(
        frame, extent_of_slab(1 - slot->along, slot->centre, slot->width, slot->repeat, wider),
        repeated(slot->repeat, {slot->centre, slot->centre}, upright_below(walls, slope)));
  }
  if (const auto* circle = std::get_if<CircleOutline>(&outline)) {
    const auto walls = [&](double by) { return cone(circle->centre, circle->radius, z, by); };
    const double width = 2 * circle->radius;
    return with_images(frame, extent_of_box(circle->centre, {width, width}, circle->repeat, wider),
                       repeated(circle->repeat, circle->centre, upright_below(walls, slope)));
  }
  const auto& box = std::get<RectangleOutline>(outline);
  if (const auto along = covered_axis(frame, box, (heights.top - heights.foot) * std::tan(slope))) {
    const int across = 1 - *along;
    return outline_solid(frame,
                         SlotOutline{.width = box.size[across],
                                     .centre = box.centre[across],
                                     .along = *along,
                                     .repeat = box.repeat},
                         heights);
  }
  const auto walls = [&](double by) {
    return round_common(slab(0, box.centre[0], box.size[0], z, by),
                        slab(1, box.centre[1], box.size[1], z, by), box.corner_radius);
  };
  return with_images(frame, extent_of_box(box.centre, box.size, box.repeat, wider),
                     repeated(box.repeat, box.centre, upright_below(walls, slope)));
}

std::array<double, 2> heights_of(const ProfileShape& shape) {
  std::array<double, 2> heights{infinite, -infinite};
  for (const Loop& loop : shape.loops) {
    for (const Point2& r : loop) heights = {std::min(heights[0], r[1]), std::max(heights[1], r[1])};
  }
  return heights;
}

std::vector<Loop> closed_profile(const ProfileShape& shape, double end) {
  std::vector<Loop> loops = shape.loops;
  if (!shape.is_line) return loops;
  loops[0].push_back({loops[0].back()[0], end});
  loops[0].push_back({loops[0].front()[0], end});
  return loops;
}

std::vector<Loop> in_period(const Frame& frame, const ProfileShape& shape,
                            std::vector<Loop> loops) {
  if (!shape.is_line || frame.boundary[0] != Boundary::periodic) return loops;
  const Sides sides = frame.sides();
  const auto [lower, upper] = heights_of({.loops = loops});
  loops = region_grid(frame).clipped(
      loops,
      box_loop({sides.lower[0], lower - frame.spacing}, {sides.upper[0], upper + frame.spacing}),
      RegionGrid::Fill::even_odd);
  // Ends that differ by rounding alone make no wall.
  const double same = 1e-3 * frame.spacing;
  for (Loop& loop : loops)
    for (Point2& r : loop) {
      if (r[0] < sides.upper[0] - same) continue;
      for (const Loop& other : loops)
        for (const Point2& there : other)
          if (there[0] <= sides.lower[0] + same && std::abs(there[1] - r[1]) < same)
            r[1] = there[1];
    }
  return loops;
}

Frame profile_frame(const Frame& frame, const std::vector<Loop>& loops) {
  double highest = 0;
  for (const Loop& loop : loops)
    for (const Point2& r : loop) highest = std::max(highest, std::abs(r[1]));
  Frame plane = frame;
  plane.two_dimensional = false;
  plane.cells[1] = 2 * static_cast<int>(std::ceil(highest / frame.spacing) + profile_reach);
  plane.boundary[1] = Boundary::reflective;
  return plane;
}

Solid profile_solid(const Frame& frame, const ProfileShape& shape, double end) {
  const std::vector<Loop> loops = in_period(frame, shape, closed_profile(shape, end));
  const Frame plane = profile_frame(frame, loops);
  // Walls over the profile laid flat, looked at half way up, far from where they end.
  const double high = profile_reach * frame.spacing;
  const auto walls = std::make_shared<const PolygonWalls>(
      plane, domain_loops(plane, {loops}),
      WallHeights{.foot = -high, .top = high, .lowest = -high, .slope = 0});
  return [walls](Vec3d r) {
    const Distance found = (*walls)({r.x, r.z, 0});
    // Far from all walls there is no direction: upwards, as walls have it.
    if (found.normal.x == 0 && found.normal.y == 0) return Distance{found.value, {0, 0, 1}};
    return Distance{found.value, {found.normal.x, 0, found.normal.y}};
  };
}

namespace {

/// Adds shapes to a target, and cuts them out of it.
class Builder {
 public:
  Builder(const Frame& frame, double enough, ShapeTarget& target)
      : frame_(frame), enough_(enough), stack_(target) {}

  void apply(const WaferShape& shape) { stack_.grow(shape.material, 0, below(0)); }

  void apply(const LayerShape& shape) {
    const double top = stack_.highest() + shape.thickness;
    stack_.grow(shape.material, top, below(top));
  }

  void apply(const StackShape& shape) {
    for (int n = 0; n < shape.count; ++n) {
      for (const LayerShape& layer : shape.layers) apply(layer);
    }
  }

  void apply(const TrenchShape& shape) {
    const double z = cut_from(shape.cut);
    if (shape.is_everywhere) {
      cut(shape.cut, z, {}, [](Vec3d) { return Distance{-far_inside, {1, 0, 0}}; });
      return;
    }
    const int across = 1 - shape.along;
    const Solid walls = slab(across, shape.centre, shape.width, z, shape.cut.taper);
    cut(shape.cut, z,
        extent_of_slab(across, shape.centre, shape.width, shape.repeat, growth_of(shape.cut, z)),
        repeated(shape.repeat, {shape.centre, shape.centre}, walls));
  }

  void apply(const HoleShape& shape) {
    const double z = cut_from(shape.cut);
    const Solid walls = cone(shape.centre, shape.radius, z, shape.cut.taper);
    const double width = 2 * shape.radius;
    cut(shape.cut, z,
        extent_of_box(shape.centre, {width, width}, shape.repeat, growth_of(shape.cut, z)),
        repeated(shape.repeat, shape.centre, walls));
  }

  void apply(const FinShape& shape) {
    const double foot = stack_.highest();
    const auto walls = [&](double slope) {
      return slab(1 - shape.along, shape.centre, shape.width, foot, slope);
    };
    Solid ridge =
        repeated(shape.repeat, {shape.centre, shape.centre}, upright_below(walls, -shape.taper));
    const double wider = std::abs(shape.height * std::tan(shape.taper));
    stack_.grow(
        shape.material, foot + shape.height,
        with_images(frame_,
                    extent_of_slab(1 - shape.along, shape.centre, shape.width, shape.repeat, wider),
                    common(std::move(ridge), below(foot + shape.height))));
  }

  void apply(const MaskShape& shape) {
    const double foot = stack_.highest();
    const double top = foot + shape.thickness;
    const bool opening = shape.outlines == MaskShape::Outlines::opening;
    Solid outline = outline_solid(frame_, shape.outline,
                                  {.foot = foot,
                                   .top = top,
                                   .lowest = std::min(foot, stack_.lower()),
                                   .slope = opening ? shape.taper : -shape.taper});
    Solid stays = opening ? outside(std::move(outline)) : std::move(outline);
    stack_.grow(shape.material, top,
                [enough = enough_, slab = below(top), stays = std::move(stays)](Vec3d r) {
                  const Distance from_slab = slab(r);
                  return from_slab.value > enough ? from_slab : intersect(from_slab, stays(r));
                });
  }

  void apply(const MeshShape& shape) {
    const TriMesh mesh = welded(*shape.mesh);
    const Box box = bounding_box(mesh);
    stack_.reach_down_to(box.lower.z);
    Solid solid = [body = std::make_shared<const MeshSolid>(mesh)](Vec3d r) { return (*body)(r); };
    const bool is_patch = mesh_border(mesh) > 0;
    const Extent extent{{box.lower.x, box.lower.y}, {box.upper.x, box.upper.y}};
    for (int axis = 0; axis < 2 && !is_patch; ++axis) {
      if (frame_.boundary[axis] == Boundary::periodic) {
        solid = with_copies(frame_, axis, extent, std::move(solid));
      }
    }
    if (shape.material) {
      stack_.grow(*shape.material, box.upper.z, std::move(solid));
    } else {
      stack_.cut_run(0, stack_.layer_count() - 1,
                     is_patch ? outside(std::move(solid)) : std::move(solid), 0);
    }
  }

  void apply(const ProfileShape& shape) {
    const auto [lower, upper] = heights_of(shape);
    stack_.reach_down_to(lower);
    const double far = profile_reach * frame_.spacing;
    const double end = shape.material ? std::min(lower, stack_.lower()) - far
                                      : std::max(upper, stack_.upper()) + far;
    Solid solid = profile_solid(frame_, shape, end);
    if (shape.material) {
      stack_.grow(*shape.material, upper, std::move(solid));
    } else {
      stack_.cut_run(0, stack_.layer_count() - 1, solid, 0);
    }
  }

 private:
  double cut_from(const Cut& cut) const {
    if (cut.depth_from) {
      return stack_.top_of(*cut.depth_from);
    }
    double z = cut.through.empty() ? stack_.highest() : -1e300;
    for (const MaterialId material : cut.through) {
      z = std::max(z, stack_.top_of(material));
    }
    return z;
  }

  /// How much wider than at height z a cut is anywhere in the solid.
  double growth_of(const Cut& cut, double z) const {
    return std::abs(std::tan(cut.taper)) * std::max(cut.depth, stack_.upper() - z);
  }

  void cut(const Cut& cut, double z, const Extent& extent, Solid walls) {
    stack_.reach_down_to(z - cut.depth);
    const Solid gone = with_images(
        frame_, extent, round_common(std::move(walls), above(z - cut.depth), cut.bottom_radius));
    const auto is_cut = [&](std::size_t layer) {
      return cut.through.empty() || std::find(cut.through.begin(), cut.through.end(),
                                              stack_.material(layer)) != cut.through.end();
    };
    // Runs of neighbouring layers that are cut, from the top down.
    for (std::size_t end = stack_.layer_count(); end > 0;) {
      if (!is_cut(end - 1)) {
        --end;
        continue;
      }
      std::size_t first = end - 1;
      while (first > 0 && is_cut(first - 1)) {
        --first;
      }
      stack_.cut_run(first, end - 1, gone, cut.top_radius);
      end = first;
    }
  }

  const Frame& frame_;
  double enough_;
  ShapeTarget& stack_;
};

}  // namespace

void apply_shape(const Frame& frame, double enough, const Shape& shape, ShapeTarget& target) {
  Builder builder(frame, enough, target);
  std::visit([&](const auto& each) { builder.apply(each); }, shape);
}

}  // namespace scarp

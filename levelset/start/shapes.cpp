#include "levelset/start/shapes.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>
#include <set>

#include "core/error.h"
#include "core/recipe/quantity.h"
#include "levelset/grid/distance.h"
#include "levelset/grid/welded.h"
#include "levelset/start/mesh_solid.h"
#include "levelset/start/polygon_walls.h"
#include "levelset/start/sheets.h"

namespace scarp {

namespace {

using Solid = std::function<Distance(Vec3d)>;

/// Images of a shape count within this many spacings of it: more than a leaf and the band.
constexpr double image_reach = 16;

constexpr double infinite = std::numeric_limits<double>::infinity();

/// How far the distance to a composed solid may be above its bound: that to an edge of 60 degrees.
constexpr double most_overestimate = 2;

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

/// Distance to the common part with its edge rounded: that of the parts shrunk by the radius, grown
/// again.
Distance round_intersect(Distance a, Distance b, double radius) {
  if (radius == 0) return intersect(a, b);
  a.value += radius;
  b.value += radius;
  Distance both = intersect(a, b);
  both.value -= radius;
  both.bound = both.value;
  return both;
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

/// The region under and between the walls of a mask, images beyond the sides included.
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
  const auto walls = [&](double by) {
    return round_common(slab(0, box.centre[0], box.size[0], z, by),
                        slab(1, box.centre[1], box.size[1], z, by), box.corner_radius);
  };
  return with_images(frame, extent_of_box(box.centre, box.size, box.repeat, wider),
                     repeated(box.repeat, box.centre, upright_below(walls, slope)));
}

/// The stack as it is built: what to do at a point, in order, and how high every layer reaches.
class SolidStack {
 public:
  /// What is further from a surface than this is far from it.
  explicit SolidStack(double enough) : enough_(enough) {}

  /// Adds solid; it joins the top layer if that is of the same material.
  void grow(MaterialId material, double top, Solid solid) {
    upper_ = std::max(upper_, top);
    const bool joins = !parts_.empty() && parts_.back().material == material;
    if (joins) {
      parts_.back().top = std::max(parts_.back().top, top);
    } else {
      parts_.push_back({.material = material, .top = top});
    }
    operations_.push_back([joins, enough = enough_, solid = std::move(solid)](Vec3d r,
                                                                              Stack& stack) {
      std::vector<Distance>& all = stack.all;
      const bool is_deep = !all.empty() && std::max(all.back().value, all.back().bound) < -enough;
      if (is_deep && stack.beneath.empty()) {
        if (!joins) all.push_back(all.back());
        return;
      }
      const Distance added = solid(r);
      const std::size_t layer = all.size() - (joins ? 1 : 0);
      for (Beneath& beneath : stack.beneath) {
        if (beneath.layer >= layer) continue;
        beneath.solid = intersect(beneath.solid, unite(all[beneath.layer], complement(added)));
      }
      if (joins) {
        all.back() = unite(all.back(), added);
      } else {
        all.push_back(all.empty() ? added : unite(all.back(), added));
      }
    });
    parts_.back().operation_count = operations_.size();
  }

  /// Removes what is in gone from the materials first..last: layers below stay, layers above lose
  /// only what is no material of their own. The radius is that of the top layer's edges around the
  /// mouth.
  void cut_run(std::size_t first, std::size_t last, const Solid& gone, double radius) {
    if (last + 1 < parts_.size()) roofed_.insert(last);
    operations_.push_back([=](Vec3d r, Stack& stack) {
      std::vector<Distance>& all = stack.all;
      const Distance open = gone(r);
      for (std::size_t layer = all.size(); layer-- > first;) {
        const Distance hole = layer <= last ? open : intersect(open, stack.solid_beneath(last));
        const bool is_top = layer + 1 == all.size();
        all[layer] = round_intersect(all[layer], complement(hole), is_top ? radius : 0);
        if (radius > 0 && !is_top) all[layer] = intersect(all[layer], all.back());
        if (first > 0) {
          all[layer] = unite(all[layer], all[first - 1]);
        }
      }
    });
    for (std::size_t n = first; n < parts_.size(); ++n) {
      parts_[n].operation_count = operations_.size();
    }
  }

  double highest() const {
    double z = 0;
    for (const Part& part : parts_) {
      z = std::max(z, part.top);
    }
    return z;
  }

  double top_of(MaterialId material) const {
    double z = 0;
    for (const Part& part : parts_) {
      z = part.material == material ? part.top : z;
    }
    return z;
  }

  std::size_t layer_count() const { return parts_.size(); }
  MaterialId material(std::size_t layer) const { return parts_[layer].material; }
  /// Of all that was added, cut or not.
  double upper() const { return upper_; }
  double lower() const { return lower_; }
  /// Something of the surface lies there.
  void reach_down_to(double z) { lower_ = std::min(lower_, z); }

  /// Of all so far; there is some.
  Distance solid_at(Vec3d r) const {
    Stack stack;
    for (const std::size_t layer : roofed_) stack.beneath.push_back({.layer = layer});
    for (const Operation& operation : operations_) operation(r, stack);
    return stack.all.back();
  }
  Layers build(const Frame& frame) const;

 private:
  struct Part {
    MaterialId material = 0;
    double top = 0;
    std::size_t operation_count = 0;  ///< later ones do not change its layer
  };
  /// All but what was added above a layer; what was cut from there since is not counted.
  struct Beneath {
    std::size_t layer = 0;
    Distance solid{.value = -1e300, .normal = {}};
  };
  /// What is known at a point.
  struct Stack {
    std::vector<Distance> all;     ///< of each layer and those below it
    std::vector<Beneath> beneath;  ///< of the layers that are cut under others

    const Distance& solid_beneath(std::size_t layer) const {
      return std::find_if(beneath.begin(), beneath.end(),
                          [&](const Beneath& b) { return b.layer == layer; })
          ->solid;
    }
  };
  using Operation = std::function<void(Vec3d, Stack&)>;

  double enough_;
  std::vector<Part> parts_;
  std::vector<Operation> operations_;
  std::set<std::size_t> roofed_;  ///< layers that are cut under others
  double lower_ = 0;
  double upper_ = 0;
};

/// Adds shapes to a stack, and cuts them out of it.
class Builder {
 public:
  /// shapes: those that are going to be applied.
  Builder(const Frame& frame, std::span<const Shape> shapes)
      : frame_(frame), enough_(enough_for(frame, shapes)), stack_(enough_) {}

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

  Layers build() const { return stack_.build(frame_); }
  const SolidStack& stack() const { return stack_; }

 private:
  /// What is further from a surface than this is far from it, whatever is cut and rounded after.
  static double enough_for(const Frame& frame, std::span<const Shape> shapes) {
    double enough = (LevelSet::half_width + 10 * dilation) * frame.spacing;
    for (const Shape& shape : shapes) {
      if (const auto* trench = std::get_if<TrenchShape>(&shape)) enough += trench->cut.top_radius;
      if (const auto* hole = std::get_if<HoleShape>(&shape)) enough += hole->cut.top_radius;
    }
    return enough;
  }

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

  Frame frame_;
  double enough_;
  SolidStack stack_;
};

Layers SolidStack::build(const Frame& frame) const {
  Layers layers{.frame = frame, .stack = {}};
  const double margin = LevelSet::half_width * frame.spacing;
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    const auto distance = [&](Vec3d r) {
      thread_local Stack stack;
      stack.all.clear();
      stack.beneath.clear();
      for (const std::size_t layer : roofed_) stack.beneath.push_back({.layer = layer});
      for (std::size_t n = 0; n < parts_[k].operation_count; ++n) operations_[n](r, stack);
      const Distance& solid = stack.all[k];
      const double limit = most_overestimate * std::abs(solid.bound);
      return std::clamp(solid.value, -limit, limit) - dilation * frame.spacing;
    };
    LevelSet phi(frame, distance, lower_ - margin, upper_ + margin, most_overestimate);
    remove_sheets(phi);
    layers.stack.push_back({parts_[k].material, std::move(phi)});
  }
  // Distances to edges differ from layer to layer: phi of a layer is at least that of the next one.
  for (std::size_t n = layers.stack.size(); n-- > 1;) {
    scarp::cut(layers.stack[n - 1].phi, layers.stack[n].phi);
  }
  return layers;
}

/// Places on and in a body of a mesh.
class BodyPlaces {
 public:
  BodyPlaces(const Frame& frame, const TriMesh& body) : frame_(frame), body_(body) {
    const std::vector<double> areas = facet_areas(body);
    const double area = std::accumulate(areas.begin(), areas.end(), 0.0);
    step_ = std::max(frame.spacing, std::sqrt(area / most_places));
  }

  /// Whether visit(r) is true somewhere within the domain.
  template <class Visit>
  bool any(const Visit& visit) const {
    return any_on_surface(visit) || (mesh_border(body_) == 0 && any_inside(visit));
  }

 private:
  static constexpr double most_places = 50000;

  /// How many places along each size, a step apart, or fewer along the longest where they would be
  /// too many together.
  template <std::size_t n>
  static std::array<int, n> counts(const std::array<double, n>& sizes, double step) {
    std::array<double, n> count{};
    std::ranges::transform(sizes, count.begin(),
                           [&](double size) { return std::max(1.0, std::ceil(size / step)); });
    const auto product = [&] {
      return std::accumulate(count.begin(), count.end(), 1.0, std::multiplies<>());
    };
    while (product() > 2 * most_places) {
      double& longest = *std::ranges::max_element(count);
      longest = std::max(1.0, std::floor(0.5 * longest));
    }
    std::array<int, n> whole{};
    std::ranges::transform(count, whole.begin(),
                           [](double each) { return static_cast<int>(each); });
    return whole;
  }

  /// Where a place comes to lie within the domain; false if it is left out.
  bool moves_inside(Vec3d& r) const {
    const Sides sides = frame_.sides();
    for (int axis = 0; axis < 2; ++axis) {
      if (frame_.boundary[axis] == Boundary::periodic) {
        const double width = sides.width(axis);
        r[axis] -= width * std::floor((r[axis] - sides.lower[axis]) / width);
      } else if (r[axis] < sides.lower[axis] || r[axis] > sides.upper[axis]) {
        return false;
      }
    }
    return true;
  }

  template <class Visit>
  bool any_on_surface(const Visit& visit) const {
    const std::size_t stride = 1 + body_.triangles.size() / static_cast<std::size_t>(most_places);
    for (std::size_t f = 0; f < body_.triangles.size(); f += stride) {
      const auto [a, b, c] = corners(body_, f);
      const auto [across, along] = counts(std::array{length(b - a), length(c - a)}, step_);
      for (int i = 0; i < across; ++i) {
        for (int j = 0; j < along; ++j) {
          const double u = (i + 1.0 / 3) / across;
          const double v = (j + 1.0 / 3) / along;
          if (u + v >= 1) break;
          Vec3d r = a + u * (b - a) + v * (c - a);
          if (moves_inside(r) && visit(r)) return true;
        }
      }
    }
    return false;
  }

  /// What surrounds a void, or solid, may touch nothing else.
  template <class Visit>
  bool any_inside(const Visit& visit) const {
    Box box = bounding_box(body_);
    const Sides sides = frame_.sides();
    for (int axis = 0; axis < 2; ++axis) {
      if (frame_.boundary[axis] == Boundary::periodic) continue;
      box.lower[axis] = std::max(box.lower[axis], sides.lower[axis]);
      box.upper[axis] = std::min(box.upper[axis], sides.upper[axis]);
      if (box.lower[axis] > box.upper[axis]) return false;
    }
    const Vec3d size = box.upper - box.lower;
    const double step = std::max(frame_.spacing, std::cbrt(size.x * size.y * size.z / most_places));
    const auto count = counts(std::array{size.x, size.y, size.z}, step);
    const MeshSolid solid(body_);
    for (int i = 0; i < count[0]; ++i) {
      for (int j = 0; j < count[1]; ++j) {
        for (int k = 0; k < count[2]; ++k) {
          Vec3d r = box.lower + Vec3d{(i + 0.5) / count[0] * size.x, (j + 0.5) / count[1] * size.y,
                                      (k + 0.5) / count[2] * size.z};
          if (solid(r).value < 0 && moves_inside(r) && visit(r)) return true;
        }
      }
    }
    return false;
  }

  Frame frame_;
  const TriMesh& body_;
  double step_ = 0;
};

}  // namespace

std::vector<ShapeProblem> idle_bodies(const Frame& frame, std::span<const Shape> shapes) {
  constexpr double flush = 0.01;  // spacings
  std::vector<ShapeProblem> problems;
  Builder builder(frame, shapes);
  const auto look_at = [&](std::size_t shape, const MeshShape& mesh) {
    const TriMesh whole = welded(*mesh.mesh);
    const std::vector<TriMesh> parts =
        mesh_border(whole) > 0 ? std::vector{whole} : separate_parts(whole);
    for (const TriMesh& body : parts) {
      const double side = mesh.material ? 1 : -1;
      const auto changes = [&](Vec3d r) {
        return side * builder.stack().solid_at(r).value > flush * frame.spacing;
      };
      if (BodyPlaces(frame, body).any(changes)) continue;
      const Box box = bounding_box(body);
      const std::string place = rounded_place(0.5 * (box.lower + box.upper)) + " nm";
      problems.push_back(
          {.shape = shape,
           .key = "file",
           .message = mesh.material
                          ? "the body around " + place +
                                " lies wholly in solid and adds nothing; to have it in place of "
                                "that solid, put a mesh of the same file with cut = true before it"
                          : "the body around " + place +
                                " lies wholly in the open and cuts "
                                "nothing"});
    }
  };
  // What comes after the last mesh is not needed, and outlines of many shapes are costly.
  std::size_t count = shapes.size();
  while (count > 0 && !std::holds_alternative<MeshShape>(shapes[count - 1])) --count;
  for (std::size_t n = 0; n < count; ++n) {
    if (const auto* mesh = std::get_if<MeshShape>(&shapes[n]);
        mesh && builder.stack().layer_count() > 0) {
      look_at(n, *mesh);
    }
    std::visit([&](const auto& s) { builder.apply(s); }, shapes[n]);
  }
  return problems;
}

Layers build_layers(const Frame& frame, std::span<const Shape> shapes) {
  const std::vector<ShapeProblem> problems = check_shapes(frame, shapes);
  if (!problems.empty()) {
    const ShapeProblem& first = problems.front();
    throw InputError("geometry[" + std::to_string(first.shape) + "]." + first.key + ": " +
                     first.message);
  }
  Builder builder(frame, shapes);
  for (const Shape& shape : shapes) {
    std::visit([&](const auto& s) { builder.apply(s); }, shape);
  }
  return builder.build();
}

}  // namespace scarp

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
#include "levelset/grid/welded.h"
#include "levelset/start/mesh_solid.h"
#include "levelset/start/shape_builder.h"
#include "levelset/start/sheets.h"

namespace scarp {

namespace {

/// The stack as it is built: what to do at a point, in order, and how high every layer reaches.
class SolidStack : public ShapeTarget {
 public:
  /// What is further from a surface than this is far from it.
  explicit SolidStack(double enough) : enough_(enough) {}

  /// Adds solid; it joins the top layer if that is of the same material.
  void grow(MaterialId material, double top, Solid solid) override {
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
  void cut_run(std::size_t first, std::size_t last, const Solid& gone, double radius) override {
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

  double highest() const override {
    double z = 0;
    for (const Part& part : parts_) {
      z = std::max(z, part.top);
    }
    return z;
  }

  double top_of(MaterialId material) const override {
    double z = 0;
    for (const Part& part : parts_) {
      z = part.material == material ? part.top : z;
    }
    return z;
  }

  std::size_t layer_count() const override { return parts_.size(); }
  MaterialId material(std::size_t layer) const override { return parts_[layer].material; }
  /// Of all that was added, cut or not.
  double upper() const override { return upper_; }
  double lower() const override { return lower_; }
  /// Something of the surface lies there.
  void reach_down_to(double z) override { lower_ = std::min(lower_, z); }

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

/// What is further from a surface than this is far from it, whatever is cut and rounded after.
double enough_for(const Frame& frame, std::span<const Shape> shapes) {
  double enough = (LevelSet::half_width + 10 * dilation) * frame.spacing;
  for (const Shape& shape : shapes) {
    if (const auto* trench = std::get_if<TrenchShape>(&shape)) enough += trench->cut.top_radius;
    if (const auto* hole = std::get_if<HoleShape>(&shape)) enough += hole->cut.top_radius;
  }
  return enough;
}

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
  const double enough = enough_for(frame, shapes);
  SolidStack stack(enough);
  const auto look_at = [&](std::size_t shape, const MeshShape& mesh) {
    const TriMesh whole = welded(*mesh.mesh);
    const std::vector<TriMesh> parts =
        mesh_border(whole) > 0 ? std::vector{whole} : separate_parts(whole);
    for (const TriMesh& body : parts) {
      const double side = mesh.material ? 1 : -1;
      const auto changes = [&](Vec3d r) {
        return side * stack.solid_at(r).value > flush * frame.spacing;
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
    if (const auto* mesh = std::get_if<MeshShape>(&shapes[n]); mesh && stack.layer_count() > 0) {
      look_at(n, *mesh);
    }
    apply_shape(frame, enough, shapes[n], stack);
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
  const double enough = enough_for(frame, shapes);
  SolidStack stack(enough);
  for (const Shape& shape : shapes) apply_shape(frame, enough, shape, stack);
  return stack.build(frame);
}

}  // namespace scarp

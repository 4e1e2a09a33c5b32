// Start geometries put together at random, against a model that asks of single points what the
// shapes, one after the other, make of them: nothing in it is a distance.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <sstream>
#include <utility>
#include <variant>
#include <vector>

#include "core/random.h"
#include "levelset/operations/layer_steps.h"
#include "levelset/start/shapes.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

using Material = std::optional<MaterialId>;  // none: gas

constexpr double width = 60;  // of the domain, in spacings

/// What a list of shapes says of a point of a cross-section between mirrors.
class PointModel {
 public:
  explicit PointModel(std::vector<Shape> shapes) : shapes_(std::move(shapes)) {
    for (const Shape& shape : shapes_) levels_.push_back(level_of(shape));
  }

  Material at(double x, double z) const {
    Material found;
    for (std::size_t k = 0; k < shapes_.size(); ++k) apply(shapes_[k], levels_[k], x, z, found);
    return found;
  }

 private:
  // The top of each material that was put on, the uppermost last.
  using Tops = std::vector<std::pair<MaterialId, double>>;

  double highest() const {
    double z = 0;
    for (const auto& [material, top] : tops_) z = std::max(z, top);
    return z;
  }
  double top_of(MaterialId wanted) const {
    double z = 0;
    for (const auto& [material, top] : tops_)
      if (material == wanted) z = top;
    return z;
  }
  void grow(MaterialId material, double top) {
    if (tops_.empty() || tops_.back().first != material) tops_.emplace_back(material, top);
    tops_.back().second = std::max(tops_.back().second, top);
  }

  // The height that a shape's own heights are measured from.
  double level_of(const Shape& shape) {
    const double floor = highest();
    if (const auto* layer = std::get_if<LayerShape>(&shape)) {
      grow(layer->material, floor + layer->thickness);
    } else if (const auto* fin = std::get_if<FinShape>(&shape)) {
      grow(fin->material, floor + fin->height);
    } else if (const auto* mask = std::get_if<MaskShape>(&shape)) {
      grow(mask->material, floor + mask->thickness);
    } else if (const auto* trench = std::get_if<TrenchShape>(&shape)) {
      if (trench->cut.depth_from) return top_of(*trench->cut.depth_from);
      if (trench->cut.through.empty()) return floor;
      double top = top_of(trench->cut.through.front());
      for (const MaterialId material : trench->cut.through) top = std::max(top, top_of(material));
      return top;
    } else {
      grow(std::get<WaferShape>(shape).material, 0);
    }
    return floor;
  }

  // The least distance along x to a centre or its mirror images.
  static double from_centre(double x, double centre) {
    return std::min(
        {std::abs(x - centre), std::abs(-width - x - centre), std::abs(width - x - centre)});
  }

  static void apply(const Shape& shape, double level, double x, double z, Material& found) {
    const auto fill = [&](MaterialId material, bool is_inside) {
      if (!found && is_inside) found = material;
    };
    if (const auto* wafer = std::get_if<WaferShape>(&shape)) {
      fill(wafer->material, z < 0);
    } else if (const auto* layer = std::get_if<LayerShape>(&shape)) {
      fill(layer->material, z < level + layer->thickness);
    } else if (const auto* fin = std::get_if<FinShape>(&shape)) {
      const double half = fin->width / 2 - std::max(z - level, 0.0) * std::tan(fin->taper);
      fill(fin->material, z < level + fin->height && from_centre(x, fin->centre) < half);
    } else if (const auto* mask = std::get_if<MaskShape>(&shape)) {
      const auto& slot = std::get<SlotOutline>(mask->outline);
      const bool is_opening = mask->outlines == MaskShape::Outlines::opening;
      const double wider = std::max(z - level, 0.0) * std::tan(mask->taper);
      const double half = slot.width / 2 + (is_opening ? wider : -wider);
      const bool is_in_outline = from_centre(x, slot.centre) < half;
      fill(mask->material, z < level + mask->thickness && is_in_outline != is_opening);
    } else if (const auto* trench = std::get_if<TrenchShape>(&shape)) {
      const Cut& cut = trench->cut;
      const double half = trench->width / 2 + (z - level) * std::tan(cut.taper);
      const bool is_cut = found && (cut.through.empty() ||
                                    std::ranges::find(cut.through, *found) != cut.through.end());
      if (is_cut && z > level - cut.depth && from_centre(x, trench->centre) < half) found.reset();
    }
  }

  std::vector<Shape> shapes_;
  Tops tops_;
  std::vector<double> levels_;
};

/// Numbers on the nodes of the grid, as recipes like them, or anywhere between.
class RandomShapes {
 public:
  RandomShapes(std::uint64_t seed, bool on_nodes) : random_({.seed = seed}), on_nodes_(on_nodes) {}

  std::vector<Shape> stack() {
    used_ = {0};
    std::vector<Shape> shapes{WaferShape{}};
    const int count = 3 + below(5);
    for (int k = 0; k < count; ++k) shapes.push_back(k == 0 ? layer() : any());
    TrenchShape slot{.width = between(14, 44), .centre = near_centre(10)};
    slot.cut = {.depth = between(4, 30), .through = {one_of_used()}};
    shapes.emplace_back(slot);
    return shapes;
  }

 private:
  int below(int count) { return static_cast<int>(random_.uniform() * count); }
  bool one_in(int count) { return below(count) == 0; }
  double between(double least, double most) {
    const double any = least + random_.uniform() * (most - least);
    return on_nodes_ ? 2 * std::floor(any / 2) : any;
  }
  double near_centre(double most) { return one_in(2) ? between(-most, most) : 0; }
  double taper(double degrees) {
    const int which = below(4);
    return which < 2 ? 0 : (which == 2 ? degrees : -degrees) * std::numbers::pi / 180;
  }
  MaterialId new_material() {
    used_.push_back(static_cast<MaterialId>(1 + below(5)));
    return used_.back();
  }
  MaterialId one_of_used() {
    return used_[static_cast<std::size_t>(below(static_cast<int>(used_.size())))];
  }

  Shape layer() { return LayerShape{.material = new_material(), .thickness = between(5, 12)}; }
  Shape any() {
    const int which = below(20);
    if (which < 6) return layer();
    if (which < 9) {
      const SlotOutline opening{.width = between(8, 30), .centre = near_centre(10)};
      return MaskShape{.material = new_material(),
                       .thickness = between(5, 10),
                       .taper = taper(5),
                       .outline = opening};
    }
    if (which < 11) {
      return FinShape{.material = new_material(),
                      .width = between(6, 16),
                      .height = between(5, 12),
                      .centre = near_centre(14),
                      .taper = one_in(3) ? 0.08 : 0};
    }
    TrenchShape trench{.width = between(8, 30), .centre = near_centre(10)};
    trench.cut = {.depth = between(6, 30), .taper = taper(4)};
    if (which >= 15) trench.cut.through = {one_of_used()};
    return trench;
  }

  RandomStream random_;
  bool on_nodes_;
  std::vector<MaterialId> used_;
};

std::string shown(const std::vector<Shape>& shapes) {
  std::ostringstream text;
  for (const Shape& shape : shapes) {
    if (const auto* layer = std::get_if<LayerShape>(&shape))
      text << "layer " << +layer->material << " of " << layer->thickness;
    if (const auto* fin = std::get_if<FinShape>(&shape))
      text << "fin " << +fin->material << ' ' << fin->width << " x " << fin->height << " at "
           << fin->centre << " taper " << fin->taper;
    if (const auto* mask = std::get_if<MaskShape>(&shape))
      text << "mask " << +mask->material << " of " << mask->thickness << " open "
           << std::get<SlotOutline>(mask->outline).width << " at "
           << std::get<SlotOutline>(mask->outline).centre << " taper " << mask->taper;
    if (const auto* trench = std::get_if<TrenchShape>(&shape)) {
      text << "trench " << trench->width << " x " << trench->cut.depth << " at " << trench->centre
           << " taper " << trench->cut.taper << " through";
      for (const MaterialId material : trench->cut.through) text << ' ' << +material;
    }
    text << "; ";
  }
  return text.str();
}

Material material_at(const Layers& layers, Vec3d r) {
  for (const Layer& layer : layers.stack)
    if (layer.phi.distance(r) < 0) return layer.material;
  return {};
}

class SlowRandomStarts : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  // Calls use(r, material) for points around which all is the same for some spacings, by the model.
  template <class Use>
  void for_each_point(double radius, const Use& use) const {
    constexpr int directions = 16;
    for (double x = 0.25 - width / 2; x < width / 2; x += 0.5) {
      for (double z = -35.25; z < 85; z += 0.5) {
        const Material here = model_.at(x, z);
        bool is_same = true;
        for (double part = 0.25; part <= 1 && is_same; part += 0.25) {
          for (int d = 0; d < directions && is_same; ++d) {
            const double angle = 2 * std::numbers::pi * d / directions;
            const double there = x + part * radius * std::cos(angle);
            is_same = model_.at(there, z + part * radius * std::sin(angle)) == here;
          }
        }
        if (is_same) use(Vec3d{x, 0, z}, here);
      }
    }
  }

  static Frame section() {
    Frame frame{.spacing = 1, .cells = {static_cast<int>(width), 1}};
    frame.two_dimensional = true;
    return frame;
  }

  // Of what is thinner than a spacing, and of corners, the grid keeps less.
  static constexpr double room = 0.8;

  // The first that are a geometry: now and then a taper closes an opening.
  static std::vector<Shape> acceptable() {
    RandomShapes random(GetParam(), GetParam() % 2 == 0);
    std::vector<Shape> shapes = random.stack();
    while (!check_shapes(section(), shapes).empty()) shapes = random.stack();
    return shapes;
  }

  std::vector<Shape> shapes_ = acceptable();
  PointModel model_{shapes_};
};

TEST_P(SlowRandomStarts, AreWhatTheirShapesSayAtEveryPoint) {
  const Layers layers = build_layers(section(), shapes_);
  int wrong = 0;
  for_each_point(room, [&](Vec3d r, const Material& expected) {
    if (material_at(layers, r) != expected && ++wrong == 1)
      ADD_FAILURE() << r.x << ' ' << r.z << " in " << shown(shapes_);
  });
  EXPECT_EQ(wrong, 0);
}

// A film is nowhere but on walls, and an etch opens nothing but what is next to them: a surface
// amid gas or solid would tell.
TEST_P(SlowRandomStarts, HaveNoSurfaceAmidGasOrSolid) {
  constexpr double thickness = 0.5;
  Layers coated = build_layers(section(), shapes_);
  Layers etched = build_layers(section(), shapes_);
  add_layer(coated, 9);
  coat(coated, thickness);
  move(etched, thickness, thickness, [](Vec3d, MaterialId) { return -1.0; });
  int wrong = 0;
  for_each_point(room + thickness, [&](Vec3d r, const Material& expected) {
    const double phi = (expected ? etched : coated).top().distance(r);
    if ((phi < 0) != expected.has_value() && ++wrong == 1)
      ADD_FAILURE() << (expected ? "etched " : "coated ") << r.x << ' ' << r.z << " in "
                    << shown(shapes_);
  });
  EXPECT_EQ(wrong, 0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, SlowRandomStarts, ::testing::Range<std::uint64_t>(1, 61));

}  // namespace
}  // namespace scarp

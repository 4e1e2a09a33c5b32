#include "levelset/operations/placed_shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "levelset/operations/layer_sets.h"
#include "levelset/operations/layer_steps.h"
#include "levelset/start/shape_builder.h"

namespace scarp {

namespace {

double margin_of(const Frame& frame) { return LevelSet::half_width * frame.spacing; }

double lowest_of(const Layers& layers) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Layer& layer : layers.stack) lowest = std::min(lowest, layer.phi.lower());
  return lowest;
}

/// A solid as a level set; it has to end below upper.
LevelSet sampled(const Frame& frame, const Solid& solid, double lower, double upper) {
  const double margin = margin_of(frame);
  const auto distance = [&](Vec3d r) {
    const Distance found = solid(r);
    const double limit = most_overestimate * std::abs(found.bound);
    return std::clamp(found.value, -limit, limit) - dilation * frame.spacing;
  };
  return {frame, distance, lower - margin, upper + margin, most_overestimate};
}

/// The solid up to a lid far above the layers.
LevelSet sampled_under_lid(const Layers& layers, const Solid& solid) {
  const double lid = layers.top().upper() + 4 * margin_of(layers.frame);
  const auto below_lid = [&](Vec3d r) { return intersect(solid(r), {r.z - lid, {0, 0, 1}}); };
  return sampled(layers.frame, below_lid, lowest_of(layers), lid);
}

/// Layers on a grid, to which shapes are applied.
class GridStack : public ShapeTarget {
 public:
  explicit GridStack(Layers& layers) : layers_(layers), lower_(lowest_of(layers)) {}

  std::size_t layer_count() const override { return layers_.stack.size(); }
  MaterialId material(std::size_t layer) const override { return layers_.stack[layer].material; }
  double highest() const override { return flat(highest_point(layers_)); }
  double top_of(MaterialId material) const override {
    return flat(highest_point(layers_, material));
  }
  double upper() const override { return layers_.top().upper(); }
  double lower() const override { return lower_; }
  void reach_down_to(double z) override { lower_ = std::min(lower_, z); }

  void grow(MaterialId material, double top, Solid solid) override {
    const LevelSet added = sampled(layers_.frame, solid, lower_, top);
    add_layer(layers_, material);
    fill_gas(layers_, added);
  }

  void cut_run(std::size_t first, std::size_t last, const Solid& gone, double radius) override {
    SCARP_ASSERT(radius, ==, 0.0);
    const LevelSet kept = sampled_under_lid(layers_, [&](Vec3d r) { return complement(gone(r)); });
    take_away(layers_, first, last, &kept);
  }

 private:
  /// The surface of solid lies above where it was meant, see dilation.
  double flat(double z) const { return z - dilation * layers_.frame.spacing; }

  Layers& layers_;
  double lower_;
};

}  // namespace

Ground ground_of(const Layers& layers) {
  Ground ground{.lowest = lowest_of(layers), .highest = layers.top().upper()};
  for (const Layer& layer : layers.stack) ground.materials.push_back(layer.material);
  return ground;
}

void place_shapes(Layers& layers, std::span<const Shape> shapes) {
  const double enough = (LevelSet::half_width + 10 * dilation) * layers.frame.spacing;
  for (const Shape& shape : shapes) {
    GridStack stack(layers);
    apply_shape(layers.frame, enough, shape, stack);
  }
}

LevelSet outline_columns(const Layers& layers, const Outline& outline, MaskShape::Outlines kind) {
  const double lower = lowest_of(layers);
  const Solid within =
      outline_solid(layers.frame, outline,
                    {.foot = lower, .top = layers.top().upper(), .lowest = lower, .slope = 0});
  return sampled_under_lid(layers, [&](Vec3d r) {
    return kind == MaskShape::Outlines::resist ? within(r) : complement(within(r));
  });
}

}  // namespace scarp

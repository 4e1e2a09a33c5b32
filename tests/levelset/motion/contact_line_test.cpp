#include "levelset/motion/contact_line.h"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "levelset/start/shapes.h"

namespace scarp {
namespace {

/// The wall of a mask at x = 5.5, and a film above it.
Layers walled(MaterialId film) {
  Frame frame{.spacing = 1, .cells = {40, 1}};
  frame.two_dimensional = true;
  Layers layers = build_layers(
      frame,
      std::vector<Shape>{
          WaferShape{.material = 0},
          MaskShape{.material = 1, .thickness = 12, .outline = SlotOutline{.width = 2 * 5.5}}});
  add_layer(layers, 2);
  add_layer(layers, film);
  return layers;
}

constexpr Node beside{25, 0, 6};  // x = 5
constexpr Node away{20, 0, 6};    // in the middle

/// What a film gets whose normal leans from the wall by 45 degrees, straight away from it or not.
struct Rates {
  float wall = 0;
  float flat = 0;      ///< of a surface straight away from the wall
  float slanting = 1;  ///< of all others
};

std::optional<float> speed(const Rates& rates, Vec3d normal, const Node& node = beside,
                           MaterialId film = 2) {
  const Layers layers = walled(film);
  const std::size_t top = layers.stack.size() - 1;
  return speed_at_contact_line(layers, node, top, normalized(normal),
                               [&](std::size_t layer, const Vec3d& n) {
                                 if (layer != top) return rates.wall;
                                 return n.z > 0.99 ? rates.flat : rates.slanting;
                               });
}

constexpr Vec3d from_wall{-1, 0, 1};

TEST(ContactLine, AFilmClimbsAWallAsFastAsFlatBesideIt) {
  EXPECT_EQ(speed({.flat = 0.5F}, from_wall), 0.5F);
  EXPECT_EQ(speed({.flat = 3}, from_wall), 1.0F);  // no faster than by its own slope
  EXPECT_EQ(speed({.flat = -2}, from_wall), 0.0F);
}

TEST(ContactLine, ElsewhereTheFilmHasItsOwnSpeed) {
  EXPECT_EQ(speed({}, from_wall, away), std::nullopt);
  EXPECT_EQ(speed({}, {1, 0, 1}), std::nullopt);                // it leans towards the wall,
  EXPECT_EQ(speed({}, {-1, 0, 0.1}), std::nullopt);             // lies on it,
  EXPECT_EQ(speed({.slanting = -1}, from_wall), std::nullopt);  // or is taken off
  EXPECT_EQ(speed({.wall = -0.2F}, from_wall), std::nullopt);   // a wall that moves is none,
  EXPECT_EQ(speed({}, from_wall, beside, 1), std::nullopt);     // nor is one of the same material
}

}  // namespace
}  // namespace scarp

#pragma once

#include <vector>

#include "levelset/operations/layer_steps.h"
#include "tests/levelset/surfaces.h"

namespace scarp {

/// A thin film and a thick one in a tapered trench that a side of the domain cuts: of 40 cells.
inline Layers trench_with_films(const Frame& frame) {
  Layers layers = build_layers(
      frame, std::vector<Shape>{
                 WaferShape{},
                 TrenchShape{.width = 16.3, .centre = 14, .cut = {.depth = 21.4, .taper = 0.05}}});
  add_layer(layers, 1);
  coat(layers, 0.4);
  add_layer(layers, 2);
  coat(layers, 2.3);
  return layers;
}

inline Layers mask_over_undercut_silicon(const Frame& frame) {
  Layers layers = build_layers(
      frame, std::vector<Shape>{WaferShape{}, MaskShape{.material = 1,
                                                        .thickness = 5.2,
                                                        .outline = CircleOutline{.radius = 7.3}}});
  move(layers, 6.1, 0.5, [](Vec3d, MaterialId material) { return material == 0 ? -1.0 : 0.0; });
  return layers;
}

/// A trench that is narrow at its top, under a film that has closed there.
inline Layers void_under_a_film(const Frame& frame) {
  Layers layers = build_layers(
      frame, std::vector<Shape>{
                 WaferShape{},
                 TrenchShape{.width = 8.4, .centre = 1.3, .cut = {.depth = 20, .taper = -0.2}}});
  add_layer(layers, 1);
  coat(layers, 4.9);
  return layers;
}

/// Films of one material above and below another one, etched back to the first again in places.
inline Layers films_etched_through(const Frame& frame) {
  Layers layers = build_layers(
      frame, std::vector<Shape>{WaferShape{}, HoleShape{.radius = 9.1, .cut = {.depth = 14.6}}});
  add_layer(layers, 1);
  coat(layers, 1.2);
  add_layer(layers, 2);
  coat(layers, 0.9);
  add_layer(layers, 1);
  coat(layers, 0.7);
  planarise(layers, 1.6);
  move(layers, 2.1, 0.4, [](Vec3d r, MaterialId) { return r.x > 0 ? -1.0 : 0.0; });
  return layers;
}

}  // namespace scarp

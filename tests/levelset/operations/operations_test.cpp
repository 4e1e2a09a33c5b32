// What acts on layers at once: shapes on what is there, fills, strips, films on some materials.

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "core/parallel.h"
#include "core/random.h"
#include "levelset/grid/band.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/operations/coat_on.h"
#include "levelset/operations/fill.h"
#include "levelset/operations/layer_steps.h"
#include "levelset/operations/placed_shapes.h"
#include "levelset/operations/strip.h"
#include "levelset/surface/connectivity.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

constexpr MaterialId si = 0;
constexpr MaterialId oxide = 1;
constexpr MaterialId resist = 2;
constexpr MaterialId metal = 3;
constexpr MaterialId nitride = 4;

Frame section_frame(int cells) {
  Frame frame{.spacing = 1, .cells = {cells, 1}};
  frame.two_dimensional = true;
  return frame;
}

Frame box_frame() {
  return {.spacing = 1, .cells = {48, 40}, .boundary = {Boundary::periodic, Boundary::reflective}};
}

Shape trench_at(double centre, double width, double depth) {
  TrenchShape shape{.width = width, .centre = centre};
  shape.cut.depth = depth;
  return shape;
}

Shape slot_mask(double centre, double width, double thickness,
                MaskShape::Outlines kind = MaskShape::Outlines::opening) {
  return MaskShape{.material = resist,
                   .thickness = thickness,
                   .outlines = kind,
                   .outline = SlotOutline{.width = width, .centre = centre}};
}

std::map<MaterialId, double> volumes(const Layers& layers) {
  const std::vector<double> of_layers = material_volumes(layers);
  std::map<MaterialId, double> volumes;
  for (std::size_t n = 0; n < of_layers.size(); ++n)
    volumes[layers.stack[n].material] += of_layers[n];
  return volumes;
}

bool is_next_to_surface(const Band& band, const Node& node) {
  const bool is_solid = band.node(node[0], node[1], node[2]) < 0;
  for (int face = 0; face < 6; ++face) {
    Node other = node;
    other[static_cast<std::size_t>(face / 2)] += face % 2 == 0 ? -1 : 1;
    if ((band.node(other[0], other[1], other[2]) < 0) != is_solid) return true;
  }
  return false;
}

/// How far phi of the tops differ at nodes next to the surface. Units: spacings.
double largest_difference(const Layers& a, const Layers& b) {
  double largest = 0;
  for (const Leaf& leaf : a.top().band().leaves())
    for (int offset = 0; offset < leaf_size; ++offset) {
      const Node at = node_at(leaf, offset);
      if (at[0] > a.frame.cells[0] || at[1] > a.frame.cells[1]) continue;
      if (!is_next_to_surface(a.top().band(), at)) continue;
      largest = std::max(largest, std::abs(static_cast<double>(leaf.phi[offset]) -
                                           static_cast<double>(b.top().node(at[0], at[1], at[2]))));
    }
  return largest;
}

Layers placed(const Frame& frame, std::vector<Shape> base, const std::vector<Shape>& more) {
  Layers layers = build_layers(frame, base);
  place_shapes(layers, more);
  return layers;
}

Layers built(const Frame& frame, std::vector<Shape> base, const std::vector<Shape>& more) {
  base.insert(base.end(), more.begin(), more.end());
  return build_layers(frame, base);
}

// A shape on layers is what it is in a start geometry.
TEST(PlacedShapes, AreThoseOfAStartGeometry) {
  MaskShape holes{.material = resist, .thickness = 7.3};
  holes.outline = CircleOutline{.radius = 8.2, .centre = {3, -2}};
  HoleShape hole{.radius = 6.1, .centre = {-4, 3}};
  hole.cut = {.depth = 11.4, .taper = 0.05};
  TrenchShape through = std::get<TrenchShape>(trench_at(4.3, 12.2, 9));
  through.cut.through = {oxide};
  const std::vector<Shape> base{WaferShape{.material = si},
                                LayerShape{.material = oxide, .thickness = 6.4}};
  const std::vector<std::vector<Shape>> lists{
      {holes},
      {slot_mask(2.2, 14.4, 8.2)},
      {slot_mask(0, 14.4, 8.2, MaskShape::Outlines::resist)},
      {FinShape{.material = metal, .width = 9.3, .height = 12, .centre = 1.5}},
      {LayerShape{.material = metal, .thickness = 3.7}},
      {trench_at(3.3, 11.7, 13.2)},
      {hole},
      {through},
      {slot_mask(0, 20.4, 8.2), through, LayerShape{.material = metal, .thickness = 4}}};
  for (const Frame& frame : {box_frame(), section_frame(48)}) {
    for (std::size_t n = 0; n < lists.size(); ++n) {
      if (frame.is_section() && (n == 0 || n == 6)) continue;
      SCOPED_TRACE(n);
      const Layers there = placed(frame, base, lists[n]);
      const Layers here = built(frame, base, lists[n]);
      ASSERT_TRUE(check_shapes_on(frame, lists[n], ground_of(build_layers(frame, base))).empty());
      ASSERT_EQ(there.stack.size(), here.stack.size());
      // Edges that two surfaces make are known to some hundredths of a spacing on a grid.
      EXPECT_LT(largest_difference(there, here), 0.1);
      const auto expected = volumes(here);
      for (const auto& [material, volume] : volumes(there))
        EXPECT_NEAR(volume, expected.at(material), 1e-3 * std::abs(expected.at(material)) + 0.5)
            << material;
    }
  }
}

TEST(PlacedShapes, LeaveTheRestToTheBit) {
  const std::vector<Shape> base{WaferShape{.material = si}, trench_at(-10, 8, 12)};
  Layers layers = build_layers(section_frame(60), base);
  const std::uint64_t wafer = layers.top().hash();
  place_shapes(layers, std::vector<Shape>{slot_mask(12, 14, 8)});
  EXPECT_EQ(layers.stack[0].phi.hash(), wafer);
}

TEST(PlacedShapes, OfAPlanarMaskFillATrenchAndKeepVoids) {
  Layers layers = build_layers(
      section_frame(60), std::vector<Shape>{WaferShape{.material = si}, trench_at(-10, 8, 20)});
  const std::vector<double> before = material_volumes(layers);
  place_shapes(layers, std::vector<Shape>{slot_mask(15, 12, 6)});
  EXPECT_NEAR(volumes(layers)[resist], 6 * (60 - 12) + 8 * 20, 0.2);
  EXPECT_NEAR(volumes(layers)[si], before[0], 1e-9);
  EXPECT_NEAR(highest_point(layers), 6.001, 1e-3);

  const double radius = 6.3;
  Layers with_void = single_layer(
      section_frame(60),
      [&](Vec3d r) { return std::max(r.z - 0.2, radius - std::hypot(r.x, r.z + 12)); }, -24, 4);
  const OpenGas gas = open_gas(with_void);
  ASSERT_EQ(gas.voids.size(), 1U);
  place_shapes(with_void, std::vector<Shape>{slot_mask(15, 12, 6)});
  const OpenGas after = open_gas(with_void);
  ASSERT_EQ(after.voids.size(), 1U);
  EXPECT_EQ(after.voids[0].volume, gas.voids[0].volume);
}

TEST(Strip, OfAMaskLeavesWhatWasThere) {
  const std::vector<Shape> base{WaferShape{.material = si},
                                LayerShape{.material = oxide, .thickness = 6.4},
                                trench_at(-10, 8, 20)};
  for (const bool buried : {false, true}) {
    Layers layers = build_layers(section_frame(60), base);
    const Layers before = layers.copy();
    place_shapes(layers, std::vector<Shape>{slot_mask(15, 12, 9)});
    strip(layers, resist, buried);
    remove_empty_layers(layers);
    ASSERT_EQ(layers.stack.size(), 2U);
    EXPECT_LT(largest_difference(layers, before), 1e-6);
    EXPECT_LT(largest_difference(before, layers), 1e-6);
    EXPECT_EQ(volumes(layers), volumes(before));
  }
}

TEST(Strip, LeavesWhatIsBuriedUnlessAsked) {
  // Oxide under a cap of metal over one half of the wafer; the other half is open to the gas.
  const std::vector<Shape> base{WaferShape{.material = si},
                                LayerShape{.material = oxide, .thickness = 8}};
  const auto capped = [&] {
    Layers layers = build_layers(section_frame(60), base);
    place_shapes(layers, std::vector<Shape>{trench_at(0, 10, 8)});
    add_layer(layers, metal);
    coat(layers, 4);
    return layers;
  };
  Layers layers = capped();
  const std::uint64_t before = hash(layers);
  strip(layers, oxide, false);
  EXPECT_EQ(hash(layers), before);
  strip(layers, oxide, true);
  remove_empty_layers(layers);
  EXPECT_EQ(volumes(layers).count(oxide), 0U);
  EXPECT_NEAR(volumes(layers)[metal], volumes(capped())[metal], 0.5);
  EXPECT_FALSE(open_gas(layers).voids.empty());
}

// From an opening in its cover the gas reaches all of a film, under the cover as well; what the
// film held is free then.
TEST(Strip, GoesUnderACover) {
  Layers layers = build_layers(
      section_frame(60),
      std::vector<Shape>{WaferShape{.material = si}, LayerShape{.material = oxide, .thickness = 8},
                         LayerShape{.material = metal, .thickness = 5}});
  TrenchShape opening{.width = 10, .centre = 4};
  opening.cut = {.depth = 5};
  place_shapes(layers, std::vector<Shape>{opening});
  strip(layers, oxide, false);
  // Edges on a grid lack up to a third of a spacing squared each.
  EXPECT_NEAR(volumes(layers)[metal], 5 * 50, 4.0 / 3);
  const std::vector<Region> islands = remove_islands(layers);
  double removed = 0;
  for (const Region& island : islands) removed += island.volume;
  EXPECT_NEAR(removed, 5 * 50, 4.0 / 3);
  remove_empty_layers(layers);
  ASSERT_EQ(layers.stack.size(), 1U);
  EXPECT_NEAR(highest_point(layers), 0.001, 1e-3);
}

// A film between the nodes protects what lies below it, whatever its place.
TEST(Strip, DoesNotPassAFilmThinnerThanASpacing) {
  for (const double thick : {0.05, 0.3, 0.8}) {
    for (int n = 0; n < 5; ++n) {
      const double below = 6 + 0.2 * n;
      Layers layers = build_layers(
          section_frame(40), std::vector<Shape>{WaferShape{.material = si},
                                                LayerShape{.material = oxide, .thickness = below},
                                                LayerShape{.material = metal, .thickness = thick},
                                                LayerShape{.material = oxide, .thickness = 7}});
      strip(layers, oxide, false);
      remove_empty_layers(layers);
      SCOPED_TRACE(testing::Message() << thick << " nm on " << below << " nm");
      EXPECT_NEAR(volumes(layers)[oxide], below * 40, 1e-3 * below * 40);
      EXPECT_NEAR(volumes(layers)[metal], thick * 40, 0.01 * thick * 40);
      EXPECT_NEAR(highest_point(layers), below + thick + 0.001, 2e-3);
    }
  }
}

// What stands on a film that no node lies in is parted from the wafer: it does not become of the
// material above, wherever its sides lie between the nodes.
TEST(Strip, OfAFilmThinnerThanASpacingFreesWhatStandsOnIt) {
  for (const double below : {0.0, 0.3, 0.75}) {
    for (const double thick : {0.05, 0.2, 0.5, 0.9, 1.3}) {
      std::vector<Shape> base{WaferShape{.material = si}};
      if (below > 0) base.push_back(LayerShape{.material = metal, .thickness = below});
      base.push_back(LayerShape{.material = oxide, .thickness = thick});
      Layers before = build_layers(section_frame(40), base);
      place_shapes(before, std::vector<Shape>{slot_mask(0, 20, 4.2, MaskShape::Outlines::resist)});
      auto expected = volumes(before);
      ASSERT_NEAR(expected[resist], 20 * 4.2, 0.5);
      for (const bool keep_free : {false, true}) {
        SCOPED_TRACE(testing::Message() << thick << " on " << below << ' ' << keep_free);
        Layers layers = before.copy();
        strip(layers, oxide, true, keep_free);
        remove_empty_layers(layers);
        EXPECT_EQ(volumes(layers).count(oxide), 0U);
        if (keep_free) {
          // The edges on both sides of the gap lack a spacing squared each at most.
          EXPECT_NEAR(volumes(layers)[resist], expected[resist], 2);
          EXPECT_LE(volumes(layers)[resist], expected[resist] + 1e-3);
        }
        remove_islands(layers);
        remove_empty_layers(layers);
        if (!keep_free) {
          EXPECT_NEAR(volumes(layers)[resist], 0, 0.02);
          EXPECT_NEAR(highest_point(layers), below + 0.001, 2e-3);
        }
        EXPECT_NEAR(volumes(layers)[metal], expected[metal], 1e-3);
        EXPECT_NEAR(volumes(layers)[si], expected[si], 1e-3);
      }
    }
  }
}

// Metal in a lined trench falls out with the liner, however thin that is.
TEST(Strip, OfALinerFreesWhatItHolds) {
  for (const double thick : {0.1, 0.4, 0.8, 1.0, 1.1, 1.2, 1.3, 1.4, 1.7}) {
    Layers layers = build_layers(
        section_frame(40), std::vector<Shape>{WaferShape{.material = si}, trench_at(0.3, 12, 10)});
    const double wafer = volumes(layers)[si];
    add_layer(layers, oxide);
    coat(layers, thick);
    add_layer(layers, metal);
    fill(layers, thick + 2);
    planarise(layers, 0.001);
    SCOPED_TRACE(thick);
    ASSERT_GT(volumes(layers)[metal], 70);
    strip(layers, oxide, true);
    remove_islands(layers);
    EXPECT_NEAR(volumes(layers)[metal], 0, 0.02);
    EXPECT_NEAR(volumes(layers)[si], wafer, 0.2);
  }
}

// A liner that is exposed edge-on alone, between two other materials, goes wherever it passes
// between nodes, and what it held stays but for the edges of the gap.
TEST(Strip, OfAThinLinerReachesItAtItsEdge) {
  for (const double thick : {0.05, 0.4, 0.6, 0.8, 1.0})
    for (const double centre : {0.0, 0.26, 0.5, 0.72})
      for (const double taper : {0.0, 0.15}) {
        SCOPED_TRACE(testing::Message() << thick << ' ' << centre << ' ' << taper);
        TrenchShape trench{.width = 14, .centre = centre};
        trench.cut = {.depth = 12, .taper = taper};
        Layers layers =
            build_layers(section_frame(40), std::vector<Shape>{WaferShape{.material = si}, trench});
        add_layer(layers, nitride);
        coat(layers, thick);
        add_layer(layers, metal);
        fill(layers, 4);
        planarise(layers, -1.001);
        auto expected = volumes(layers);
        ASSERT_GT(expected[nitride], 30 * thick);
        strip(layers, nitride, false, true);
        EXPECT_NEAR(volumes(layers)[nitride], 0, 0.25);
        EXPECT_NEAR(volumes(layers)[metal], expected[metal], 20);
        EXPECT_NEAR(volumes(layers)[si], expected[si], 0.2);
      }
}

TEST(Strip, OfAThinLinerReachesItAroundAHole) {
  for (const double thick : {0.4, 0.7})
    for (const double centre : {0.0, 0.33, 0.5}) {
      SCOPED_TRACE(testing::Message() << thick << ' ' << centre);
      HoleShape hole{.radius = 6.2, .centre = {centre, 0.2}};
      hole.cut = {.depth = 7};
      Layers layers =
          build_layers(box_frame(), std::vector<Shape>{WaferShape{.material = si}, hole});
      add_layer(layers, nitride);
      coat(layers, thick);
      add_layer(layers, metal);
      fill(layers, 3);
      planarise(layers, -1.001);
      ASSERT_GT(volumes(layers)[nitride], 20);
      strip(layers, nitride, false);
      remove_empty_layers(layers);
      EXPECT_EQ(volumes(layers).count(nitride), 0U);
    }
}

// But not under a film of another material, thinner than a spacing, that covers its edge.
TEST(Strip, OfAThinLinerDoesNotReachACoveredEdge) {
  for (const double centre : {0.0, 0.26, 0.5, 0.72}) {
    SCOPED_TRACE(centre);
    Layers layers = build_layers(section_frame(40), std::vector<Shape>{WaferShape{.material = si},
                                                                       trench_at(centre, 14, 12)});
    add_layer(layers, nitride);
    coat(layers, 0.6);
    add_layer(layers, metal);
    fill(layers, 4);
    planarise(layers, -1.001);
    add_layer(layers, oxide);
    coat(layers, 0.4);
    const std::uint64_t before = hash(layers);
    strip(layers, nitride, false);
    EXPECT_EQ(hash(layers), before);
  }
}

// A beam that stands on the wafer elsewhere stays over the gap, which is as wide as the film was.
TEST(Strip, OfAFilmThinnerThanASpacingLeavesAGapUnderABeam) {
  for (const double thick : {0.2, 0.4, 0.8}) {
    Layers layers = build_layers(section_frame(60), std::vector<Shape>{WaferShape{.material = si}});
    place_shapes(layers, std::vector<Shape>{slot_mask(0, 10.4, 5, MaskShape::Outlines::resist)});
    add_layer(layers, oxide);
    fill(layers, thick + 0.001);
    strip(layers, resist, false);
    remove_empty_layers(layers);
    add_layer(layers, metal);
    fill(layers, 4);
    auto expected = volumes(layers);
    SCOPED_TRACE(thick);
    strip(layers, oxide, true);
    remove_empty_layers(layers);
    EXPECT_TRUE(remove_islands(layers).empty());
    EXPECT_EQ(volumes(layers).count(oxide), 0U);
    // At its two ends the gap is known to some spacings.
    EXPECT_NEAR(volumes(layers)[metal], expected[metal], 2 * 2.5 * thick);
    const OpenGas gas = open_gas(layers);
    double gaps = 0;
    for (const Region& each : gas.voids) gaps += each.volume;
    EXPECT_NEAR(gaps, expected[oxide], 2 * 2.5 * thick);
  }
}

/// Films of two materials, down to a fiftieth of a spacing, in and over a trench.
Layers random_stack(RandomStream& random) {
  const auto between = [&](double a, double b) { return a + (b - a) * random.uniform(); };
  const auto thickness = [&] { return std::pow(10, between(std::log10(0.02), std::log10(3))); };
  std::vector<Shape> base{WaferShape{.material = si}};
  if (between(0, 1) < 0.5)
    base.push_back(LayerShape{.material = nitride, .thickness = thickness()});
  if (between(0, 1) < 0.7) base.push_back(LayerShape{.material = oxide, .thickness = thickness()});
  base.push_back(trench_at(between(-3, 3), between(6, 16), between(3, 14)));
  Layers layers = build_layers(section_frame(40), base);
  for (int n = 0; n < 3; ++n) {
    add_layer(layers, n == 1 ? metal : oxide);
    coat(layers, thickness());
  }
  if (between(0, 1) < 0.5) planarise(layers, between(-2, 2));
  place_shapes(layers, std::vector<Shape>{slot_mask(between(-4, 4), between(5, 14), between(2, 6),
                                                    MaskShape::Outlines::resist)});
  return layers;
}

// But for the edges of gaps, each of which the grid knows to a spacing or two squared.
TEST(Strip, OfRandomStacksAddsNothing) {
  RandomStream random({.seed = 5});
  int strips = 0;
  int grown = 0;  // by more than a spacing squared
  for (int n = 0; n < 100; ++n) {
    const Layers before = random_stack(random);
    const auto expected = volumes(before);
    for (const bool buried : {false, true}) {
      for (const bool keep_free : {false, true}) {
        SCOPED_TRACE(testing::Message() << n << ' ' << buried << ' ' << keep_free);
        Layers layers = before.copy();
        strip(layers, oxide, buried, keep_free);
        if (!keep_free) remove_islands(layers);
        double growth = 0;
        for (const auto& [material, volume] : volumes(layers)) {
          const double most = material == oxide && buried ? 0 : expected.at(material);
          growth = std::max(growth, volume - most);
        }
        EXPECT_LE(growth, 6.5);
        ++strips;
        grown += growth > 1 ? 1 : 0;
      }
    }
  }
  EXPECT_LE(grown, strips / 25) << strips;
}

TEST(Fill, IsFlatAndKeepsToItsHeight) {
  Layers layers = build_layers(
      section_frame(60), std::vector<Shape>{WaferShape{.material = si}, trench_at(-10, 8, 20)});
  add_layer(layers, oxide);
  fill(layers, -5);
  EXPECT_NEAR(volumes(layers)[oxide], 8 * 15, 0.1);
  fill(layers, 3);
  EXPECT_NEAR(volumes(layers)[oxide], 8 * 20 + 60 * 3, 0.2);
  EXPECT_NEAR(highest_point(layers), 3, 1e-6 + 1.1e-3);
}

TEST(Fill, OfNarrowOpeningsLeavesWideOnes) {
  const std::vector<Shape> base{WaferShape{.material = si}, trench_at(-20, 8.3, 20),
                                trench_at(12, 18.6, 20)};
  for (const double limit : {7.0, 10.0, 16.0, 22.0}) {
    Layers layers = build_layers(section_frame(72), base);
    add_layer(layers, oxide);
    fill(layers, 5, {.narrower_than = limit});
    const double expected = (limit > 8.3 ? 8.3 * 20 : 0) + (limit > 18.6 ? 18.6 * 20 : 0);
    EXPECT_NEAR(volumes(layers)[oxide], expected, 1) << limit;
  }
}

// Far below the surface there is nothing to fill; nor is there where it is filled already.
TEST(Fill, BelowAllGasDoesNothing) {
  for (const double height : {-40.0, -12.0, -6.0, -4.0, -3.5, -3.0, -2.5, -2.0, -1.0, 0.0}) {
    Layers layers = build_layers(section_frame(40),
                                 std::vector<Shape>{WaferShape{.material = si},
                                                    LayerShape{.material = oxide, .thickness = 3}});
    const double before = volumes(layers)[oxide];
    add_layer(layers, metal);
    const std::vector<MaterialId> on{oxide};
    fill(layers, height, {.narrower_than = 9});
    fill(layers, height, {.on = on});
    fill(layers, height);
    remove_empty_layers(layers);
    EXPECT_EQ(layers.stack.size(), 2U) << height;
    EXPECT_NEAR(volumes(layers)[oxide], before, 1e-6) << height;
  }
}

// No disc reaches the corners of a wide opening, nor an arm of it that is narrow: both are filled.
TEST(Fill, OfNarrowPlacesTakesTheCornersOfWideOpenings) {
  MaskShape mask{.material = resist, .thickness = 5};
  mask.outline = RectangleOutline{.size = {30, 26}};
  Frame frame = box_frame();
  Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{.material = si}, mask});
  add_layer(layers, oxide);
  const double diameter = 20;
  fill(layers, 5, {.narrower_than = diameter});
  const double corners = (1 - 3.14159265 / 4) * diameter * diameter;
  // Where no wall is the side of the fill, it lies half a spacing off at most.
  EXPECT_NEAR(volumes(layers)[oxide], corners * 5, 0.5 * 3.14159265 * diameter * 5);
}

// A hole that opens into a plaza: discs tell how far the hole goes.
TEST(Fill, OfAHoleInSpace) {
  HoleShape hole{.radius = 5.2, .centre = {-9, 0}};
  hole.cut = {.depth = 12};
  HoleShape wide{.radius = 11, .centre = {10, 0}};
  wide.cut = {.depth = 12};
  Layers layers =
      build_layers(box_frame(), std::vector<Shape>{WaferShape{.material = si}, hole, wide});
  add_layer(layers, oxide);
  fill(layers, 0, {.narrower_than = 14});
  EXPECT_NEAR(volumes(layers)[oxide], 3.14159265 * 5.2 * 5.2 * 12, 12);
}

TEST(Fill, OnChosenFloors) {
  // A trench down to silicon beside one that ends in oxide.
  TrenchShape deep = std::get<TrenchShape>(trench_at(-14, 9.2, 12));
  const std::vector<Shape> base{WaferShape{.material = si},
                                LayerShape{.material = oxide, .thickness = 12}, deep,
                                trench_at(14, 9.2, 6)};
  Layers layers = build_layers(section_frame(60), base);
  add_layer(layers, metal);
  const std::vector<MaterialId> on{si};
  fill(layers, 12, {.on = on});
  EXPECT_NEAR(volumes(layers)[metal], 9.2 * 12, 1);
}

TEST(Operations, AreTheSameOnAnyNumberOfThreads) {
  const auto make = [] {
    Layers layers = placed(
        box_frame(), {WaferShape{.material = si}, LayerShape{.material = oxide, .thickness = 6}},
        {slot_mask(3, 14, 8), trench_at(3, 9, 12)});
    strip(layers, resist, false);
    add_layer(layers, metal);
    fill(layers, 4, {.narrower_than = 12});
    const std::vector<MaterialId> on{oxide};
    coat_on(layers, 2.5, on);
    return hash(layers);
  };
  const std::uint64_t alone = [&] {
    const ThreadLimit one(1);
    return make();
  }();
  const ThreadLimit four(4);
  EXPECT_EQ(make(), alone);
}

}  // namespace
}  // namespace scarp

#include "levelset/operations/layer_steps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "levelset/grid/band.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

constexpr double half_turn = std::numbers::pi;

Frame flat_frame(int cells) {
  Frame frame{.spacing = 1, .cells = {cells, 1}};
  frame.two_dimensional = true;
  return frame;
}

Shape trench(double width, double depth) {
  TrenchShape shape{.width = width};
  shape.cut.depth = depth;
  return shape;
}

/// Two films on a wafer with a trench, filled and overfilled by a third.
Layers filled_trench() {
  Layers layers =
      build_layers(flat_frame(60), std::vector<Shape>{WaferShape{.material = 0},
                                                      LayerShape{.material = 1, .thickness = 6.4},
                                                      trench(14.6, 20)});
  add_layer(layers, 2);
  coat(layers, 9.7);
  return layers;
}

void expect_nested(const Layers& layers) {
  for (std::size_t n = 0; n + 1 < layers.stack.size(); ++n) {
    for (const Leaf& leaf : layers.stack[n].phi.band().leaves()) {
      for (int offset = 0; offset < leaf_size; ++offset) {
        const Node at = node_at(leaf, offset);
        if (at[0] > layers.frame.cells[0] || at[1] > layers.frame.cells[1]) continue;
        ASSERT_GE(leaf.phi[offset], layers.top().node(at[0], at[1], at[2])) << "layer " << n;
      }
    }
  }
}

TEST(Planarise, LeavesThePlaneExactToTheBitAndNothingAboveIt) {
  // Through the film on top, through the one below it, and through the wafer.
  for (const double height : {11.37, 3.0, -4.6}) {
    Layers layers = filled_trench();
    const std::vector<double> before = material_volumes(layers);
    planarise(layers, height);
    for (int i = 0; i <= 60; ++i) {
      const int above = static_cast<int>(std::ceil(height));
      for (const int k : {above - 1, above}) {
        const float exact = static_cast<float>(k - height);
        const bool on_node = std::abs(exact) < 1e-6F;
        ASSERT_EQ(layers.top().node(i, 0, k), on_node ? 1e-6F : exact) << i << " " << k;
      }
    }
    for (const Layer& layer : layers.stack) {
      for (const Vec3f& v : extract_surface(layer.phi).vertices) {
        ASSERT_LE(v.z, static_cast<float>(height));
      }
    }
    expect_nested(layers);
    // Vertices keep a thousandth of a spacing away from nodes.
    EXPECT_NEAR(highest_point(layers), height, height == 3 ? 1.1e-3 : 1e-6);
    // The trench holds what was in it, as far as it is left.
    const std::vector<double> after = material_volumes(layers);
    const double depth = std::min(height + 20 - 6.4, 20.0);
    const double flat = 60 * std::max(height - 6.4, 0.0);
    EXPECT_NEAR(after[2], 14.6 * depth + flat, 0.15) << height;
    EXPECT_NEAR(after[1], std::clamp(height, 0.0, 6.4) * (60 - 14.6), 0.1) << height;
    EXPECT_LT(after[0] + after[1] + after[2], before[0] + before[1] + before[2]);
  }
}

TEST(Planarise, AboveEverythingChangesNothing) {
  Layers layers = filled_trench();
  planarise(layers, highest_point(layers) + 2.6);
  planarise(layers, 1e4);
  planarise(layers, highest_point(layers));
  EXPECT_EQ(hash(layers), hash(filled_trench()));
}

TEST(Planarise, OpensAVoidAndKeepsItsWalls) {
  const double radius = 8.3;
  Layers layers = single_layer(
      flat_frame(60),
      [&](Vec3d r) { return std::max(r.z - 0.2, radius - std::hypot(r.x, r.z + 12)); }, -24, 4);
  ASSERT_EQ(open_gas(layers).voids.size(), 1U);
  planarise(layers, -12 + 4.1);
  EXPECT_TRUE(open_gas(layers).voids.empty());
  double left = 0;
  for (const Vec3f& v : extract_surface(layers).vertices) {
    if (v.z < -12 + 4) {
      EXPECT_NEAR(std::hypot(v.x, v.z + 12), radius, 0.02);
    } else {
      EXPECT_GT(std::abs(v.x), std::sqrt(radius * radius - 4.1 * 4.1) - 0.1);
      left = std::max(left, std::abs(static_cast<double>(v.x)));
    }
  }
  EXPECT_EQ(left, 30);
}

TEST(Coat, OfAFlatWaferIsExact) {
  for (const double thickness : {0.3, 1.0, 7.25, 40.5}) {
    const Frame frame{
        .spacing = 0.5, .cells = {20, 12}, .boundary = {Boundary::periodic, Boundary::reflective}};
    Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}});
    add_layer(layers, 1);
    coat(layers, thickness);
    ASSERT_EQ(layers.stack.size(), 2U);
    for (const Vec3f& v : extract_surface(layers).vertices) {
      ASSERT_NEAR(v.z, thickness + 0.0005, 1e-5);
    }
    EXPECT_NEAR(material_volumes(layers)[1], thickness * 10 * 6, 1e-3 * thickness);
  }
}

TEST(Coat, LeavesNoNodeOnTheSurface) {
  Layers layers = single_layer(
      flat_frame(20), [](Vec3d r) { return r.z - 0.25; }, -4, 4);
  coat(layers, 0.75);
  EXPECT_EQ(layers.top().node(7, 0, 1), smallest_phi);
}

/// Area of the film on a trench: slabs, two quarter discs at the mouth, less the overlap below.
double film_area(double extent, double width, double depth, double t) {
  return (extent - width) * t + half_turn / 2 * t * t + width * depth -
         (width - 2 * t) * (depth - t);
}

TEST(Coat, OfATrenchIsTheOffsetAtEverySubCellPosition) {
  for (const double thickness : {0.3, 2.6, 5.45, 11.2}) {
    for (const double offset : {0.0, 0.31, 0.77}) {
      Layers layers = build_layers(
          flat_frame(60), std::vector<Shape>{WaferShape{}, trench(26 + offset, 20.4 + offset)});
      add_layer(layers, 1);
      coat(layers, thickness);
      const double exact = film_area(60, 26 + offset, 20.4 + offset, thickness);
      // Chords of a spacing take half_turn / 24 away from a quarter disc, whatever its radius; one
      // that is smaller than a cell is hardly seen.
      const double chords = thickness < 1 ? 0 : half_turn / 12;
      EXPECT_NEAR(material_volumes(layers)[1], exact - chords, 0.12) << thickness << " " << offset;
    }
  }
}

TEST(Coat, IsWhatIsotropicDepositionGives) {
  const Frame frame{.spacing = 1, .cells = {48, 40}};
  HoleShape hole{.radius = 12.3};
  hole.cut.depth = 15.4;
  const std::vector<Shape> shapes{WaferShape{}, hole};
  Layers coated = build_layers(frame, shapes);
  add_layer(coated, 1);
  coat(coated, 6.2);
  Layers grown = build_layers(frame, shapes);
  add_layer(grown, 1);
  move(grown, 6.2, 0.4, [](Vec3d, MaterialId) { return 1.0; });
  // The scheme rounds what is sharp, the edge at the bottom and the arc at the mouth, by a part of
  // a spacing; flat parts agree.
  double sum = 0;
  const std::vector<Vec3f> vertices = extract_surface(coated).vertices;
  for (const Vec3f& v : vertices) {
    const double apart = grown.top().distance(Vec3d(v));
    EXPECT_NEAR(apart, 0, 0.35) << v.x << " " << v.y << " " << v.z;
    const bool at_mouth = v.z > -1 && std::hypot(v.x, v.y) < 13;
    if (!at_mouth && v.z > -8) {
      EXPECT_NEAR(apart, 0, 0.05) << v.x << " " << v.y << " " << v.z;
    }
    sum += std::abs(apart);
  }
  EXPECT_LT(sum / static_cast<double>(vertices.size()), 0.05);
  EXPECT_NEAR(material_volumes(coated)[1] / material_volumes(grown)[1], 1, 0.004);
}

TEST(Coat, FilmUponFilmIsAsGoodAsOne) {
  constexpr double whole = 10;
  for (const int count : {4, 10, 40}) {
    Layers layers =
        build_layers(flat_frame(60), std::vector<Shape>{WaferShape{}, trench(26.3, 20.4)});
    add_layer(layers, 1);
    for (int n = 0; n < count; ++n) coat(layers, whole / count);
    const double exact = film_area(60, 26.3, 20.4, whole);
    EXPECT_NEAR(material_volumes(layers)[1], exact, 0.006 * exact) << count;
    for (const Vec3f& v : extract_surface(layers).vertices) {
      if (std::abs(v.x) < 13.15 && v.z > 0) {
        EXPECT_NEAR(std::hypot(13.15 - std::abs(v.x), v.z), whole, 0.3) << count;
      }
    }
  }
}

TEST(Coat, ReachesAcrossPeriodicSides) {
  const auto shifted = [](double shift) {
    const Frame frame{
        .spacing = 1, .cells = {40, 16}, .boundary = {Boundary::periodic, Boundary::periodic}};
    Layers layers = single_layer(
        frame,
        [&](Vec3d r) {
          const double x = std::remainder(r.x - shift, 40);
          return std::min(r.z, std::hypot(x, r.z - 5) - 6.3) - 1e-3;
        },
        -6, 16);
    coat(layers, 7.7);
    return layers;
  };
  const Layers middle = shifted(0);
  const Layers side = shifted(16);
  for (int i = 0; i < 40; ++i) {
    for (int k = -4; k < 30; ++k) {
      ASSERT_NEAR(middle.top().node(i, 3, k), side.top().node(i + 16, 3, k), 2e-5) << i << " " << k;
    }
  }
}

// A round cavity of radius 12.3 below a slot of half-width 3.4, for films that are thicker than the
// cavity's radius, too. With the middle of the slot between nodes it is shut half a spacing early.
TEST(Coat, StopsBehindANeckThatItHasShut) {
  for (const double middle : {0.0, 0.3, 0.5}) {
    for (const double thickness : {2.6, 6.0, 15.0}) {
      const auto surface = [&](Vec3d r) {
        const double cavity = std::hypot(r.x - middle, r.z + 20) - 12.3;
        const double slot = std::max(std::abs(r.x - middle) - 3.4, -r.z - 20);
        return std::max(r.z - 0.01, -std::min(cavity, slot));
      };
      Layers layers = single_layer(flat_frame(60), surface, -40, 6);
      add_layer(layers, 1);
      coat(layers, thickness);
      const double behind = thickness > 3.4 ? 3.4 : thickness;
      const std::size_t void_count = thickness > 3.4 ? 1 : 0;
      EXPECT_EQ(open_gas(layers).voids.size(), void_count) << middle << ' ' << thickness;
      for (const double angle : {-2.4, -half_turn / 2, -0.7}) {
        const double on_film = 12.3 - behind;
        const double apart = layers.top().distance(
            {middle + on_film * std::cos(angle), 0, -20 + on_film * std::sin(angle)});
        EXPECT_GT(apart, -0.03) << middle << ' ' << thickness << ' ' << angle;
        EXPECT_LT(apart, void_count > 0 ? 0.03 + middle : 0.03)
            << middle << ' ' << thickness << ' ' << angle;
      }
      EXPECT_NEAR(layers.top().distance({-25, 0, thickness}), -0.01, 0.02);
    }
  }
}

// A slot narrower than a spacing, with nodes in its middle, and a film thinner than one.
TEST(Coat, StopsBehindANeckNarrowerThanASpacing) {
  for (const double thickness : {0.45, 0.9}) {
    const auto surface = [](Vec3d r) {
      const double slot = std::max(std::abs(r.x) - 0.3, -r.z - 20);
      return std::max(r.z - 0.01, -std::min(std::hypot(r.x, r.z + 20) - 12.3, slot));
    };
    Layers layers = single_layer(flat_frame(60), surface, -40, 6);
    add_layer(layers, 1);
    coat(layers, thickness);
    EXPECT_EQ(open_gas(layers).voids.size(), 1U);
    // The thinner one is less than half a spacing thicker than the neck allows.
    const double behind = thickness > 0.8 ? 0.3 : thickness;
    EXPECT_NEAR(layers.top().distance({0, 0, -32.3}), -behind, 0.03) << thickness;
    EXPECT_NEAR(layers.top().distance({-25, 0, 0}), -thickness - 0.01, 0.02) << thickness;
  }
}

TEST(Coat, TellsWhereItHasNotLookedForNecks) {
  const auto surface = [](Vec3d r) {
    const double slot = std::max(std::abs(r.x) - 3.4, -r.z - 20);
    return std::max(r.z - 0.01, -std::min(std::hypot(r.x, r.z + 20) - 12.3, slot));
  };
  Layers layers = single_layer(flat_frame(60), surface, -40, 6);
  add_layer(layers, 1);
  const NecksLeftOut left_out = coat(layers, 6, 1000);
  EXPECT_GT(left_out.node_count, 1000U);
  EXPECT_NEAR(left_out.lowest, -32, 1);
  EXPECT_GT(left_out.highest, -12);
  EXPECT_LT(left_out.highest, 0);
  EXPECT_EQ(coat(layers, 1.5).node_count, 0U);
  Layers plain = single_layer(
      flat_frame(60), [](Vec3d r) { return r.z - 0.01; }, -40, 6);
  EXPECT_EQ(coat(plain, 6, 0).node_count, 0U);
}

// In two films, the second on the arcs of the first, and mirrored as the wafer is.
TEST(Coat, AboveAShutNeckIsWhatIsAboveASlot) {
  const auto slot_only = [](Vec3d r) {
    return std::max(r.z - 0.01, -std::max(std::abs(r.x) - 3.4, -r.z - 4));
  };
  const auto with_cavity = [&](Vec3d r) {
    return std::max(r.z - 0.01, -std::min(std::hypot(r.x, r.z + 20) - 12.3,
                                          std::max(std::abs(r.x) - 3.4, -r.z - 20)));
  };
  Layers plain = single_layer(flat_frame(60), slot_only, -40, 6);
  Layers neck = single_layer(flat_frame(60), with_cavity, -40, 6);
  coat(plain, 6);
  coat(neck, 6);
  for (int i = 0; i <= 60; ++i) {
    for (int k = 1; k < 10; ++k) {
      if (std::abs(plain.top().node(i, 0, k)) > 1) continue;
      EXPECT_NEAR(neck.top().node(i, 0, k), plain.top().node(i, 0, k), 0.1) << i << ' ' << k;
      EXPECT_EQ(neck.top().node(i, 0, k), neck.top().node(60 - i, 0, k)) << i << ' ' << k;
    }
  }
}

TEST(Coat, LeavesClosedVoidsAloneAndFillsGaps) {
  // A large void, larger than the band on both sides, below a thin cover; and a narrow slot.
  const auto surface = [](Vec3d r) {
    const double slab = std::max(std::abs(r.x + 10) - 14.3, std::abs(r.z + 20) - 13.4);
    const double slot = std::max(std::abs(r.x - 20) - 2.2, -r.z - 25);
    return std::max(r.z - 0.01, -std::min(slab, slot));
  };
  for (const double thickness : {0.8, 2.4, 12.6}) {
    Layers layers = single_layer(flat_frame(60), surface, -50, 6);
    const OpenGas before = open_gas(layers);
    ASSERT_EQ(before.voids.size(), 1U);
    const Layers old = layers.copy();
    add_layer(layers, 1);
    coat(layers, thickness);

    const OpenGas after = open_gas(layers, before.voids);
    ASSERT_EQ(after.voids.size(), 1U);
    EXPECT_EQ(after.voids[0].volume, before.voids[0].volume);
    // Measured anew its edges look at solid beyond what the void holds.
    EXPECT_NEAR(open_gas(layers).voids.at(0).volume, before.voids[0].volume,
                1e-3 * before.voids[0].volume);
    EXPECT_EQ(after.voids[0].lower, before.voids[0].lower);
    EXPECT_EQ(after.voids[0].first_node, before.voids[0].first_node);
    for (int i = 0; i < 30; ++i) {
      for (int k = -40; k < -3; ++k) {
        const float was = old.top().node(i, 0, k);
        const float is = layers.top().node(i, 0, k);
        ASSERT_EQ(is < 0, was < 0) << i << " " << k;
        ASSERT_EQ(std::abs(was) < 0.5 ? is : was, was) << i << " " << k;
      }
    }
    EXPECT_NEAR(layers.top().distance({-10, 0, thickness}), -0.01, 1e-4);
    // The slot is as wide as twice the film, or less: nothing of it is left.
    if (thickness < 2.2) continue;
    const double notch = std::sqrt(thickness * thickness - 2.2 * 2.2);
    EXPECT_NEAR(layers.top().distance({20, 0, notch}), 0, 0.5);
    EXPECT_EQ(layers.top().node(50, 0, -10), -LevelSet::half_width);
    for (const Layer& layer : layers.stack) {
      for (int k = -40; k < 10; ++k) {
        ASSERT_GE(layer.phi.node(20, 0, k), layers.top().node(20, 0, k));
      }
    }
  }
}

TEST(Coat, GivesTheSameBitsForAnyNumberOfThreads) {
  const auto run = [](int threads) {
    const ThreadLimit limit(threads);
    Layers layers = filled_trench();
    planarise(layers, 3.3);
    return hash(layers);
  };
  EXPECT_EQ(run(1), run(2));
}

TEST(HighestPoint, OfAMaterialIsThatOfWhatIsLeftOfIt) {
  Layers layers = filled_trench();
  EXPECT_NEAR(highest_point(layers), 6.4 + 9.7, 2e-3);
  EXPECT_NEAR(highest_point(layers, 2), 6.4 + 9.7, 2e-3);
  EXPECT_NEAR(highest_point(layers, 1), 6.4, 2e-3);
  EXPECT_NEAR(highest_point(layers, 0), 0, 2e-3);
  planarise(layers, -2);
  EXPECT_EQ(highest_point(layers, 1), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(highest_point(layers, 7), -std::numeric_limits<double>::infinity());
  EXPECT_NEAR(highest_point(layers, 2), -2, 1e-3);
}

}  // namespace
}  // namespace scarp

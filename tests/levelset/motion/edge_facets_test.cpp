#include "levelset/motion/edge_facets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "levelset/grid/band.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

constexpr double edge = 10.3;  // of the mask's opening, at x = -edge and edge; its top is at z = 0
constexpr double height = 2;   // of the crystal over the mask
constexpr double rate_facet = 0.2;  // of {111}, where that of {100} is 1

const Vec3d facet_normal{std::sqrt(2.0 / 3), 0, std::sqrt(1.0 / 3)};

/// From the nearer edge, as on its right side.
Vec3d from_edge(Vec3d r) { return {std::abs(r.x) - edge, 0, r.z}; }

/// How far a place is from the facet that began at the edge when the crystal's top passed it.
double from_facet(Vec3d r, double time) {
  return dot(from_edge(r), facet_normal) - rate_facet * time;
}

/// A crystal of silicon that has grown out of an opening along <110>, in a cross-section.
class GrownCrystal : public testing::Test {
 protected:
  GrownCrystal() {
    const auto silicon = [](Vec3d r) { return r.z + 3.4; };
    const auto mask = [=](Vec3d r) {
      return std::min(silicon(r), std::max(r.z, edge - std::abs(r.x)));
    };
    const auto crystal = [=](Vec3d r) {
      return std::min(mask(r), std::max(r.z - height, from_facet(r, height)));
    };
    layers_.stack.push_back({0, LevelSet(frame_, silicon, -8, 8)});
    layers_.stack.push_back({1, LevelSet(frame_, mask, -8, 8)});
    layers_.stack.push_back({0, LevelSet(frame_, crystal, -8, 8)});
    const std::span<const Leaf> leaves = layers_.top().band().leaves();
    const double s = std::sqrt(0.5);
    const AngularFactor rates =
        CrystalRates({.r100 = 1, .r110 = 0.5, .r111 = rate_facet, .r311 = 0.75},
                     {Vec3d{s, s, 0}, {-s, s, 0}, {0, 0, 1}});
    field_.angular.push_back({rates, std::vector<float>(leaves.size() * leaf_size, 1)});
    field_.is_inert = {false, true, false};
    field_.grows_beside_inert = true;
    for (std::size_t at = 0; at < leaves.size() * leaf_size; ++at) {
      const Vec3d r = place(at);
      mobility_.push_back(r.z < 0 && std::abs(r.x) > edge ? 0.0F : 1.0F);
    }
  }

  Vec3d place(std::size_t at) const {
    const std::span<const Leaf> leaves = layers_.top().band().leaves();
    return frame_.node_position(node_at(leaves[at / leaf_size], static_cast<int>(at % leaf_size)));
  }
  float phi(std::size_t at) const {
    return layers_.top().band().leaves()[at / leaf_size].phi[at % leaf_size];
  }

  Frame frame_{.spacing = 1, .cells = {48, 1}, .two_dimensional = true};
  Layers layers_{.frame = frame_, .stack = {}};
  SpeedField field_;
  std::vector<float> mobility_;
};

TEST_F(GrownCrystal, StaysBehindTheFacetThatBeganAtTheEdge) {
  constexpr float dt = 0.4F;
  const std::vector<HeldNode> held = edge_facets(layers_, field_, mobility_, dt);
  std::array<int, 2> beside_facet{};
  int pulled = 0;
  for (const HeldNode& node : held) {
    const Vec3d r = place(node.at);
    EXPECT_GT(mobility_[node.at], 0) << "in the mask nothing is held";
    const double away = from_facet(r, height + dt);
    const Vec3d foot = from_edge(r) - away * facet_normal;
    if (foot.z < 0 || foot.z > height) continue;
    EXPECT_NEAR(node.least, std::min<double>(phi(node.at), away), 0.05) << r.x << ' ' << r.z;
    ++beside_facet[r.x < 0 ? 0 : 1];
    // Those nearest to the facet do not stay behind it either.
    if (node.most < std::numeric_limits<float>::max()) {
      EXPECT_NEAR(node.most, away, 0.05);
      ++pulled;
    }
  }
  EXPECT_GT(beside_facet[0], 5);
  EXPECT_EQ(beside_facet[0], beside_facet[1]);
  EXPECT_GT(pulled, 2);
}

TEST_F(GrownCrystal, IsNotHeldWhereNothingGrowsBesideAMask) {
  field_.grows_beside_inert = false;
  EXPECT_TRUE(edge_facets(layers_, field_, mobility_, 0.4F).empty());
}

}  // namespace
}  // namespace scarp

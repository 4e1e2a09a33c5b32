#include "levelset/bath/diffusion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/parallel.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

constexpr double h = 2;  // nm

Frame in_plane(int cells, Boundary boundary = Boundary::reflective) {
  return {
      .spacing = h, .cells = {cells, 1}, .boundary = {boundary, boundary}, .two_dimensional = true};
}

Frame block(int cells, Boundary boundary = Boundary::reflective) {
  return {.spacing = h, .cells = {cells, 12}, .boundary = {boundary, boundary}};
}

/// A trench of straight walls in a wafer. Units: nm.
struct Trench {
  double width;
  double depth;
  double slope = 0;  ///< how far each wall leans out per height

  Layers in(const Frame& frame) const {
    return single_layer(
        frame,
        [this](Vec3d r) {
          const double wall =
              (0.5 * width + slope * r.z - std::abs(r.x)) / std::sqrt(1 + slope * slope);
          return std::max(r.z, std::min(wall, r.z + depth));
        },
        -depth, 0);
  }
};

struct Bath {
  Layers layers;
  TriMesh facets;
  Concentration result;

  Vec3d middle(std::size_t f) const {
    const auto [a, b, c] = corners(facets, f);
    return (a + b + c) / 3.0;
  }
  /// The mean, by area, over facets that are wanted.
  double mean(const std::function<bool(Vec3d)>& wanted) const {
    double sum = 0;
    double area = 0;
    for (std::size_t f = 0; f < facets.triangles.size(); ++f) {
      if (!wanted(middle(f))) continue;
      const double a = length(area_vector(facets, f));
      sum += a * result.at_facets[f];
      area += a;
    }
    return sum / area;
  }
  /// At the walls of a trench, at a height.
  double at(double z) const {
    return mean([&](Vec3d r) { return std::abs(r.z - z) < 0.51 * h; });
  }
};

bool is_bottom(Vec3d r, Vec3d n) { return r.z < -60 && n.z > 0.8; }

/// exchange(r, n) is that of a facet with its middle at r and the normal n.
Bath solved(Layers layers, const Solute& solute,
            const std::function<Exchange(Vec3d, Vec3d)>& exchange) {
  Bath bath{.layers = std::move(layers), .facets = {}, .result = {}};
  bath.facets = extract_surface(bath.layers, open_gas(bath.layers));
  std::vector<Exchange> on_facets;
  for (std::size_t f = 0; f < bath.facets.triangles.size(); ++f) {
    const Vec3d area = area_vector(bath.facets, f);
    on_facets.push_back(exchange(bath.middle(f), area / length(area)));
  }
  bath.result = diffuse(bath.layers, bath.facets, on_facets, solute);
  return bath;
}

Layers wafer(const Frame& frame) {
  return single_layer(
      frame, [](Vec3d r) { return r.z - 0.3 * h; }, 0, h);
}

// Two facets that are as long as the wafer is wide, and a spacing narrow.
TEST(Diffusion, LongFacetsGiveToAllNodesAlongThem) {
  const Layers layers = wafer(in_plane(40));
  const Box box = bounding_box(extract_surface(layers));
  const auto corner = [&](double x, double y) { return Vec3f(Vec3d{x, y, box.lower.z}); };
  const auto& [lower, upper] = box;
  const TriMesh facets{.vertices = {corner(lower.x, lower.y), corner(upper.x, lower.y),
                                    corner(upper.x, upper.y), corner(lower.x, upper.y)},
                       .triangles = {{0, 1, 2}, {0, 2, 3}},
                       .materials = {}};
  const Solute solute{.diffusivity = 3, .layer = 60, .bath = 0.4};
  const std::vector<Exchange> exchange(2, {.release = 0.01, .uptake = 0.01});
  const double expected = open_wafer_concentration(solute, exchange[0]);
  const double step = h / solute.layer * std::abs(expected - solute.bath);
  for (const float c : diffuse(layers, facets, exchange, solute).at_facets)
    EXPECT_NEAR(c, expected, step + 1e-6);
}

TEST(Diffusion, AboveAnOpenWaferIsLinear) {
  for (const auto& [layer, exchange] :
       {std::pair{500.0, Exchange{.release = 0.002, .uptake = 0.01}},
        std::pair{500.0, Exchange{.release = 0.05, .uptake = 0.01}},
        std::pair{500.0, Exchange{.release = 0, .uptake = 0.01}},
        std::pair{21.0, Exchange{.release = 0.05, .uptake = 0.01}},
        std::pair{8.0, Exchange{.release = 0.05, .uptake = 0.01}}}) {
    const Solute solute{.diffusivity = 3, .layer = layer, .bath = 0.4};
    const double expected = open_wafer_concentration(solute, exchange);
    const auto exchange_at = [same = exchange](Vec3d, Vec3d) { return same; };
    for (const Frame& frame : {in_plane(10), block(10), block(10, Boundary::periodic)}) {
      const Bath bath = solved(wafer(frame), solute, exchange_at);
      // The surface gives to the nodes above it, up to a spacing away.
      const double step = h / layer * std::abs(expected - solute.bath);
      for (const float c : bath.result.at_facets) EXPECT_NEAR(c, expected, step + 1e-6);
    }
  }
}

// What the bottom gives flows through the whole width, wherever the walls lie between nodes.
TEST(Diffusion, InADeadEndIsLinear) {
  const Solute solute{.diffusivity = 5, .layer = 100};
  for (const double width : {24.0, 25.3, 26.9}) {
    for (const Frame& frame : {in_plane(40), block(40), block(40, Boundary::periodic)}) {
      const Bath bath = solved(Trench{width, 120}.in(frame), solute, [](Vec3d r, Vec3d n) {
        return Exchange{.release = is_bottom(r, n) ? 0.3 : 0};
      });
      EXPECT_NEAR(bath.at(-100) - bath.at(-40), 0.3 * 60 / 5, 0.01 * 0.3 * 60 / 5) << width;
    }
  }
}

// Walls that take up what lies above saturation: c - 1 = cosh(q (z + depth)) cos(q' x) with
// q tan(q width / 2) = k / D across and the same q along.
TEST(Diffusion, InADeadEndWhoseWallsTakeUpFallsAsTheHyperbolicCosine) {
  constexpr double width = 25.3;
  constexpr double depth = 160;
  constexpr double k = 0.02;
  constexpr double diffusivity = 2;
  double q = 0;
  for (double low = 0, high = 3.1 / width; high - low > 1e-12;) {
    q = 0.5 * (low + high);
    (q * std::tan(0.5 * q * width) < k / diffusivity ? low : high) = q;
  }
  const Solute solute{.diffusivity = diffusivity, .layer = 50, .bath = 4};
  const Bath bath = solved(Trench{width, depth}.in(in_plane(40)), solute, [&](Vec3d r, Vec3d) {
    return Exchange{.uptake = r.z < -1 && r.z > 1 - depth ? k : 0};
  });
  const double reference = bath.at(-60) - 1;
  ASSERT_GT(reference, 0.1);
  for (const double z : {-80.0, -100.0, -120.0, -140.0}) {
    const double expected = reference * std::cosh(q * (z + depth)) / std::cosh(q * (depth - 60));
    EXPECT_NEAR(bath.at(z) - 1, expected, 0.02 * expected) << z;
  }
}

// Nothing settles where the bath is not saturated, and what is above it in the mouth may be below
// deeper down.
TEST(Diffusion, SettlesWhereTheBathIsMoreThanSaturated) {
  const Solute solute{.diffusivity = 2, .layer = 50, .bath = 1.5};
  const Bath bath = solved(Trench{24, 80}.in(in_plane(40)), solute, [](Vec3d r, Vec3d) {
    return r.z < -79 ? Exchange{.release = -0.05} : Exchange{.uptake = 0.01};
  });
  double settled = 0;
  bool is_below = false;
  for (std::size_t f = 0; f < bath.facets.triangles.size(); ++f) {
    const double c = bath.result.at_facets[f];
    is_below = is_below || c < 1;
    if (bath.middle(f).z < -79) continue;
    settled += 0.01 * std::max(0.0, c - 1) * length(area_vector(bath.facets, f));
  }
  EXPECT_TRUE(is_below);
  EXPECT_GT(settled, 0);
  EXPECT_NEAR(bath.result.settled, settled, 0.01 * settled);
}

// Between walls that lean the concentration goes with the logarithm of the distance to their edge.
TEST(Diffusion, BetweenLeaningWallsIsLogarithmic) {
  const Solute solute{.diffusivity = 4, .layer = 100};
  for (const double slope : {0.05, 0.12, 0.2}) {
    const double width = 24 + 2 * slope * 100;
    const Bath bath =
        solved(Trench{width, 100, slope}.in(in_plane(50)), solute,
               [](Vec3d r, Vec3d n) { return Exchange{.release = is_bottom(r, n) ? 0.3 : 0}; });
    const double edge = -0.5 * width / slope;
    const double angle = 2 * std::atan(slope);
    const auto potential = [&](double z) {
      return -0.3 * 24 / (4 * angle) * std::log((z - edge) * std::sqrt(1 + slope * slope));
    };
    const double expected = potential(-80) - potential(-20);
    EXPECT_NEAR(bath.at(-80) - bath.at(-20), expected, 0.02 * expected) << slope;
  }
}

TEST(Diffusion, IsConserved) {
  const Solute solute{.diffusivity = 5, .layer = 100, .bath = 0.9};
  const Bath bath = solved(Trench{25.3, 120, 0.1}.in(block(60)), solute, [](Vec3d, Vec3d n) {
    return n.z > 0.5 ? Exchange{.release = 0.3} : Exchange{.uptake = 0.01};
  });
  EXPECT_GT(bath.result.settled, 0.1 * bath.result.released);
  EXPECT_GT(bath.result.escaped, 0.1 * bath.result.released);
  EXPECT_NEAR(bath.result.settled + bath.result.escaped, bath.result.released,
              1e-7 * bath.result.released);
}

// To rounding, however little the concentration differs from that of the bath: here by a part of
// 1e9.
TEST(Diffusion, IsConservedWhereAllLeavesAtOnce) {
  const Solute solute{.diffusivity = 5e9, .layer = 100, .bath = 0.9};
  const Bath bath = solved(Trench{25.3, 120, 0.1}.in(block(60)), solute, [](Vec3d, Vec3d n) {
    return n.z > 0.5 ? Exchange{.release = 0.3} : Exchange{.uptake = 0.01};
  });
  EXPECT_EQ(bath.result.settled, 0);
  EXPECT_NEAR(bath.result.escaped, bath.result.released, 1e-9 * bath.result.released);
}

TEST(Diffusion, LeavesClosedVoidsOut) {
  const auto with_void = [](double radius) {
    return single_layer(
        in_plane(40), [=](Vec3d r) { return std::max(r.z, radius - std::hypot(r.x, r.z + 40)); },
        -70, 0);
  };
  const Solute solute{.diffusivity = 5, .layer = 100};
  const auto exchange = [](Vec3d, Vec3d) { return Exchange{.release = 0.3}; };
  const Bath closed = solved(with_void(20), solute, exchange);
  EXPECT_NEAR(closed.result.released, 0.3 * 80 * h, 1e-3);
  for (const float c : closed.result.at_facets) EXPECT_NEAR(c, 0.3 * 100 / 5, 0.02 * 6);
}

TEST(Diffusion, DoesNotDependOnTheNumberOfThreads) {
  const Solute solute{.diffusivity = 5, .layer = 100, .bath = 0.9};
  const auto concentration = [&](int threads) {
    const ThreadLimit limit(threads);
    return solved(Trench{25.3, 120, 0.1}.in(block(60)), solute,
                  [](Vec3d, Vec3d n) {
                    return n.z > 0.5 ? Exchange{.release = 0.3} : Exchange{.uptake = 0.01};
                  })
        .result.at_facets;
  };
  EXPECT_EQ(concentration(1), concentration(4));
}

}  // namespace
}  // namespace scarp

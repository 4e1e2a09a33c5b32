// Flux along a flat wall, on a simplified mesh: curvature sees nothing there, and yet flux varies.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/running_statistics.h"
#include "flux/reconstruct.h"
#include "flux/sampling/sampling.h"
#include "flux/solve.h"
#include "mesh/simplify/simplify.h"
#include "tests/flux/direct_flux.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

constexpr int depth = 80;
constexpr double width = 40;
constexpr double bottom = 2.3;
constexpr double top = bottom + depth;

struct Trench {
  TriMesh mesh;
  Sides sides;
};

// As the default recipe's: 40 spacings wide and 80 deep.
Trench simplified_trench(double remove) {
  constexpr int field = 8;
  constexpr double middle = 0.5 * width + field;
  const Grid grid{.cells = {static_cast<int>(2 * middle), 16, depth + 5}};
  // Off the nodes, as start geometries are.
  const TriMesh full = polygonised(grid, [](Vec3d r) {
    const double cut = std::max(std::abs(r.x - middle) - (0.5 * width + 0.001), bottom - r.z);
    return std::max(r.z - top, -cut);
  });
  const SimplifyOptions options{.method = SimplifyMethod::curvature,
                                .sides = grid.sides(),
                                .max_error = 0.1,
                                .remove = remove,
                                .l_max = 3};
  return {simplify(full, options).mesh, grid.sides()};
}

/// By how much the flux between the corners of facets is above the exact one, on average over
/// stripes of the wall a spacing deep.
std::vector<double> excess_by_depth(const TriMesh& mesh, const FluxField& flux) {
  const auto values = corner_values(mesh, flux.arrivals().mean);
  const auto normals = facet_normals(mesh);
  const auto areas = facet_areas(mesh);
  std::vector<double> sum(depth);
  std::vector<double> area(depth);
  constexpr int steps = 12;
  for (std::size_t f = 0; f < values.size(); ++f) {
    if (std::abs(normals[f].x) < 0.98F) continue;
    const auto [a, b, c] = corners(mesh, f);
    for (int k = 0; k < steps * steps; ++k) {
      const Vec3d w = sample_triangle({(k % steps + 0.5) / steps, (k / steps + 0.5) / steps});
      const double below = top - (w.x * a.z + w.y * b.z + w.z * c.z);
      if (below < 0 || below >= depth) continue;
      // The closed form is that of a trench half as wide.
      const double exact = exact::direct_trench_flux({0, 0, -below / 2}, {1, 0, 0}, 1);
      const auto& at = values[f];
      const auto stripe = static_cast<std::size_t>(below);
      sum[stripe] += areas[f] * (w.x * at[0] + w.y * at[1] + w.z * at[2] - exact);
      area[stripe] += areas[f];
    }
  }
  for (std::size_t stripe = 0; stripe < sum.size(); ++stripe) sum[stripe] /= area[stripe];
  return sum;
}

TEST(ShadowedWall, SimplifiedByTwoThirdsHasTheExactFluxWithinOnePercent) {
  const Trench trench = simplified_trench(0.67);
  const Species gas{.name = "gas"};
  std::vector<RunningStatistics> excess(depth);
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const FluxOptions options{.engine = FluxOptions::Engine::gather,
                              .sides = trench.sides,
                              .spacing = 1,
                              .rays = 1 << 17,
                              .seed = seed};
    const FluxField flux = solve_flux(trench.mesh, {&gas, 1}, options).front();
    const auto of_seed = excess_by_depth(trench.mesh, flux);
    for (std::size_t stripe = 0; stripe < of_seed.size(); ++stripe)
      excess[stripe].add(of_seed[stripe]);
  }
  for (std::size_t stripe = 0; stripe < excess.size(); ++stripe) {
    EXPECT_LT(excess[stripe].std_error(), 0.002) << stripe;
    EXPECT_LT(std::abs(excess[stripe].mean()), 0.01) << "at a depth of " << stripe;
  }
}

}  // namespace
}  // namespace scarp

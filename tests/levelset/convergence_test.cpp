// Surfaces that move at speed 1 or -1, against the exact distance, for every scheme at three
// spacings. Each test prints its rows of the table in docs/levelset.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <ostream>
#include <string>

#include "levelset/motion/advect.h"
#include "surfaces.h"

namespace scarp {
namespace {

/// One value per scheme.
struct ByScheme {
  double first_order = 0;
  double eno2 = 0;
  double weno5 = 0;

  double of(Scheme scheme) const {
    return scheme == Scheme::first_order ? first_order : scheme == Scheme::eno2 ? eno2 : weno5;
  }
};

/// A moving surface whose distance is known. Units: nm, s.
struct Case {
  std::string name;
  double speed = 1;
  double time = 4;
  double extent = 18;
  double measured = 18;  ///< width around the middle that the sides of the domain do not reach
  bool two_dimensional = true;
  /// Averaged over positions on the grid: a surface with edges knows where the nodes are.
  bool averaged = false;
  std::function<double(Vec3d r, double t)> distance;
  /// Asserted: the order in nm between two spacings (from the middle to the fine one; of WENO5,
  /// which reaches what single precision and re-distancing allow, from the coarse to the middle
  /// one), and the error at the fine one, in spacings.
  ByScheme least_order;
  ByScheme largest_error;

  friend std::ostream& operator<<(std::ostream& out, const Case& each) { return out << each.name; }
};

/// Mean of |phi - distance| at nodes next to the surface, in spacings; the surface is moved on the
/// grid by shift.
double mean_error(const Case& surface, double h, Scheme scheme, Vec3d shift) {
  const int cells = static_cast<int>(std::lround(surface.extent / h));
  Frame frame{.spacing = h, .cells = {cells, surface.two_dimensional ? 1 : cells}};
  frame.two_dimensional = surface.two_dimensional;
  const auto distance = [&](Vec3d r, double t) { return surface.distance(r - shift, t); };
  Layers layers = single_layer(
      frame, [&](Vec3d r) { return distance(r, 0); }, -surface.extent, surface.extent);
  move(
      layers, surface.time, 0.4 * h, [&](Vec3d, MaterialId) { return surface.speed; }, scheme);
  double sum = 0;
  int count = 0;
  const int top = static_cast<int>(surface.extent / h);
  for (int i = 0; i <= frame.cells[0]; ++i) {
    for (int j = 0; j <= (surface.two_dimensional ? 0 : frame.cells[1]); ++j) {
      for (int k = -top; k <= top; ++k) {
        const Vec3d r{frame.node_position(0, i),
                      surface.two_dimensional ? 0.0 : frame.node_position(1, j), k * h};
        const double exact = distance(r, surface.time);
        if (std::abs(exact) < h && std::abs(r.x) <= surface.measured / 2) {
          sum += std::abs(layers.top().node(i, j, k) - exact / h);
          ++count;
        }
      }
    }
  }
  return sum / count;
}

double mean_error(const Case& surface, double h, Scheme scheme) {
  if (!surface.averaged) {
    return mean_error(surface, h, scheme, {});
  }
  double sum = 0;
  for (const double x : {0.1, 0.35, 0.6, 0.85}) {
    for (const double z : {0.1, 0.35, 0.6, 0.85}) {
      sum += mean_error(surface, h, scheme, h * Vec3d{x, 0, z}) / 16;
    }
  }
  return sum;
}

class Convergence : public testing::TestWithParam<Case> {};

TEST_P(Convergence, HasTheOrderOfTheScheme) {
  const Case& surface = GetParam();
  for (const Scheme scheme : {Scheme::first_order, Scheme::eno2, Scheme::weno5}) {
    const std::array<double, 3> error{mean_error(surface, 2, scheme),
                                      mean_error(surface, 1, scheme),
                                      mean_error(surface, 0.5, scheme)};
    const std::array<double, 2> order{1 + std::log2(error[0] / error[1]),
                                      1 + std::log2(error[1] / error[2])};
    constexpr std::array<const char*, 3> names{"first_order", "eno2", "weno5"};
    std::printf("| %s | %s | %.5f | %.5f | %.5f | %.1f | %.1f |\n", surface.name.c_str(),
                names[static_cast<std::size_t>(scheme)], error[0], error[1], error[2], order[0],
                order[1]);
    EXPECT_GT(order[scheme == Scheme::weno5 ? 0 : 1], surface.least_order.of(scheme))
        << names[static_cast<std::size_t>(scheme)];
    EXPECT_LT(error[2], surface.largest_error.of(scheme))
        << names[static_cast<std::size_t>(scheme)];
  }
}

double outside_corner(double x, double z) {
  return x > 0 && z > 0 ? std::hypot(x, z) : std::max(x, z);
}

/// Two discs side by side. Below the notch where they meet the notch is nearest.
double two_discs(Vec3d r, double radius) {
  constexpr double centre = 8;
  const double across = centre - std::abs(r.x);
  const double from_centre = std::hypot(across, r.z);
  const bool meets_other = radius * across > centre * from_centre;
  if (!meets_other || from_centre >= radius) return from_centre - radius;
  return -std::hypot(r.x, std::abs(r.z) - std::sqrt(radius * radius - centre * centre));
}

std::string test_name(const testing::TestParamInfo<Case>& info) {
  std::string name = info.param.name;
  std::erase_if(name, [](char c) { return c == ' '; });
  return name;
}

// Exact for every scheme: no order, only an error.
const Case plane{
    .name = "tilted plane",
    .extent = 48,
    .measured = 8,
    .distance = [](Vec3d r, double t) { return 0.6 * std::abs(r.x + 24) + 0.8 * (r.z + 20) - t; },
    .least_order = {-100, -100, -100},
    .largest_error = {1e-4, 1e-4, 1e-4}};

const Case cylinder_grows{
    .name = "cylinder grows",
    .distance = [](Vec3d r, double t) { return std::hypot(r.x + 9, r.z) - 10 - t; },
    .least_order = {0.9, 1.9, 3},
    .largest_error = {0.1, 0.003, 0.0003}};

const Case cylinder_shrinks{
    .name = "cylinder shrinks",
    .speed = -1,
    .distance = [](Vec3d r, double t) { return std::hypot(r.x + 9, r.z) - 10 + t; },
    .least_order = {0.9, 1.7, 3},
    .largest_error = {0.15, 0.015, 0.0005}};

const Case cylinders_merge{.name = "cylinders merge",
                           .extent = 16,
                           .distance = [](Vec3d r, double t) { return two_discs(r, 6 + t); },
                           .least_order = {0.9, 1.9, 2.5},
                           .largest_error = {0.15, 0.006, 0.0003}};

const Case edge_rounds{.name = "convex edge grows",
                       .averaged = true,
                       .distance = [](Vec3d r, double t) { return outside_corner(r.x, r.z) - t; },
                       .least_order = {0.75, 0.7, 0.6},
                       .largest_error = {0.2, 0.03, 0.02}};

const Case edge_stays{.name = "convex edge shrinks",
                      .speed = -1,
                      .averaged = true,
                      .distance = [](Vec3d r, double t) { return std::max(r.x, r.z) + t; },
                      .least_order = {1.5, 1.5, 1.5},
                      .largest_error = {0.02, 0.006, 0.004}};

const Case sphere_grows{.name = "sphere grows",
                        .two_dimensional = false,
                        .distance =
                            [](Vec3d r, double t) {
                              return length(r - Vec3d{-9, -9, 0}) - 10 - t;
                            },
                        .least_order = {0.9, 1.9, 1.7},
                        .largest_error = {0.15, 0.006, 0.0006}};

const Case sphere_shrinks{.name = "sphere shrinks",
                          .speed = -1,
                          .two_dimensional = false,
                          .distance =
                              [](Vec3d r, double t) {
                                return length(r - Vec3d{-9, -9, 0}) - 10 + t;
                              },
                          .least_order = {0.9, 1.7, 2.2},
                          .largest_error = {0.25, 0.03, 0.0006}};

INSTANTIATE_TEST_SUITE_P(Surfaces, Convergence,
                         testing::Values(plane, cylinder_grows, cylinder_shrinks, cylinders_merge,
                                         edge_rounds, edge_stays, sphere_grows, sphere_shrinks),
                         test_name);

}  // namespace
}  // namespace scarp

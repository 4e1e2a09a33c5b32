#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "core/running_statistics.h"
#include "flux/solve.h"
#include "tests/flux/calibration.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using exact::Builder;
using exact::Shape;
using exact::Stated;

// Wider at its bottom: 12 at the opening, 28 at a depth of 24.
Shape re_entrant_trench() {
  const Vec3d y{0, 16, 0};
  Builder builder;
  builder.grid({-20, 0, 0}, {14, 0, 0}, 3, y, 4);
  builder.grid({-6, 0, 0}, {-8, 0, -24}, 6, y, 4);
  builder.grid({-14, 0, -24}, {28, 0, 0}, 7, y, 4);
  builder.grid({14, 0, -24}, {-8, 0, 24}, 6, y, 4);
  builder.grid({6, 0, 0}, {14, 0, 0}, 3, y, 4);
  return {builder.mesh, {.lower = {-20, 0}, .upper = {20, 16}}};
}

// Three by three square holes of width 8 and depth 16, 16 apart.
Shape hole_array() {
  constexpr double depth = 16;
  Builder builder;
  const auto is_in_hole = [](int i) { return i % 4 == 1 || i % 4 == 2; };
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j < 12; ++j) {
      const double z = is_in_hole(i) && is_in_hole(j) ? -depth : 0;
      builder.grid({4.0 * i, 4.0 * j, z}, {4, 0, 0}, 1, {0, 4, 0}, 1);
    }
  }
  const Vec3d down{0, 0, -depth};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double x = 16.0 * i + 4;
      const double y = 16.0 * j + 4;
      builder.grid({x, y, 0}, down, 4, {0, 8, 0}, 2);
      builder.grid({x + 8, y + 8, 0}, down, 4, {0, -8, 0}, 2);
      builder.grid({x + 8, y, 0}, down, 4, {-8, 0, 0}, 2);
      builder.grid({x, y + 8, 0}, down, 4, {8, 0, 0}, 2);
    }
  }
  return {builder.mesh, {.lower = {0, 0}, .upper = {48, 48}}};
}

// Three steps down, each 12 wide and 8 high.
Shape terrace() {
  const Vec3d y{0, 24, 0};
  Builder builder;
  for (int step = 0; step < 4; ++step) {
    const double x = 12.0 * step;
    const double z = -8.0 * step;
    builder.grid({x, 0, z}, {12, 0, 0}, 3, y, 6);
    if (step < 3) builder.grid({x + 12, 0, z}, {0, 0, -8}, 2, y, 6);
  }
  return {builder.mesh, {.lower = {0, 0}, .upper = {48, 24}}};
}

Shape shape_of(const std::string& name) {
  if (name == "trench") return exact::trench(2, 8, 16, 10);
  if (name == "hole") return exact::hole(2, 14, 5, 24);
  if (name == "re_entrant") return re_entrant_trench();
  if (name == "array") return hole_array();
  return terrace();
}

class SlowElementSize : public ::testing::TestWithParam<std::tuple<const char*, double>> {};

FluxField gathered(const Shape& shape, double sticking, FluxOptions options) {
  const Species gas{.name = "gas", .sticking = {static_cast<float>(sticking)}};
  options.engine = FluxOptions::Engine::gather;
  options.sides = shape.sides;
  options.spacing = 1;
  return solve_flux(shape.mesh, {&gas, 1}, options).front();
}

// Elements are narrowed until it is.
TEST(ElementSize, LeavesAThirdOfTheTargetAtMost) {
  for (const char* name : {"trench", "terrace"}) {
    for (const double target : {0.02, 0.01}) {
      const FluxField field = gathered(shape_of(name), 1, {.target_error = target});
      EXPECT_LE(field.error, target) << name;
      EXPECT_GT(field.bias, 0) << name;
      EXPECT_LE(field.bias, target / 3) << name;
    }
  }
}

// With elements of two spacings. Where all stick at once, a solve to the target takes nearly as
// many rays as a fine one, so that several of these tell the truth.
std::vector<double> fine_patches(const Shape& shape, double sticking) {
  const std::size_t count = sticking < 1 ? 1 : 8;
  std::vector<double> mean;
  for (std::size_t k = 0; k < count; ++k) {
    const FluxField field =
        gathered(shape, sticking, {.rays = std::uint64_t{1} << 23, .seed = 999 + k});
    const Stated stated = exact::on_patches(field.arrivals());
    mean.resize(stated.value.size());
    for (std::size_t p = 0; p < mean.size(); ++p)
      mean[p] += stated.value[p] / static_cast<double>(count);
  }
  return mean;
}

// What the size of elements leaves is part of the error.
TEST_P(SlowElementSize, IsPartOfTheStatedError) {
  const auto [name, sticking_of_all] = GetParam();
  const double sticking = sticking_of_all;
  const Shape shape = shape_of(name);
  const auto solved = [&](const FluxOptions& options) {
    return gathered(shape, sticking, options);
  };
  const std::vector<double> fine = fine_patches(shape, sticking);
  RunningStatistics squares;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const FluxField field = solved({.target_error = 0.01, .seed = seed});
    const Stated stated = exact::on_patches(field.arrivals());
    RunningStatistics of_seed;
    for (std::size_t p = 0; p < stated.value.size(); ++p) {
      if (stated.error[p] == 0) continue;
      const double z = (stated.value[p] - fine[p]) / stated.error[p];
      of_seed.add(z * z);
    }
    squares.add(of_seed.mean());
    EXPECT_LE(field.bias, 0.01 / 3) << seed;
  }
  const double rms = std::sqrt(squares.mean());
  EXPECT_GT(rms, 0.8);
  EXPECT_LT(rms, 1.2);
  RecordProperty("rms", std::to_string(rms));
}

INSTANTIATE_TEST_SUITE_P(Sticking, SlowElementSize,
                         ::testing::Combine(::testing::Values("trench", "hole", "re_entrant",
                                                              "array", "terrace"),
                                            ::testing::Values(0.1)));
INSTANTIATE_TEST_SUITE_P(AtOnce, SlowElementSize,
                         ::testing::Combine(::testing::Values("trench", "hole", "re_entrant",
                                                              "array", "terrace"),
                                            ::testing::Values(1.0)));

}  // namespace
}  // namespace scarp

#include "levelset/motion/hamiltonian.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace scarp {
namespace {

const double diagonal = std::sqrt(0.5);
const Vec3d down{0, 0, -1};
const Vec3d slanted{0.6, 0, -0.8};

/// A field on a single row.
SpeedField row_field(const RowValues& speed, const std::vector<AngularFactor>& factors,
                     const RowValues& amplitude) {
  SpeedField field{.speed = {speed.begin(), speed.end()}};
  for (const AngularFactor& factor : factors)
    field.angular.push_back({factor, {amplitude.begin(), amplitude.end()}});
  return field;
}

/// Rows in which nodes have nothing in common, with random directions and what is special: no
/// direction, along an axis, equal components, planes of symmetry, both signs of zero.
std::vector<RowVectors> gradient_rows() {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> component(-1.5F, 1.5F);
  std::uniform_int_distribution<int> special(0, 5);
  std::vector<RowVectors> rows(4000);
  for (RowVectors& row : rows) {
    for (int k = 0; k < leaf_edge; ++k) {
      const float size = component(random);
      for (RowValues& along : row) {
        const std::array<float, 6> choices{
            component(random), component(random), 0, -0.0F, size, -size};
        along[k] = choices[special(random)];
      }
    }
  }
  return rows;
}

std::uint32_t bits(float x) { return std::bit_cast<std::uint32_t>(x); }

/// Every node of every row against the factor by itself. Amplitudes are powers of two, so that it
/// makes no difference what they multiply.
void expect_bits_of(const AngularFactor& factor) {
  constexpr RowValues amplitude{-1, 2, 0.5F, -4, 0, 1, -0.25F, 8};
  const SpeedField field = row_field({}, {factor}, amplitude);
  for (const RowVectors& p : gradient_rows()) {
    const Hamiltonian row = hamiltonian(field, 0, p);
    for (int k = 0; k < leaf_edge; ++k) {
      const AngularRate rate = factor.rate({p[0][k], p[1][k], p[2][k]});
      // Sums start at 0, which takes the sign off another 0.
      ASSERT_EQ(bits(row.value[k]), bits(0 + amplitude[k] * rate.value));
      for (int axis = 0; axis < 3; ++axis)
        ASSERT_EQ(bits(row.slope[axis][k]), bits(0 + amplitude[k] * rate.slope[axis]));
    }
  }
}

TEST(Hamiltonian, OfARowHasTheBitsOfTheFactor) {
  const CrystalRates::Values koh{.r100 = 1, .r110 = 1.855, .r111 = 0.0073, .r311 = 1.801};
  expect_bits_of(CrystalRates(koh, {Vec3d{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
  expect_bits_of(
      CrystalRates(koh, {Vec3d{diagonal, diagonal, 0}, {-diagonal, diagonal, 0}, {0, 0, 1}}));
  for (const Vec3d direction : {down, slanted}) {
    expect_bits_of(CosineResponse(direction));
    expect_bits_of(BeamResponse(direction, [](double c) { return c * c * (3 - 2 * c); }));
    expect_bits_of(SlopeResponse(direction, 0.5F, 1, 2));
    expect_bits_of(SlopeResponse(direction, 0.1F, 0.5F, 1));
    expect_bits_of(SlopeResponse(direction, -1, 0.1F, 0.5F));
  }
}

TEST(Hamiltonian, WithoutFactorsIsTheSpeedTimesTheSlope) {
  constexpr RowValues speed{-1, 2, 0.5F, -4, 0, 1, -0.25F, 8};
  const SpeedField field = row_field(speed, {}, {});
  for (const RowVectors& p : gradient_rows()) {
    const Hamiltonian row = hamiltonian(field, 0, p);
    for (int k = 0; k < leaf_edge; ++k) {
      const Vec3f gradient{p[0][k], p[1][k], p[2][k]};
      ASSERT_EQ(row.value[k], speed[k] * length(gradient));
      for (int axis = 0; axis < 3; ++axis)
        ASSERT_EQ(row.slope[axis][k], speed[k] * normalized(gradient)[axis]);
    }
  }
}

TEST(Hamiltonian, AddsUpOverPartsInTheirOrder) {
  constexpr RowValues speed{-1, 2, 0.5F, -4, 0, 1, -0.25F, 8};
  constexpr RowValues amplitude{0.3F, -0.7F, 1.1F, 0, 2.3F, -0.1F, 5, 0.9F};
  const CrystalRates crystal({.r100 = 1, .r110 = 1.8, .r111 = 0.1, .r311 = 1.7},
                             {Vec3d{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  const SpeedField whole = row_field(speed, {CosineResponse(down), crystal}, amplitude);
  const std::array<SpeedField, 3> parts{row_field(speed, {}, {}),
                                        row_field({}, {CosineResponse(down)}, amplitude),
                                        row_field({}, {crystal}, amplitude)};
  for (const RowVectors& p : gradient_rows()) {
    const Hamiltonian row = hamiltonian(whole, 0, p);
    const std::array<Hamiltonian, 3> of{hamiltonian(parts[0], 0, p), hamiltonian(parts[1], 0, p),
                                        hamiltonian(parts[2], 0, p)};
    for (int k = 0; k < leaf_edge; ++k) {
      ASSERT_EQ(row.value[k], (of[0].value[k] + of[1].value[k]) + of[2].value[k]);
      for (int axis = 0; axis < 3; ++axis)
        ASSERT_EQ(row.slope[axis][k],
                  (of[0].slope[axis][k] + of[1].slope[axis][k]) + of[2].slope[axis][k]);
    }
  }
}

TEST(Hamiltonian, KnowsRowsWithoutSpeed) {
  const AngularFactor beam = CosineResponse(down);
  EXPECT_TRUE(has_no_speed(row_field({}, {beam}, {}), 0));
  EXPECT_FALSE(has_no_speed(row_field({0, 0, 0, 0, 0, 0, 0, 1}, {beam}, {}), 0));
  EXPECT_FALSE(has_no_speed(row_field({}, {beam, beam}, {0, 0, 0, -1}), 0));
}

}  // namespace
}  // namespace scarp

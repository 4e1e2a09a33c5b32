#include "flux/error_draws.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/random.h"
#include "core/running_statistics.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

/// A flat wafer in 512 elements with as many rays each: 32 blocks of 16.
class ErrorDrawsTest : public ::testing::Test {
 protected:
  ErrorDrawsTest() {
    plan_.grow(64, 1'000'000);
    for (const RayPlan::Block& block : blocks()) EXPECT_EQ(block.size(), 16U);
    RandomStream random({.seed = 5});
    for (double& half : halves_) half = random.uniform() - 0.5;
  }

  std::vector<RayPlan::Block> blocks() const {
    std::vector<RayPlan::Block> blocks;
    for (const RayPlan::Window& window : plan_.windows())
      blocks.insert(blocks.end(), window.begin(), window.end());
    return blocks;
  }
  std::vector<float> draws(const std::function<bool(std::size_t)>& is_left_out) const {
    return ErrorDraws(options_, plan_, halves_, {}, is_left_out).draws(0, draw_count);
  }
  std::vector<float> draws() const {
    return draws([](std::size_t) { return false; });
  }

  exact::Shape shape_ = exact::flat_wafer(16, 16);
  RayScene scene_{shape_.mesh, shape_.sides, 1};
  Elements elements_{scene_, longest_piece_edge};
  RayPlan plan_{scene_, elements_};
  FluxOptions options_{.sides = shape_.sides};
  std::vector<double> halves_ = std::vector<double>(plan_.size());
};

TEST_F(ErrorDrawsTest, KeepTheSquareOfAllErrors) {
  double square = 0;
  for (const double half : halves_) square += half * half;
  const std::vector<float> errors = draws();
  for (std::size_t draw = 0; draw < draw_count; ++draw) {
    double of_draw = 0;
    for (std::size_t rank = 0; rank < plan_.size(); ++rank) {
      const double error = errors[rank * draw_count + draw];
      of_draw += error * error;
    }
    EXPECT_NEAR(of_draw, square, 1e-5 * square);
  }
}

// What one element of a block has too much of, its neighbour lacks.
TEST_F(ErrorDrawsTest, KeepWhatNeighboursHaveInCommon) {
  for (std::size_t rank = 0; rank < plan_.size(); ++rank) halves_[rank] = rank % 2 == 0 ? 1 : -1;
  const std::vector<float> errors = draws();
  for (const RayPlan::Block& block : blocks()) {
    for (std::size_t draw = 0; draw < draw_count; ++draw) {
      float sum = 0;
      for (std::size_t rank = block.begin; rank < block.end; ++rank)
        sum += errors[rank * draw_count + draw];
      EXPECT_NEAR(sum, 0, 1e-5);
    }
  }
}

// Elements of a trench differ in area; still a block keeps what it has as a whole.
TEST(ErrorDrawsOfUnequalElements, KeepWhatBlocksHaveAsAWhole) {
  const exact::Shape shape = exact::trench(1);
  const RayScene scene(shape.mesh, shape.sides, 1);
  const Elements elements(scene, 1);
  RayPlan plan(scene, elements);
  plan.grow(64, 1'000'000);
  const auto area = [&](std::size_t rank) { return elements.area(plan.element_at(rank)); };
  std::vector<double> halves(plan.size());
  RandomStream random({.seed = 6});
  for (const RayPlan::Window& window : plan.windows())
    for (const RayPlan::Block& block : window) {
      double whole = 0;
      double sum = 0;
      for (std::size_t rank = block.begin; rank < block.end; ++rank) {
        halves[rank] = random.uniform() - 0.5;
        sum += area(rank) * halves[rank];
        whole += area(rank);
      }
      for (std::size_t rank = block.begin; rank < block.end; ++rank) halves[rank] -= sum / whole;
    }
  const FluxOptions options{.sides = shape.sides};
  const std::vector<float> errors =
      ErrorDraws(options, plan, halves, {}, [](std::size_t) { return false; }).draws(0, draw_count);
  for (const RayPlan::Window& window : plan.windows())
    for (const RayPlan::Block& block : window) {
      for (std::size_t draw = 0; draw < draw_count; ++draw) {
        double sum = 0;
        double whole = 0;
        for (std::size_t rank = block.begin; rank < block.end; ++rank) {
          sum += area(rank) * static_cast<double>(errors[rank * draw_count + draw]);
          whole += area(rank);
        }
        EXPECT_NEAR(sum / whole, 0, 1e-6);
      }
    }
}

// Two blocks far apart: the sign of one says nothing of the other's.
TEST_F(ErrorDrawsTest, AreIndependentBetweenBlocks) {
  std::fill(halves_.begin(), halves_.end(), 1.0);
  const std::vector<float> errors = draws();
  for (std::size_t block = 1; block < blocks().size(); ++block) {
    float sum = 0;
    for (std::size_t draw = 0; draw < draw_count; ++draw)
      sum += errors[draw] * errors[blocks()[block].begin * draw_count + draw];
    // Of 32 signs: one in 30'000 pairs of independent ones would be farther off.
    EXPECT_LT(std::abs(sum), 24) << block;
  }
}

TEST_F(ErrorDrawsTest, OfAPartAreThoseOfAll) {
  const std::vector<float> all = draws();
  const std::vector<float> part =
      ErrorDraws(options_, plan_, halves_, {}, [](std::size_t) { return false; }).draws(8, 4);
  for (std::size_t rank = 0; rank < plan_.size(); ++rank)
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_EQ(part[rank * 4 + k], all[rank * draw_count + 8 + k]);
}

// Of the squares of a sum over many seeds, each with its signs, on average.
TEST_F(ErrorDrawsTest, TellTheVarianceOfASum) {
  RandomStream random({.seed = 8});
  std::vector<double> factors(plan_.size());
  for (double& factor : factors) factor = random.uniform();
  RunningStatistics ratio;
  for (std::uint64_t seed = 1; seed <= 64; ++seed) {
    options_.seed = seed;
    const ErrorDraws errors(options_, plan_, halves_, {}, [](std::size_t) { return false; });
    const std::vector<float> drawn = errors.draws(0, draw_count);
    const std::vector<double> variances = errors.variances_of_sum(drawn, factors);
    ASSERT_EQ(variances.size(), draw_count);
    for (std::size_t draw = 0; draw < draw_count; ++draw) {
      double sum = 0;
      for (std::size_t rank = 0; rank < plan_.size(); ++rank)
        sum += factors[rank] * static_cast<double>(drawn[rank * draw_count + draw]);
      ratio.add(sum * sum / variances[draw]);
    }
  }
  EXPECT_NEAR(ratio.mean(), 1, 4 * ratio.std_error());
}

// Of two kinds of elements side by side one scatters ten times as much: none takes the errors of
// the other.
TEST_F(ErrorDrawsTest, GoWithHowFarRaysScatter) {
  std::vector<double> scatter(plan_.size());
  double squares = 0;
  for (std::size_t rank = 0; rank < plan_.size(); ++rank) {
    scatter[rank] = rank % 4 < 2 ? 1 : 10;
    halves_[rank] *= scatter[rank];
    squares += halves_[rank] * halves_[rank];
  }
  const std::vector<float> errors = ErrorDraws(options_, plan_, halves_, scatter, [](std::size_t) {
                                      return false;
                                    }).draws(0, draw_count);
  std::array<double, 2> of_kinds{};
  for (std::size_t k = 0; k < errors.size(); ++k)
    of_kinds[k / draw_count % 4 < 2 ? 0 : 1] += std::pow(static_cast<double>(errors[k]), 2);
  EXPECT_NEAR(of_kinds[1] / of_kinds[0], 100, 25);
  EXPECT_NEAR((of_kinds[0] + of_kinds[1]) / draw_count, squares, 0.1 * squares);
}

// What hits a part of the rays has the Bernoulli moments of that part.
RayScatter scatter_of(std::span<const double> parts) {
  RayScatter scatter;
  for (const double p : parts) {
    const double square = p * (1 - p);
    scatter.squares.push_back(square);
    scatter.fourths.push_back(square * (1 - 3 * square));
  }
  return scatter;
}

// 128 rays of each element, of which a tenth meets something on average: what single elements find
// is chance. Where every second element finds nothing and the others half, it is not.
TEST_F(ErrorDrawsTest, TakeElementsTogetherThatDifferByChance) {
  RandomStream random({.seed = 7});
  std::vector<double> by_chance(plan_.size());
  std::vector<double> by_place(plan_.size());
  for (std::size_t rank = 0; rank < plan_.size(); ++rank) {
    int hits = 0;
    const int rays = static_cast<int>(plan_.rays(rank) * set_count);
    for (int ray = 0; ray < rays; ++ray) hits += random.uniform() < 0.1 ? 1 : 0;
    by_chance[rank] = 1.0 * hits / rays;
    by_place[rank] = rank % 2 == 0 ? 0 : 0.5;
  }
  const std::vector<double> alike = usual_scatter(plan_, scatter_of(by_chance));
  const std::vector<double> apart = usual_scatter(plan_, scatter_of(by_place));
  const auto [least, most] = std::ranges::minmax(alike);
  EXPECT_LT(most, 1.2 * least);
  for (std::size_t rank = 0; rank < plan_.size(); rank += 2)
    EXPECT_LT(apart[rank], 0.3 * apart[rank + 1]);
}

// Draws of 3 times the sum and something that has nothing in common with it.
TEST(KnownSum, CorrectsWhatGoesWithTheSumAndNothingElse) {
  const std::array<double, 4> sums{1, -2, 2, 0.5};
  const std::array<double, 4> rest{2, 1, 0, 0};
  const double variance = 4;
  const KnownSum known(sums, variance);
  std::array<double, 4> corrected = sums;
  known.correct(std::span<double>(corrected));
  double squares = 0;
  for (const double sum : corrected) squares += sum * sum;
  EXPECT_NEAR(squares / 4, variance, 1e-12);
  std::array<float, 4> other{};
  for (std::size_t k = 0; k < 4; ++k) other[k] = static_cast<float>(3 * sums[k] + rest[k]);
  known.correct(std::span<float>(other));
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(other[k], 3 * corrected[k] + rest[k], 1e-5);
}

TEST(KnownSum, OfNothingChangesNothing) {
  const std::array<double, 2> none{};
  std::array<double, 2> draws{1, -1};
  KnownSum(none, 0).correct(std::span<double>(draws));
  EXPECT_EQ(draws, (std::array<double, 2>{1, -1}));
}

TEST_F(ErrorDrawsTest, LeaveOutWhatHasNoError) {
  const auto is_left_out = [](std::size_t rank) { return rank < 100; };
  std::fill_n(halves_.begin(), 100, 0.0);
  const std::vector<float> wanted = draws(is_left_out);
  std::fill_n(halves_.begin(), 100, 1e9);
  const std::vector<float> errors = draws(is_left_out);
  EXPECT_EQ(errors, wanted);
  for (std::size_t k = 0; k < errors.size(); ++k) EXPECT_EQ(errors[k] == 0, k < 100 * draw_count);
}

}  // namespace
}  // namespace scarp

#include "flux/engines/error_draws.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>

#include "core/random.h"
#include "core/running_statistics.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

bool nothing_left_out(std::size_t) { return false; }

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
    return ErrorDraws(options_, plan_, {.halves = halves_}, is_left_out).draws(0, draw_count);
  }
  std::vector<float> draws() const { return draws(nothing_left_out); }

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
      ErrorDraws(options, plan, {.halves = halves}, nothing_left_out).draws(0, draw_count);
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
      ErrorDraws(options_, plan_, {.halves = halves_}, nothing_left_out).draws(8, 4);
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
    const ErrorDraws errors(options_, plan_, {.halves = halves_}, nothing_left_out);
    const std::vector<float> drawn = errors.draws(0, draw_count);
    std::vector<double> of_blocks;
    errors.add_variances_in_sum(drawn, factors, of_blocks);
    ASSERT_EQ(of_blocks.size(), blocks().size());
    const double variances = std::accumulate(of_blocks.begin(), of_blocks.end(), 0.0);
    double squares = 0;
    for (std::size_t draw = 0; draw < draw_count; ++draw) {
      double sum = 0;
      for (std::size_t rank = 0; rank < plan_.size(); ++rank)
        sum += factors[rank] * static_cast<double>(drawn[rank * draw_count + draw]);
      squares += sum * sum;
    }
    ratio.add(squares / variances);
  }
  EXPECT_NEAR(ratio.mean(), 1, 4 * ratio.std_error());
}

double normal(RandomStream& random) {
  double sum = -6;
  for (int k = 0; k < 12; ++k) sum += random.uniform();
  return sum;
}

std::vector<RayPlan::Block> blocks_of(const RayPlan& plan) {
  std::vector<RayPlan::Block> blocks;
  for (const RayPlan::Window& window : plan.windows())
    blocks.insert(blocks.end(), window.begin(), window.end());
  return blocks;
}

constexpr double of_sets = 0.6;  // of the variance that parts let expect

/// What rays tell whose parts and sets are normally distributed, by the variance of an element.
/// common: what the elements of a block have in common, as part of the variance.
Differences normal_differences(const RayPlan& plan, std::uint64_t seed,
                               const std::function<double(std::size_t)>& variance,
                               double common = 0) {
  RandomStream random({.seed = seed});
  Differences of{.halves = std::vector<double>(plan.size()),
                 .parts = decltype(Differences::parts)(plan.size()),
                 .of_rays = std::vector<float>(plan.size())};
  for (const RayPlan::Block& block : blocks_of(plan)) {
    const double rays = plan.rays(block.begin);
    const auto count = part_count(plan, block);
    const double of_part = std::pow(count, 1.5) / of_sets;
    const auto draw = [&](std::size_t rank, double shared) {
      return std::sqrt(variance(rank)) *
             (std::sqrt(common) * shared + std::sqrt(1 - common) * normal(random)) /
             std::pow(rays, 0.75);
    };
    const double shared_by_sets = normal(random);
    for (std::size_t rank = block.begin; rank < block.end; ++rank)
      of.halves[rank] = draw(rank, shared_by_sets);
    for (std::size_t set = 0; set < set_count; ++set) {
      std::vector<double> means(block.size());
      for (std::size_t part = 0; part < count; ++part) {
        const double shared = normal(random);
        for (std::size_t k = 0; k < block.size(); ++k) {
          const double x = std::sqrt(of_part) * draw(block.begin + k, shared);
          of.parts[block.begin + k][set * most_parts + part] = static_cast<float>(x);
          means[k] += x / static_cast<double>(count);
        }
      }
      for (std::size_t part = 0; part < count; ++part)
        for (std::size_t k = 0; k < block.size(); ++k)
          of.parts[block.begin + k][set * most_parts + part] -= static_cast<float>(means[k]);
    }
  }
  return of;
}

class UsualErrorsTest : public ErrorDrawsTest {
 protected:
  Differences differences(std::uint64_t seed, const std::function<double(std::size_t)>& variance,
                          double common = 0) const {
    return normal_differences(plan_, seed, variance, common);
  }
  double expected(double variance) const {
    return std::sqrt(variance) / std::pow(plan_.rays(0), 0.75);
  }
};

TEST_F(UsualErrorsTest, AreThoseOfSets) {
  const auto one = [](std::size_t) { return 1.0; };
  for (const double common : {0.0, 0.5}) {
    RunningStatistics of_elements;
    RunningStatistics of_blocks;
    RunningStatistics of_all;
    for (std::uint64_t seed = 1; seed <= 16; ++seed) {
      const Differences of = differences(seed, one, common);
      const UsualErrors usual(plan_, of, nothing_left_out);
      double expected_square = 0;
      for (const RayPlan::Block& block : blocks()) {
        for (std::size_t rank = block.begin; rank < block.end; ++rank)
          of_elements.add(usual.of_element(rank) / expected(1));
        const double size = block.size();
        const double together = std::sqrt(size * (1 - common + common * size));
        const double of_block = elements_.area(0) * together * expected(1);
        of_blocks.add(usual.of_block(block) / of_block);
        expected_square += of_block * of_block;
      }
      of_all.add(usual.of_all() / std::sqrt(expected_square));
    }
    EXPECT_NEAR(of_all.mean(), 1, 0.1);
    EXPECT_LT(std::sqrt(of_all.variance()), 0.2);
    EXPECT_NEAR(of_elements.mean(), 1, 0.1);
    EXPECT_LT(std::sqrt(of_elements.variance()), 0.3);
    EXPECT_NEAR(of_blocks.mean(), 1, 0.1);
    EXPECT_LT(std::sqrt(of_blocks.variance()), 0.3);
  }
}

// Sets of elements may be a lot better than parts let expect where those of a block are no better:
// what they have too much of is the same.
TEST_F(UsualErrorsTest, OfBlocksAreNotThoseOfTheirElements) {
  const std::uint32_t end = plan_.windows().front().back().end;
  RunningStatistics ratio;
  for (std::uint64_t seed = 1; seed <= 16; ++seed) {
    Differences of = differences(seed, [](std::size_t) { return 1.0; });
    for (const RayPlan::Block& block : plan_.windows().front()) {
      const auto first = of.halves.begin() + block.begin;
      const double mean = std::accumulate(first, first + block.size(), 0.0) / block.size();
      std::fill_n(first, block.size(), mean);
    }
    const UsualErrors usual(plan_, of, nothing_left_out);
    for (const RayPlan::Block& block : plan_.windows().front())
      ratio.add(usual.of_block(block) / (4 * elements_.area(0) * expected(1)));
    EXPECT_LT(usual.of_element(end / 2), 0.6 * expected(1));
  }
  EXPECT_NEAR(ratio.mean(), 1, 0.15);
}

// A wafer in blocks of 16 elements with a floor below it in blocks of 4, where sets are no better
// than two parts: what the many blocks tell of the few is wrong.
TEST(UsualErrorsOfFewElements, AreThoseOfBlocksOfTheirSize) {
  exact::Builder builder;
  builder.grid({0, 0, 0}, {16, 0, 0}, 16, {0, 16, 0}, 16);
  builder.grid({4, 4, -10}, {7, 0, 0}, 7, {0, 2, 0}, 2);
  const RayScene scene(builder.mesh, {.lower = {0, 0}, .upper = {16, 16}}, 1);
  const Elements elements(scene, longest_piece_edge);
  RayPlan plan(scene, elements);
  plan.grow(64, 1'000'000);
  constexpr double times = 3;
  double stated = 0;
  double right = 0;
  for (std::uint64_t seed = 1; seed <= 32; ++seed) {
    Differences of = normal_differences(plan, seed, [](std::size_t) { return 1.0; });
    for (const RayPlan::Block& block : blocks_of(plan)) {
      if (block.size() > 4) continue;
      for (std::size_t rank = block.begin; rank < block.end; ++rank)
        of.halves[rank] *= std::sqrt(times);
    }
    const UsualErrors usual(plan, of, nothing_left_out);
    for (const RayPlan::Block& block : blocks_of(plan)) {
      if (block.size() > 4) continue;
      stated += std::pow(usual.of_block(block), 2);
      right += times * block.size() * std::pow(elements.area(0), 2) /
               std::pow(plan.rays(block.begin), 1.5);
    }
  }
  EXPECT_GT(right, 0);
  EXPECT_GT(stated / right, 0.75);
  EXPECT_LT(stated / right, 1.3);
}

// What few rays find: parts are no better than as many single rays, and sets no better than parts
// by themselves; elsewhere they have half of that variance. A few elements hardly show it.
TEST_F(UsualErrorsTest, OfPartsThatAreNoBetterThanRaysAreThoseOfRays) {
  plan_.grow(256, 1'000'000);
  RunningStatistics bright;
  RunningStatistics even;
  const auto is_left_out = [](std::size_t rank) { return rank % 64 >= 4; };
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Differences of = differences(seed, [](std::size_t) { return 1.0; });
    const double of_part = std::pow(most_parts, 1.5) / of_sets * std::pow(expected(1), 2);
    const auto of_ray = static_cast<float>(of_part * plan_.rays(0) / most_parts);
    const auto square_of_block = [&](float times) {
      of.of_rays_in_parts.assign(plan_.size(), times * of_ray);
      return std::pow(UsualErrors(plan_, of, is_left_out).of_block(blocks().front()), 2);
    };
    bright.add(square_of_block(1));
    even.add(square_of_block(10));
  }
  EXPECT_GT(bright.mean() / even.mean(), 1.3);
  EXPECT_LT(bright.mean() / even.mean(), 2);
}

// Large elements in one corner of a wafer of small ones, where sets are no better than single rays:
// the errors of the small ones, taken as if they fell as those of even sets do, are too small for
// them.
TEST(UsualErrorsOfUnequalElements, AreNotThoseOfTheirNeighbours) {
  exact::Builder builder;
  builder.grid({0, 0, 0}, {16, 0, 0}, 16, {0, 8, 0}, 8);
  builder.grid({16, 0, 0}, {4, 0, 0}, 2, {0, 4, 0}, 2);
  const RayScene scene(builder.mesh, {.lower = {0, 0}, .upper = {20, 8}}, 1);
  const Elements elements(scene, longest_piece_edge);
  RayPlan plan(scene, elements);
  plan.grow(32, 1'000'000);
  RunningStatistics ratio;
  for (std::uint64_t seed = 1; seed <= 64; ++seed) {
    const auto variance = [&](std::size_t rank) {
      return std::pow(plan.rays(plan.block_of(rank).begin), 1.5) / plan.rays(rank);
    };
    const Differences of = normal_differences(plan, seed, variance);
    const UsualErrors usual(plan, of, nothing_left_out);
    for (std::size_t rank = 0; rank < plan.size(); ++rank)
      if (elements.area(plan.element_at(rank)) > 1)
        ratio.add(std::pow(usual.of_element(rank), 2) * plan.rays(rank));
  }
  EXPECT_GT(ratio.count(), 0U);
  EXPECT_NEAR(ratio.mean(), 1, 0.15);
}

// Of many blocks their own squares tell the variance of a sum, whatever is usual; of one hardly.
TEST(VarianceOverBlocks, IsKnownTheBetterTheMoreTheyAre) {
  const auto of = [](std::size_t count) {
    return variance_over_blocks(std::vector<double>(count, 2), std::vector<double>(count, 0.5));
  };
  EXPECT_NEAR(of(1).value, 2 * (1 * 0.5 + 8) / 9, 1e-12);
  EXPECT_NEAR(of(8).value, 8 * 2 * 0.75, 1e-12);
  EXPECT_NEAR(of(10'000).value, 10'000, 20);
  EXPECT_NEAR(of(10'000).freedom, 10'000, 20);
  EXPECT_EQ(of(0).value, 0);
  // Parts of three blocks are few as well.
  EXPECT_LT(of(3).freedom, 20);
  // One of them makes nearly all of the sum.
  EXPECT_NEAR(variance_over_blocks(std::vector<double>{1, 1e-9}, std::vector<double>{0, 25}).value,
              8.0 / 9, 1e-6);
}

// No window takes the errors of another, however little its own half differences tell.
TEST_F(UsualErrorsTest, AreThoseOfTheirWindows) {
  const std::uint32_t end = plan_.windows().front().back().end;
  const auto variance = [&](std::size_t rank) { return rank < end ? 1e-4 : 1.0; };
  RunningStatistics here;
  RunningStatistics elsewhere;
  const Differences of = differences(2, variance);
  const UsualErrors usual(plan_, of, nothing_left_out);
  for (std::size_t rank = 0; rank < plan_.size(); ++rank)
    (rank < end ? here : elsewhere).add(usual.of_element(rank) / expected(variance(rank)));
  EXPECT_NEAR(here.mean(), 1, 0.15);
  EXPECT_NEAR(elsewhere.mean(), 1, 0.1);
}

// How far errors are off in units of what is usual, mean square: half differences of a few elements
// are by chance much too small now and then.
TEST_F(UsualErrorsTest, OfAFewElementsAreKnownByParts) {
  const auto variance = [](std::size_t) { return 1.0; };
  RunningStatistics by_parts;
  RunningStatistics by_halves;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Differences of = differences(seed, variance);
    const auto is_left_out = [](std::size_t rank) { return rank % 64 >= 4; };
    const auto off = [&] {
      return std::pow(expected(1) / UsualErrors(plan_, of, is_left_out).of_element(0), 2);
    };
    by_parts.add(off());
    of.parts.clear();
    by_halves.add(off());
  }
  EXPECT_NEAR(by_parts.mean(), 1, 0.2);
  EXPECT_GT(by_halves.mean(), 1.5);
}

// Half differences that are nothing by chance leave the errors that parts tell.
TEST_F(UsualErrorsTest, OfEqualSetsAreThoseOfParts) {
  Differences of = differences(3, [](std::size_t) { return 1.0; });
  std::fill_n(of.halves.begin(), 8, 0.0);
  EXPECT_GT(UsualErrors(plan_, of, nothing_left_out).of_element(0), 0.4 * expected(1));
}

// Of two kinds of elements side by side one scatters ten times as much: none takes the errors of
// the other.
TEST_F(UsualErrorsTest, GoWithTheirWindowsInDraws) {
  const std::uint32_t end = plan_.windows().front().back().end;
  const auto variance = [&](std::size_t rank) { return rank < end ? 1e-2 : 1.0; };
  const Differences of = differences(4, variance);
  const std::vector<float> errors =
      ErrorDraws(options_, plan_, of, nothing_left_out).draws(0, draw_count);
  std::array<RunningStatistics, 2> squares;
  for (std::size_t k = 0; k < errors.size(); ++k)
    squares[k / draw_count < end ? 0 : 1].add(std::pow(static_cast<double>(errors[k]), 2));
  EXPECT_NEAR(squares[1].mean() / squares[0].mean(), 100, 30);
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

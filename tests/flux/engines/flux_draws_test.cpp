#include "flux/engines/flux_draws.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "core/running_statistics.h"
#include "flux/engines/view.h"
#include "tests/flux/shape_problem.h"

namespace scarp {
namespace {

std::span<const float> of_rank(const FluxDraws& draws, std::size_t rank) {
  return draws.all().subspan(rank * draw_count, draw_count);
}

/// A deep trench in which particles hardly stick, seen along 16 rays from each element. Each block
/// has an error of its own, the same on all its elements: what follows is nearly the same
/// everywhere.
class FluxDrawsTest : public ::testing::Test, protected exact::ShapeProblem {
 protected:
  FluxDrawsTest() : ShapeProblem(exact::trench(6), {.name = "gas", .sticking = {0.002F}}) {
    RandomStream random({.seed = 3});
    for (const RayPlan::Window& window : plan_.windows())
      for (const RayPlan::Block& block : window)
        std::fill(halves_.begin() + block.begin, halves_.begin() + block.end,
                  0.01 * (random.uniform() - 0.5));
  }

  ErrorDraws of_equations(std::uint64_t seed) const {
    seeded_.seed = seed;
    return {seeded_, plan_, {.halves = halves_}, [](std::size_t) { return false; }};
  }
  double area(std::size_t rank) const { return elements.area(plan_.element_at(rank)); }
  // Mean over the draws of the square of all errors, by area.
  template <class OfRank>
  double mean_square(std::size_t count, const OfRank& of_rank) const {
    double sum = 0;
    for (std::size_t rank = 0; rank < plan_.size(); ++rank)
      for (std::size_t k = 0; k < count; ++k)
        sum += area(rank) * static_cast<double>(of_rank(rank)[k]) *
               static_cast<double>(of_rank(rank)[k]) / static_cast<double>(count);
    return sum;
  }
  double corrected(std::uint64_t seed, std::size_t count) const {
    const std::vector<double> weights(plan_.size(), 1);
    FluxDraws draws(plan_, {view_.matrix, view_.rows, &exchange_, reemitted_}, of_equations(seed),
                    weights, 1);
    draws.draw(count);
    EXPECT_EQ(draws.count(), count);
    return mean_square(count, [&](std::size_t rank) { return of_rank(draws, rank); });
  }
  double uncorrected(std::uint64_t seed) const {
    const std::vector<float> solved =
        exchange_.solve<float>(of_equations(seed).draws(0, draw_count), draw_count, 1e-3);
    return mean_square(draw_count, [&](std::size_t rank) {
      return std::span(solved).subspan(rank * draw_count, draw_count);
    });
  }

  View seen() {
    plan_.grow(16, 1'000'000);
    return look({&problem, 1}, plan_, {});
  }

  RayPlan plan_{scene, elements};
  View view_ = seen();
  mutable FluxOptions seeded_ = options;
  std::vector<double> halves_ = std::vector<double>(plan_.size());
  std::vector<float> reemitted_ = std::vector<float>(plan_.size(), 0.998F);
  ExchangeSolver exchange_{view_.rows, reemitted_};
};

// All independent draws of one error tell its square within a quarter.
TEST_F(FluxDrawsTest, EightTellASmoothErrorBetterThanAllWouldPlainly) {
  RunningStatistics by_eight;
  RunningStatistics by_all;
  RunningStatistics plainly;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    by_eight.add(corrected(seed, FluxDraws::at_once));
    by_all.add(corrected(seed, draw_count));
    plainly.add(uncorrected(seed));
  }
  const auto spread = [](const RunningStatistics& of) {
    return of.std_error() * std::sqrt(static_cast<double>(of.count())) / of.mean();
  };
  EXPECT_LT(spread(by_eight), 0.5 * spread(plainly));
  EXPECT_LT(spread(by_all), 0.25 * spread(plainly));
  EXPECT_NEAR(by_eight.mean(), by_all.mean(),
              4 * std::hypot(by_eight.std_error(), by_all.std_error()));
  EXPECT_NEAR(by_all.mean(), plainly.mean(), 4 * plainly.std_error());
}

// As in a slit between a wall and its image in a mirror: hardly a ray leaves, and nearly nothing
// sticks. The flux there is what those few see, not a thousand times as uncertain as all around.
TEST_F(FluxDrawsTest, LeaveWhatSeesMostlyItselfWithinWhatThereIs) {
  constexpr std::size_t slit = 100;
  constexpr float leaving = 1e-3F;
  ExchangeMatrix matrix = view_.matrix;
  const std::uint64_t first = matrix.first[slit];
  const std::uint64_t end = matrix.first[slit + 1];
  for (std::uint64_t k = first + set_count; k < end; ++k) matrix.rays[k] = {.hit = slit};
  for (std::size_t set = 0; set < set_count; ++set) {
    matrix.rays[first + set] = {.hit = static_cast<std::uint32_t>(slit + 1 + set),
                                .weight = leaving};
    matrix.scale[slit][set] = 1.0 / (static_cast<double>(end - first - set_count) + 2 * leaving);
  }
  reemitted_[slit] = 1 - 1e-6F;
  // Much less is known of its neighbours, by whose errors its own is told.
  const RayPlan::Block& block = plan_.block_of(slit);
  std::fill(halves_.begin() + block.begin, halves_.begin() + block.end, 0.1);
  const ExchangeRows rows(matrix);
  const ExchangeSolver exchange(rows, reemitted_);
  FluxDraws draws(plan_, {matrix, rows, &exchange, reemitted_}, of_equations(1),
                  std::vector<double>(plan_.size(), 1), 1);
  draws.draw(draw_count);
  const auto largest = [&](std::size_t rank) {
    float most = 0;
    for (const float each : of_rank(draws, rank)) most = std::max(most, std::abs(each));
    return most;
  };
  EXPECT_LT(largest(slit), 1);
  EXPECT_GT(largest(slit + 1), 0.1);
}

}  // namespace
}  // namespace scarp

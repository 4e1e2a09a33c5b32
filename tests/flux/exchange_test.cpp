#include "flux/exchange.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/parallel.h"
#include "core/random.h"

namespace scarp {
namespace {

// Every row sees random others; a fifth of its rays ends in the sky.
ExchangeMatrix random_exchange(std::uint32_t size, std::uint32_t rays) {
  RandomStream random({.seed = 3});
  ExchangeMatrix matrix;
  for (std::uint32_t i = 0; i < size; ++i) {
    matrix.first.push_back(matrix.hits.size());
    for (std::uint32_t k = 0; k < rays; ++k) matrix.hits.push_back(random.bits() % (size * 5 / 4));
  }
  matrix.first.push_back(matrix.hits.size());
  return matrix;
}

std::vector<double> residual(const ExchangeMatrix& matrix, const std::vector<float>& reemitted,
                             const std::vector<double>& b, const std::vector<double>& x) {
  std::vector<double> r = b;
  for (std::size_t i = 0; i < matrix.size(); ++i) {
    r[i] -= x[i];
    const auto rays = static_cast<double>(matrix.first[i + 1] - matrix.first[i]);
    for (std::uint64_t k = matrix.first[i]; k < matrix.first[i + 1]; ++k) {
      const std::uint32_t j = matrix.hits[k];
      if (j < matrix.size()) r[i] += reemitted[j] * x[j] / rays;
    }
  }
  return r;
}

double norm(const std::vector<double>& x) {
  double sum = 0;
  for (const double value : x) sum += value * value;
  return std::sqrt(sum);
}

// Two facing plates that lose a part p of their rays to the sky: x = 1 / (1 - (1 - p) c).
TEST(Exchange, OfTwoPlatesHasTheGeometricSum) {
  ExchangeMatrix matrix{.first = {0, 4, 8}, .hits = {1, 1, 1, 2, 0, 0, 0, 3}};
  for (const float c : {0.0F, 0.5F, 1.0F}) {
    const std::vector<float> reemitted{c, c};
    const std::vector<double> b{1, 1};
    for (const double x : solve_exchange<double>(matrix, reemitted, b, 1, 1e-12))
      EXPECT_NEAR(x, 1 / (1 - 0.75 * c), 1e-10);
  }
}

TEST(Exchange, MeetsTheTrueResidualForAllColumns) {
  const ExchangeMatrix matrix = random_exchange(3000, 8);
  std::vector<float> reemitted(3000, 0.99F);
  for (std::size_t i = 0; i < 1000; ++i) reemitted[i] = 1;
  constexpr std::size_t columns = 5;
  std::vector<double> b(3000 * columns);
  RandomStream random({.seed = 4});
  for (double& value : b) value = random.uniform_double() - 0.5;
  for (std::size_t i = 0; i < 3000; ++i) b[i * columns + 2] = 0;

  const auto x = solve_exchange<double>(matrix, reemitted, b, columns, 1e-8);
  for (std::size_t c = 0; c < columns; ++c) {
    std::vector<double> column_b;
    std::vector<double> column_x;
    for (std::size_t i = 0; i < 3000; ++i) {
      column_b.push_back(b[i * columns + c]);
      column_x.push_back(x[i * columns + c]);
    }
    EXPECT_LE(norm(residual(matrix, reemitted, column_b, column_x)), 1.001e-8 * norm(column_b));
    if (c == 2) {
      EXPECT_EQ(norm(column_x), 0);
    }
  }
}

// Two rows that only see each other and keep everything have no source and stay at zero.
TEST(Exchange, LeavesAClosedVoidWithoutStickingAtZero) {
  const ExchangeMatrix matrix{.first = {0, 2, 4, 6}, .hits = {1, 1, 0, 0, 2, 3}};
  const std::vector<float> reemitted{1, 1, 1};
  const auto x = solve_exchange<double>(matrix, reemitted, std::vector<double>{0, 0, 1}, 1, 1e-10);
  EXPECT_EQ(x[0], 0);
  EXPECT_EQ(x[1], 0);
  EXPECT_NEAR(x[2], 2, 1e-9);
}

TEST(Exchange, DoesNotDependOnTheNumberOfThreads) {
  constexpr std::size_t size = 5000;
  const ExchangeMatrix matrix = random_exchange(size, 8);
  const std::vector<float> reemitted(size, 0.9F);
  const std::vector<float> b(3 * size, 1.0F);
  std::vector<std::vector<float>> results;
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    results.push_back(solve_exchange<float>(matrix, reemitted, b, 3, 1e-4));
  }
  EXPECT_EQ(results[0], results[1]);
}

}  // namespace
}  // namespace scarp

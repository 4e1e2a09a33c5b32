#include "flux/engines/exchange.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/parallel.h"
#include "core/random.h"
#include "tests/flux/exchange_matrix.h"

namespace scarp {
namespace {

// Every row sees random others; a fifth of its rays ends in the sky.
ExchangeMatrix random_exchange(std::uint32_t size, std::uint32_t rays) {
  RandomStream random({.seed = 3});
  std::vector<std::vector<std::uint32_t>> rows(size, std::vector<std::uint32_t>(rays));
  for (auto& row : rows)
    for (std::uint32_t& hit : row) hit = random.bits() % (size * 5 / 4);
  return exchange_matrix(rows);
}

double norm(const std::vector<double>& x) {
  double sum = 0;
  for (const double value : x) sum += value * value;
  return std::sqrt(sum);
}

// Two facing plates that lose a part p of their rays to the sky: x = 1 / (1 - (1 - p) c).
TEST(Exchange, OfTwoPlatesHasTheGeometricSum) {
  const ExchangeMatrix matrix = exchange_matrix({{1, 1, 1, 2}, {0, 0, 0, 3}});
  for (const float c : {0.0F, 0.5F, 1.0F}) {
    const std::vector<float> reemitted{c, c};
    const std::vector<double> b{1, 1};
    for (const double x :
         ExchangeSolver(ExchangeRows(matrix), reemitted).solve<double>(b, 1, 1e-12))
      EXPECT_NEAR(x, 1 / (1 - 0.75 * c), 1e-10);
  }
}

// Of x = b + K (c x) for a chosen x.
std::vector<double> direct_part(const ExchangeMatrix& matrix, const std::vector<float>& reemitted,
                                const std::vector<double>& x, std::size_t columns) {
  std::vector<double> b = x;
  for (std::size_t i = 0; i < matrix.size(); ++i) {
    const auto rays = matrix.row(i);
    for (std::size_t k = 0; k < rays.size(); ++k) {
      const auto [j, weight] = rays[k];
      const double part = matrix.scale[i][k % 2] * static_cast<double>(weight);
      for (std::size_t c = 0; j < matrix.size() && c < columns; ++c)
        b[i * columns + c] -= part * static_cast<double>(reemitted[j]) * x[j * columns + c];
    }
  }
  return b;
}

void expect_columns_near(const std::vector<double>& x, const std::vector<double>& wanted,
                         std::size_t columns, double tolerance) {
  for (std::size_t c = 0; c < columns; ++c) {
    std::vector<double> column;
    std::vector<double> difference;
    for (std::size_t k = c; k < x.size(); k += columns) {
      column.push_back(wanted[k]);
      difference.push_back(x[k] - wanted[k]);
    }
    EXPECT_LE(norm(difference), tolerance * norm(column)) << "column " << c;
  }
}

// Rays of all weights, in rows of all scales.
TEST(Exchange, MeetsTheToleranceInAllColumns) {
  ExchangeMatrix matrix = random_exchange(3000, 8);
  RandomStream weights({.seed = 6});
  for (ExchangeMatrix::Ray& ray : matrix.rays) ray.weight = weights.uniform();
  for (auto& scales : matrix.scale)
    for (double& scale : scales) scale *= 0.5 + weights.uniform();
  std::vector<float> reemitted(3000, 0.99F);
  for (std::size_t i = 0; i < 1000; ++i) reemitted[i] = 1;
  constexpr std::size_t columns = 5;
  std::vector<double> x(3000 * columns);
  RandomStream random({.seed = 4});
  for (double& value : x) value = random.uniform() - 0.5;
  for (std::size_t i = 0; i < 3000; ++i) x[i * columns + 2] = 0;

  const std::vector<double> b = direct_part(matrix, reemitted, x, columns);
  expect_columns_near(
      ExchangeSolver(ExchangeRows(matrix), reemitted).solve<double>(b, columns, 1e-8), x, columns,
      1e-8);
}

// Rows along a pipe of 4000 that see their neighbours; a particle leaves at its mouth or, hardly
// ever, sticks. The residual of a smooth error is 1e5 times smaller than the error.
TEST(Exchange, MeetsTheToleranceWhereParticlesHardlyStickAndHardlyLeave) {
  constexpr std::uint32_t size = 4000;
  RandomStream random({.seed = 5});
  std::vector<std::vector<std::uint32_t>> rows(size);
  std::vector<double> x;
  for (std::uint32_t i = 0; i < size; ++i) {
    for (int k = 0; k < 8; ++k) {
      const int j = static_cast<int>(i) + static_cast<int>(random.bits() % 201) - 100;
      const bool is_out = j < 0;
      rows[i].push_back(is_out ? size : std::min<std::uint32_t>(j, 2 * size - 1 - j));
    }
    x.push_back(1 - 0.9 * i / size);
  }
  const ExchangeMatrix matrix = exchange_matrix(rows);
  const std::vector<float> reemitted(size, 0.9999F);
  const std::vector<double> b = direct_part(matrix, reemitted, x, 1);
  for (const double tolerance : {1e-2, 1e-5})
    expect_columns_near(
        ExchangeSolver(ExchangeRows(matrix), reemitted).solve<double>(b, 1, tolerance), x, 1,
        tolerance);
}

// From the solution of something else as well as from the right-hand side; next to nothing on the
// right nothing is left of it.
TEST(Exchange, MayStartAnywhere) {
  constexpr std::size_t size = 500;
  const ExchangeMatrix matrix = random_exchange(size, 8);
  const std::vector<float> reemitted(size, 0.95F);
  std::vector<double> x(2 * size);
  for (std::size_t i = 0; i < size; ++i) x[2 * i] = 1 + 0.5 * static_cast<double>(i % 7);
  const std::vector<double> b = direct_part(matrix, reemitted, x, 2);
  std::vector<double> start = x;
  for (double& value : start) value = 3 - 0.9 * value;
  expect_columns_near(
      ExchangeSolver(ExchangeRows(matrix), reemitted).solve<double>(b, 2, 1e-8, start), x, 2, 1e-8);
}

// What a row sees of a facet is the sum over its rays, each with the scale of its set.
TEST(ExchangeRows, TakeTogetherWhatMetTheSame) {
  ExchangeMatrix matrix{.first = {0, 6, 8},
                        .rays = {{1, 1}, {0, 2}, {1, 3}, {1, 4}, {2, 5}, {0, 0}, {1, 1}, {1, 1}},
                        .scale = {{0.5, 0.25}, {-0.5, 0.125}}};
  const ExchangeRows rows(matrix);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows.first, (std::vector<std::uint64_t>{0, 2, 3}));
  EXPECT_EQ(rows.sees_sky, (std::vector<char>{1, 0}));
  EXPECT_EQ(rows.seen[0].hit, 1U);
  EXPECT_EQ(rows.seen[0].part, 0.5F * 1 + 0.5F * 3 + 0.25F * 4);
  EXPECT_EQ(rows.seen[1].hit, 0U);
  EXPECT_EQ(rows.seen[1].part, 0.25F * 2);
  EXPECT_EQ(rows.seen[2].hit, 1U);
  EXPECT_EQ(rows.seen[2].part, -0.375F);  // of a set that counts for more than the whole
}

// Two rows that only see each other and keep everything have no source and stay at zero.
TEST(Exchange, LeavesAClosedVoidWithoutStickingAtZero) {
  const ExchangeMatrix matrix = exchange_matrix({{1, 1}, {0, 0}, {2, 3}});
  const std::vector<float> reemitted{1, 1, 1};
  const auto x = ExchangeSolver(ExchangeRows(matrix), reemitted)
                     .solve<double>(std::vector<double>{0, 0, 1}, 1, 1e-10);
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
    results.push_back(ExchangeSolver(ExchangeRows(matrix), reemitted).solve<float>(b, 3, 1e-4));
  }
  EXPECT_EQ(results[0], results[1]);
}

}  // namespace
}  // namespace scarp

#include "flux/engines/coarse_exchange.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "tests/flux/exchange_matrix.h"

namespace scarp {
namespace {

constexpr std::uint32_t run_length = 128;
constexpr std::uint32_t runs = 10;
constexpr std::uint32_t rows = runs * run_length;

// All rows of a run see the same parts of the runs and of the sky.
ExchangeMatrix exchange_between_runs() {
  RandomStream random({.seed = 8});
  std::vector<std::vector<std::uint32_t>> hits(rows);
  for (std::uint32_t i = 0; i < rows; ++i) {
    const std::uint32_t run = i / run_length;
    for (const std::uint32_t seen :
         {run, (run * 3 + 1) % runs, (run * 5 + 4) % runs, (run * 7 + 2) % (runs + 1)})
      hits[i].push_back(seen * run_length + random.bits() % run_length);
  }
  return exchange_matrix(hits);
}

double of_run(std::uint32_t run, std::size_t column) {
  return std::cos(1.0 + run) + 2.0 * static_cast<double>(column);
}

TEST(CoarseExchange, SolvesForWhatIsConstantOnRuns) {
  constexpr std::size_t columns = 3;
  const ExchangeMatrix matrix = exchange_between_runs();
  const std::vector<float> reemitted(rows, 0.75F);
  std::vector<double> b;
  for (std::uint32_t i = 0; i < rows; ++i) {
    for (std::size_t c = 0; c < columns; ++c) {
      double seen = 0;
      for (const ExchangeMatrix::Ray& ray : matrix.row(i))
        if (ray.hit < rows) seen += of_run(ray.hit / run_length, c);
      b.push_back(of_run(i / run_length, c) - 0.75 * seen / 8);
    }
  }
  CoarseExchange(ExchangeRows(matrix), reemitted).correct(b, columns);
  for (std::uint32_t i = 0; i < rows; ++i)
    for (std::size_t c = 0; c < columns; ++c)
      EXPECT_NEAR(b[i * columns + c], of_run(i / run_length, c), 1e-12);
}

TEST(CoarseExchange, LeavesAloneWhatHasNoMeanOnRuns) {
  std::vector<float> x;
  for (std::uint32_t i = 0; i < rows; ++i) x.push_back(i % 2 == 0 ? 1.5F : -1.5F);
  const std::vector<float> before = x;
  CoarseExchange(ExchangeRows(exchange_between_runs()), std::vector<float>(rows, 0.9F))
      .correct(x, 1);
  EXPECT_EQ(x, before);
}

// Every third row of a run belongs to a void.
TEST(CoarseExchange, PutsNothingIntoAVoid) {
  std::vector<std::vector<std::uint32_t>> hits(rows);
  const auto in_void = [](std::uint32_t i) { return i % 3 == 0; };
  for (std::uint32_t i = 0; i < rows; ++i) {
    const std::uint32_t next = i % 3 == 1 ? i + 1 : i % 3 == 2 ? i + 2 : i + 3;
    hits[i].push_back(next < rows ? next : i % 3 == 0 ? 0 : 1);
    if (!in_void(i)) hits[i].push_back(rows);
  }
  std::vector<double> x;
  for (std::uint32_t i = 0; i < rows; ++i) x.push_back(in_void(i) ? 0 : 1);
  CoarseExchange(ExchangeRows(exchange_matrix(hits)), std::vector<float>(rows, 1)).correct(x, 1);
  for (std::uint32_t i = 0; i < rows; ++i) {
    if (in_void(i)) {
      EXPECT_EQ(x[i], 0);
    } else {
      EXPECT_GT(x[i], 1.1);
    }
  }
}

}  // namespace
}  // namespace scarp

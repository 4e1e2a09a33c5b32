#include "flux/sampling/shared_sums.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"

namespace scarp {
namespace {

// Terms of all sizes to all columns from several buffers at once, some of which fill up.
TEST(SharedSums, HoldEveryTermOfAllBuffers) {
  constexpr std::size_t rows = 3;
  constexpr std::size_t columns = 101;
  constexpr std::size_t terms = 200'000;
  const auto term = [](std::size_t k) {
    RandomStream random({.seed = 1, .ray = k});
    return std::array{random.bits() % rows, random.bits() % columns, std::uint64_t{random.bits()}};
  };
  SharedSums sums(rows, columns);
  parallel_for(terms, 50'000, [&](std::size_t begin, std::size_t end) {
    SharedSums::Buffer buffer(sums);
    for (std::size_t k = begin; k < end; ++k) {
      const auto [row, column, size] = term(k);
      buffer.add(row, column, static_cast<std::uint32_t>(size));
    }
  });
  std::vector<std::int64_t> expected(rows * columns);
  for (std::size_t k = 0; k < terms; ++k) {
    const auto [row, column, size] = term(k);
    expected[row * columns + column] += static_cast<std::int64_t>(size);
  }
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t column = 0; column < columns; ++column)
      EXPECT_EQ(sums.at(row, column), expected[row * columns + column]) << row << ", " << column;
}

TEST(SharedSums, AddsWhatIsLeftWhenABufferGoes) {
  SharedSums sums(1, 2);
  {
    SharedSums::Buffer buffer(sums);
    buffer.add(0, 1, 7);
  }
  EXPECT_EQ(sums.at(0, 0), 0);
  EXPECT_EQ(sums.at(0, 1), 7);
}

}  // namespace
}  // namespace scarp

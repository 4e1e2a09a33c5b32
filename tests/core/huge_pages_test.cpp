#include "core/huge_pages.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace scarp {
namespace {

TEST(HugePages, HoldArraysOfAnySize) {
  for (const std::size_t size : {1U, 100U, 3'000'000U}) {
    LargeVector<std::uint32_t> values(size, 7);
    values.back() = 8;
    LargeVector<std::uint32_t> copy = values;
    values.clear();
    copy.resize(size + 1, 9);
    EXPECT_EQ(copy[size], 9U);
    EXPECT_EQ(copy[size - 1], 8U);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(copy.data()) % 64, 0U);
  }
}

}  // namespace
}  // namespace scarp

#include "core/system/huge_pages.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace scarp {
namespace {

struct alignas(64) Line {
  std::uint32_t value = 0;
};

// On small pages, and on huge ones.
TEST(HugePages, HoldArraysOfAnySize) {
  for (const std::size_t size : {1U, 100U, 600'000U}) {
    LargeVector<Line> values(size, Line{7});
    values.back() = {8};
    LargeVector<Line> copy = values;
    values.clear();
    copy.resize(size + 1, Line{9});
    EXPECT_EQ(copy[size].value, 9U);
    EXPECT_EQ(copy[size - 1].value, 8U);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(copy.data()) % alignof(Line), 0U);
  }
}

}  // namespace
}  // namespace scarp

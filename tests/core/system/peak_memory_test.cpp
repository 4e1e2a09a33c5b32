#include "core/system/peak_memory.h"

#include <gtest/gtest.h>

#include <vector>

namespace scarp {
namespace {

TEST(PeakMemory, RisesWithWhatIsHeldAndStays) {
  constexpr std::size_t megabyte = std::size_t{1} << 20;
  const double before = peak_memory_mb();
  EXPECT_GT(before, 1);
  {
    const auto size = static_cast<std::size_t>(before + 100) * megabyte;
    const std::vector<char> held(size, 1);
    EXPECT_GE(peak_memory_mb(), before + 99);
  }
  EXPECT_GE(peak_memory_mb(), before + 99);
}

}  // namespace
}  // namespace scarp

#include "core/system/peak_memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <string>
#include <vector>

#include "core/system/temporary_folder.h"

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

TEST(AvailableMemory, IsThatOfTheMachineOrOfTheControlGroupIfThatIsLess) {
  const double machine = static_cast<double>(sysconf(_SC_PHYS_PAGES)) *
                         static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
  const TemporaryFolder folder;
  const std::string file = (folder / "memory.max").string();
  EXPECT_EQ(available_memory_mb(file), machine) << "no group";
  const auto with_limit = [&](const std::string& text) {
    std::ofstream(file) << text << '\n';
    return available_memory_mb(file);
  };
  EXPECT_EQ(with_limit("max"), machine);
  EXPECT_EQ(with_limit("67108864"), 64);
  EXPECT_EQ(with_limit("9223372036854771712"), machine) << "more than there is";
  EXPECT_LE(available_memory_mb(), machine);
}

}  // namespace
}  // namespace scarp

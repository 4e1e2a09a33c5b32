#include "core/system/memory_amount.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

TEST(MemoryAmount, IsOfMegabytesOrGigabytes) {
  EXPECT_EQ(parse_memory("512 MB"), 512ULL << 20);
  EXPECT_EQ(parse_memory("8GB"), 8ULL << 30);
  EXPECT_EQ(parse_memory("1.5 GB"), 1536ULL << 20);
  EXPECT_EQ(parse_memory("1e3 MB"), 1000ULL << 20);
}

TEST(MemoryAmount, IsNothingElse) {
  for (const char* text : {"", "MB", "512", "512 mb", "512  MB", "1 MB each", "0.5 MB", "-1 GB",
                           "0 MB", "nan MB", "inf GB", "1e400 MB", "1e9 GB", "8 kB"})
    EXPECT_FALSE(parse_memory(text)) << text;
}

}  // namespace
}  // namespace scarp

#include "core/system/deflate.h"

#include <gtest/gtest.h>
#include <zlib.h>

namespace scarp {
namespace {

TEST(Deflate, ComesBack) {
  for (const std::string& bytes : {std::string(), std::string("abc"), std::string(100'000, 'x')}) {
    const std::string packed = deflated(bytes);
    std::string found(bytes.size() + 1, '\0');
    uLongf size = found.size();
    ASSERT_EQ(uncompress(reinterpret_cast<Bytef*>(found.data()), &size,
                         reinterpret_cast<const Bytef*>(packed.data()), packed.size()),
              Z_OK);
    EXPECT_EQ(found.substr(0, size), bytes);
    EXPECT_LT(packed.size(), bytes.size() / 100 + 20);
    EXPECT_EQ(inflated(packed, bytes.size()), bytes);
  }
}

TEST(Deflate, DamagedStreamsAndOtherSizesGiveNothing) {
  const std::string packed = deflated("abcdefgh");
  EXPECT_FALSE(inflated(packed, 7));
  EXPECT_FALSE(inflated(packed, 9));
  EXPECT_FALSE(inflated(packed, std::size_t{1} << 60));
  EXPECT_FALSE(inflated(packed.substr(0, 8), 8));
  EXPECT_FALSE(inflated("", 0));
  std::string damaged = packed;
  damaged[4] ^= 1;
  EXPECT_FALSE(inflated(damaged, 8));
}

}  // namespace
}  // namespace scarp

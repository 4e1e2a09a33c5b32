#include "core/deflate.h"

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
  }
}

}  // namespace
}  // namespace scarp

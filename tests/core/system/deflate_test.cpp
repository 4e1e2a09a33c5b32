#include "core/system/deflate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "core/error.h"
#include "core/random.h"

namespace scarp {
namespace {

std::string gzipped(std::string bytes) {
  z_stream stream{};
  constexpr int gzip_format = 15 + 16;
  deflateInit2(&stream, Z_BEST_SPEED, Z_DEFLATED, gzip_format, 8, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

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

TEST(Gunzipped, IsWhatWasPacked) {
  RandomStream random({.seed = 2});
  std::string numbers;  // more than the buffer holds at once
  for (int n = 0; n < 3 << 20; ++n) numbers.push_back(static_cast<char>(random.bits() & 0x1fU));
  constexpr std::size_t most = std::size_t{4} << 20;
  for (const std::string& bytes : {std::string(), std::string("abc"), numbers})
    EXPECT_TRUE(gunzipped(gzipped(bytes), most) == bytes);
}

TEST(Gunzipped, RefusesWhatIsDamagedCutOffOrTooLarge) {
  const auto refuses = [](const std::string& packed, std::size_t most, const char* why) {
    EXPECT_THAT([&] { gunzipped(packed, most); },
                testing::ThrowsMessage<InputError>(testing::HasSubstr(why)));
  };
  const std::string packed = gzipped(std::string(1000, 'x'));
  EXPECT_EQ(gunzipped(packed, 1000).size(), 1000U);
  refuses(packed, 999, "holds more than 999 bytes");
  refuses(packed.substr(0, packed.size() - 9), 1000, "ends early");
  refuses("", 1000, "ends early");
  std::string damaged = packed;
  damaged[packed.size() - 6] ^= 1;
  refuses(damaged, 1000, "is damaged");
  refuses("no gzip at all", 1000, "is damaged");
}

}  // namespace
}  // namespace scarp

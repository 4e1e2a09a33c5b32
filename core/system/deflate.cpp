#include "core/system/deflate.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "core/error.h"

namespace scarp {

std::string deflated(std::string_view bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  const int status =
      compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), Z_BEST_COMPRESSION);
  SCARP_ASSERT(status, ==, Z_OK);
  packed.resize(size);
  return packed;
}

std::string gunzipped(std::string_view bytes, std::size_t most) {
  constexpr int gzip_format = 15 + 16;
  z_stream stream{};
  SCARP_ASSERT(inflateInit2(&stream, gzip_format), ==, Z_OK);
  const std::unique_ptr<z_stream, int (*)(z_stream*)> ends(&stream, inflateEnd);
  std::string unpacked;
  std::string buffer(std::size_t{1} << 20, '\0');
  int status = Z_OK;
  while (status == Z_OK) {
    if (stream.avail_in == 0) {
      const std::size_t count =
          std::min<std::size_t>(bytes.size(), std::numeric_limits<uInt>::max());
      if (count == 0) throw InputError("its compressed data ends early; write or copy it again");
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
      stream.avail_in = static_cast<uInt>(count);
      bytes.remove_prefix(count);
    }
    stream.next_out = reinterpret_cast<Bytef*>(buffer.data());
    stream.avail_out = static_cast<uInt>(buffer.size());
    status = inflate(&stream, Z_NO_FLUSH);
    unpacked.append(buffer, 0, buffer.size() - stream.avail_out);
    if (unpacked.size() > most)
      throw InputError(fmt::format("its compressed data holds more than {} bytes", most));
    if (status == Z_BUF_ERROR) status = Z_OK;
  }
  if (status != Z_STREAM_END)
    throw InputError("its compressed data is damaged; write or copy it again");
  return unpacked;
}

std::optional<std::string> inflated(std::string_view stream, std::size_t size) {
  // No stream of zlib holds more: a size that is made up takes no memory.
  constexpr std::size_t most_per_byte = 1040;
  if (size / most_per_byte > stream.size()) return {};
  // One byte more, so that a stream that holds too much is seen.
  std::string bytes(size + 1, '\0');
  auto found = static_cast<uLongf>(bytes.size());
  const int status =
      uncompress(reinterpret_cast<Bytef*>(bytes.data()), &found,
                 reinterpret_cast<const Bytef*>(stream.data()), static_cast<uLong>(stream.size()));
  if (status != Z_OK || found != size) return {};
  bytes.resize(size);
  return bytes;
}

}  // namespace scarp

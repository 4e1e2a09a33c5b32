#include "core/deflate.h"

#include <zlib.h>

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

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

}  // namespace scarp

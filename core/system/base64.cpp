#include "core/system/base64.h"

#include <cstdint>

namespace scarp {

std::string base64(std::string_view bytes) {
  constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t n = 0; n < bytes.size(); n += 3) {
    const auto byte = [&](std::size_t k) -> std::uint32_t {
      return n + k < bytes.size() ? static_cast<unsigned char>(bytes[n + k]) : 0;
    };
    const std::uint32_t bits = byte(0) << 16 | byte(1) << 8 | byte(2);
    for (std::size_t k = 0; k < 4; ++k) {
      const bool is_padding = n + k > bytes.size();
      text += is_padding ? '=' : digits[bits >> (18 - 6 * k) & 63];
    }
  }
  return text;
}

}  // namespace scarp

#include "core/system/memory_amount.h"

#include <charconv>

namespace scarp {

std::optional<std::uint64_t> parse_memory(std::string_view text) {
  constexpr double megabyte = 1024.0 * 1024.0;
  double amount = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, amount);
  if (error != std::errc{}) return std::nullopt;
  std::string_view unit(rest, static_cast<std::size_t>(end - rest));
  if (unit.starts_with(' ')) unit.remove_prefix(1);
  const double bytes = amount * (unit == "MB" ? megabyte : unit == "GB" ? 1024 * megabyte : 0);
  if (!(bytes >= megabyte && bytes <= 1e15)) return std::nullopt;
  return static_cast<std::uint64_t>(bytes);
}

}  // namespace scarp

#include "core/plain_number.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace scarp {

std::string plain_number(double value, int digits) {
  const double size = std::abs(value);
  if (value == 0) return "0";
  if (!(size >= 1e-4 && size < 1e9)) return fmt::format("{:.{}g}", value, digits);
  const int before_point = 1 + static_cast<int>(std::floor(std::log10(size)));
  std::string text = fmt::format("{:.{}f}", value, std::max(0, digits - before_point));
  if (text.find('.') == std::string::npos) return text;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string plain_duration(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  if (seconds < 6000) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace scarp

#include "apps/simulator/region_text.h"

#include <fmt/format.h>

#include <algorithm>

namespace scarp {

namespace {

std::string volume_text(const Frame& frame, double volume) {
  return frame.is_slice() ? fmt::format("{:.4g} um^2", 1e-6 * volume / frame.spacing)
                          : fmt::format("{:.4g} um^3", 1e-9 * volume);
}

}  // namespace

double volume_of(std::span<const Region> regions) {
  double volume = 0;
  for (const Region& region : regions) volume += region.images * region.volume;
  return volume;
}

std::size_t count_of(std::span<const Region> regions) {
  std::size_t count = 0;
  for (const Region& region : regions) count += static_cast<std::size_t>(region.images);
  return count;
}

std::string counted(std::size_t count, std::string_view what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string loose_solid_text(const Frame& frame, const RemovedSolid& islands) {
  if (islands.count == 0) return "";
  return fmt::format(
      "the start geometry has solid that is not connected to the wafer: {} of {}, left out",
      counted(islands.count, "piece"), volume_text(frame, islands.volume));
}

std::vector<std::string> region_lines(const Frame& frame, std::span<const Region> regions) {
  constexpr std::size_t most_told = 8;
  std::vector<std::string> lines;
  for (const Region& region : regions.first(std::min(regions.size(), most_told))) {
    const std::string images = region.images > 1 ? fmt::format("{} times ", region.images) : "";
    lines.push_back(fmt::format("  {}{} between z = {:.4g} nm and {:.4g} nm", images,
                                volume_text(frame, region.volume), region.lower, region.upper));
  }
  if (regions.size() > most_told) {
    lines.push_back(fmt::format("  and {} more", regions.size() - most_told));
  }
  return lines;
}

}  // namespace scarp

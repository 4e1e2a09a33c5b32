#include "apps/flux_target.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/csv_table.h"

namespace scarp {

FluxTarget flux_target(const std::filesystem::path& metrics, const Recipe& recipe) {
  const bool in_position = recipe.position_error > 0;
  const CsvTable table(metrics);
  FluxTarget result{.time_steps = table.row_count()};
  if (recipe.flux.rays == 0)
    result.target = in_position ? recipe.position_error : recipe.flux.target_error;
  for (std::size_t row = 0; row < table.row_count(); ++row) {
    const double error =
        table.number(row, in_position ? "position_error_nm" : "flux_error").value_or(0);
    result.largest = std::max(result.largest, error);
    result.missed += result.target > 0 && error > result.target ? 1 : 0;
  }
  return result;
}

std::string missed_target_text(const FluxField& flux, const FluxOptions& options,
                               const TargetKeys& keys) {
  switch (*flux.missed_by) {
    case RayCap::memory:
      return fmt::format("{} ({:.3g} MB) holds no more than these {} rays; raise it or {}",
                         keys.memory_limit, static_cast<double>(options.memory_limit) / (1 << 20),
                         flux.rays, keys.target);
    case RayCap::elements:
      return fmt::format(
          "pieces of the surface send no more than these {} rays; set {} to "
          "\"forward\" or raise {}",
          flux.rays, keys.engine, keys.target);
    case RayCap::rays:
      break;
  }
  if (flux.rays > options.max_rays) {
    return fmt::format(
        "{} is {}, and no more were sent than the {} that it takes at least; raise "
        "it or {}",
        keys.max_rays, options.max_rays, flux.rays, keys.target);
  }
  return fmt::format("the cap of {} rays came first; raise {} or {}", options.max_rays,
                     keys.max_rays, keys.target);
}

}  // namespace scarp

#include "apps/simulator/flux_target.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/recipe/csv_table.h"

namespace scarp {

WantedError wanted_error(const FluxPlan& plan) {
  if (plan.options.rays > 0) return {};
  if (plan.position_error > 0) return {.in_position = true, .value = plan.position_error};
  return {.value = plan.options.target_error};
}

std::string WantedError::text(double error) const {
  return fmt::format("{:.3g}{}", error, in_position ? " nm" : "");
}

FluxTarget flux_target(const std::filesystem::path& metrics, const FluxPlan& plan) {
  const CsvTable table(metrics);
  const WantedError wanted = wanted_error(plan);
  FluxTarget result{.wanted = wanted, .time_steps = table.row_count()};
  for (std::size_t row = 0; row < table.row_count(); ++row) {
    const double error =
        table.number(row, wanted.in_position ? "position_error_nm" : "flux_error").value_or(0);
    result.largest = std::max(result.largest, error);
    result.missed += wanted.value > 0 && error > wanted.value ? 1 : 0;
  }
  return result;
}

std::string missed_target_text(const FluxField& flux, const FluxOptions& options,
                               const TargetKeys& keys) {
  switch (*flux.missed_by) {
    case RayCap::memory:
      if (keys.memory_limit.empty()) {
        return fmt::format("the memory for hits holds no more than these {} rays; raise {}",
                           flux.rays, keys.target);
      }
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
        "{} is {}, fewer than the {} that are needed at least and were sent; raise it or {}",
        keys.max_rays, options.max_rays, flux.rays, keys.target);
  }
  return fmt::format("the cap of {} rays came first; raise {} or {}", options.max_rays,
                     keys.max_rays, keys.target);
}

}  // namespace scarp

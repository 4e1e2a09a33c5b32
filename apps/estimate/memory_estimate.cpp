#include "apps/estimate/memory_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/simulator/simplify_choice.h"
#include "core/error.h"
#include "levelset/grid/slope.h"

namespace scarp {

namespace {

constexpr double megabyte = 1024 * 1024;

// Measured by /usr/bin/time -v of runs that have much of one thing: a fine grid, a full mesh, many
// rays, many outputs; and of small runs.
constexpr double program = 45 * megabyte;
constexpr double band_copies = 3;
constexpr double per_full_facet = 350;
constexpr double per_facet = 500;
constexpr double per_kept_ray = 18;
constexpr double per_facet_of_output = 140;
constexpr double per_bath_node = 200;  // see diffuse()

// Of a mesh that is not made yet.
constexpr double simplified_part = 0.15;

double bath_nodes(const Layers& layers) {
  const Frame& frame = layers.frame;
  const double height = (layers.top().upper() - layers.top().lower()) / frame.spacing;
  const double above = std::max(frame.cells[0], frame.cells[1]);
  return (frame.cells[0] + 1.0) * (frame.cells[1] + 1.0) * (height + above);
}

MemoryEstimate memory_of(double grid, const RunSize& size) {
  const double hits =
      std::min(per_kept_ray * size.kept_rays,
               per_kept_ray / bytes_per_hit * static_cast<double>(size.memory_limit));
  return {.program = program / megabyte,
          .grid = grid / megabyte,
          .mesh = per_full_facet * size.facets_full / megabyte,
          .flux = (per_facet * size.facets + hits) / megabyte,
          .output = per_facet_of_output * size.facets * size.outputs / megabyte};
}

RunSize size_of(double facets, std::span<const ProcessStep> steps,
                const Simplification& simplification, const FluxOptions& flux) {
  const bool keeps_rays = flux.engine != FluxOptions::Engine::forward;
  std::size_t species = 0;
  const auto is_simplified = [&](const ProcessStep& step) {
    const auto count = static_cast<std::size_t>(facets);
    return simplification.options &&
           simplify_choice(simplification, step, count) == SimplifyChoice::simplify;
  };
  for (const ProcessStep& step : steps)
    if (step.model) species = std::max(species, step.model->species().size());
  return {.facets_full = facets,
          .facets = std::ranges::all_of(steps, is_simplified) ? simplified_part * facets : facets,
          .kept_rays = keeps_rays ? static_cast<double>(flux.rays * species) : 0,
          .memory_limit = flux.memory_limit};
}

}  // namespace

MemoryEstimate expected_memory(const Layers& layers, std::span<const ProcessStep> steps,
                               const RunSize& size) {
  double grid = band_copies * static_cast<double>(layers.top().memory_bytes());
  for (const Layer& layer : layers.stack) grid += static_cast<double>(layer.phi.memory_bytes());
  const bool has_bath = std::ranges::any_of(
      steps, [](const ProcessStep& step) { return step.model && step.model->bath() != nullptr; });
  if (has_bath) grid += per_bath_node * bath_nodes(layers);
  return memory_of(grid, size);
}

// A facet for each node beside a surface in space, and two for a place of four nodes in a
// cross-section.
RunSize size_from_grid(const Layers& layers, std::span<const ProcessStep> steps,
                       const Simplification& simplification, const FluxOptions& flux) {
  const auto nodes = static_cast<double>(surface_slopes(layers.top()).nodes);
  const bool is_half = layers.frame.is_section() || layers.frame.diagonal;
  return size_of(is_half ? nodes / 2 : nodes, steps, simplification, flux);
}

// One layer whose band is one leaf of 8 x 8 x 8 nodes high, and two facets on each place of four
// nodes; of a square that may be its own image across the diagonal one.
MemoryEstimate least_memory(const Recipe& recipe) {
  const Frame& frame = recipe.domain.frame;
  double places = 1;
  double nodes = 8;
  for (int axis = 0; axis < 2; ++axis) {
    const bool may_be_half = recipe.domain.uses_symmetry && frame.varies_along(axis);
    const double cells = may_be_half ? frame.cells[axis] / 2 : frame.cells[axis];
    places *= cells;
    nodes *= 8 * std::ceil(cells / 8);
  }
  const bool may_be_eighth = recipe.domain.uses_symmetry && frame.is_square();
  const RunSize size = size_of(may_be_eighth ? places : 2 * places, recipe.steps,
                               recipe.simplification, recipe.flux.options);
  return memory_of((band_copies + 1) * sizeof(float) * nodes, size);
}

std::string memory_limit_text(double limit) {
  return fmt::format("more than the {:.0f} MB of --memory-limit", limit);
}

void require_memory(const MemoryEstimate& memory, double limit, std::string_view about) {
  if (memory.total() <= limit) return;
  throw InputError(fmt::format("the run takes {} {} of memory, {}; {}", about, memory_text(memory),
                               memory_limit_text(limit), memory_remedy));
}

void require_memory_of_start(MemoryEstimate memory, double limit) {
  memory.flux = 0;
  memory.output = 0;
  if (memory.total() <= limit) return;
  throw InputError(fmt::format("the wafer takes at least {} of memory, {}; {}", memory_text(memory),
                               memory_limit_text(limit), memory_remedy));
}

std::string memory_text(const MemoryEstimate& memory) {
  return fmt::format(
      "{:.0f} MB (program {:.0f}, grid {:.0f}, mesh {:.0f}, flux {:.0f}, outputs {:.0f})",
      memory.total(), memory.program, memory.grid, memory.mesh, memory.flux, memory.output);
}

}  // namespace scarp

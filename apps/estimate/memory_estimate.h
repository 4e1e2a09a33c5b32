#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "apps/simulator/recipe.h"
#include "levelset/grid/layers.h"

namespace scarp {

/// What flux.memory_limit counts for a gathered ray.
inline constexpr double bytes_per_hit = 16;

/// What a run holds at once, by what it is for. Units: MB of 1024 * 1024 bytes.
struct MemoryEstimate {
  double program = 0;
  double grid = 0;    ///< the layers, what a time step copies of them, and a bath above them
  double mesh = 0;    ///< the full surface, and its simplification
  double flux = 0;    ///< elements, the tree over them, and the hits of rays that are kept
  double output = 0;  ///< the report of all outputs

  double total() const { return program + grid + mesh + flux + output; }
};

/// The sizes on which it depends.
struct RunSize {
  double facets_full = 0;
  double facets = 0;
  double kept_rays = 0;  ///< of a time step, those whose hits are stored: none of forward tracing
  std::uint64_t memory_limit = 0;  ///< of these hits; bytes
  double outputs = 0;
};

/// From the sizes of a run and the grid that it stands on; within a factor of two of what runs of
/// the recipes of configs/ hold.
MemoryEstimate expected_memory(const Layers& layers, std::span<const ProcessStep> steps,
                               const RunSize& size);

/// The size of a run before anything but its grid is made: rays as far as the recipe fixes them.
RunSize size_from_grid(const Layers& layers, std::span<const ProcessStep> steps,
                       const Simplification& simplification, const FluxOptions& flux);

/// What a run holds at least, as much as one on a flat wafer of the extent: known before its grid
/// is made.
MemoryEstimate least_memory(const Recipe& recipe);

/// What to do about a limit that is too low.
inline constexpr const char* memory_remedy =
    "raise it, or use a coarser spacing or a smaller extent";

/// "more than the 4096 MB of --memory-limit"
std::string memory_limit_text(double limit);

/// Throws: InputError where a run takes more than the limit, in MB.
void require_memory(const MemoryEstimate& memory, double limit, std::string_view about = "about");

/// The same for the layers and the full surface alone, of what a run holds at least.
void require_memory_of_start(MemoryEstimate least, double limit);

/// "90 MB (program 45, grid 10, mesh 20, flux 12, outputs 3)"
std::string memory_text(const MemoryEstimate& memory);

}  // namespace scarp

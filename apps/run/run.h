#pragma once

#include <atomic>
#include <filesystem>
#include <functional>

#include "apps/simulator/recipe.h"
#include "apps/simulator/simulator.h"
#include "core/log.h"
#include "core/system/peak_memory.h"

namespace scarp {

struct RunOptions {
  bool resume = false;
  /// When set, the run ends as soon as it has a state that can be gone on from: after a time step,
  /// or before the first one, but not within the solution of a flux.
  const std::atomic<bool>* stop = nullptr;
  /// When set, a checkpoint is written after the time step, and it is cleared.
  std::atomic<bool>* checkpoint = nullptr;
  double memory_limit_mb = available_memory_mb();  ///< see expected_memory()
  Log log{};  ///< gets voids, targets that were not reached, a run that is replaced
  /// Called before the first file is written: until then nothing is lost by ending the process.
  /// May be empty.
  std::function<void()> begin{};
  /// Told after every time step; may be empty.
  std::function<void(const State&, const Survey&)> progress;
};

enum class RunEnd { complete, interrupted, was_complete };

/// Runs a recipe from start to end, with all result files in the folder.
///
/// Checkpoints are written at outputs, between them as the recipe says or when one is asked for,
/// and when the run is interrupted or cannot go on.
/// Throws: InputError before a result is written, also where it will take more memory than the
///         limit; NumericalError from then on, with the checkpoint of the last good state.
RunEnd run(Recipe recipe, const std::filesystem::path& folder, const RunOptions& options);

}  // namespace scarp

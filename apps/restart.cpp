#include "apps/restart.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "core/error.h"
#include "core/hash.h"
#include "core/quantity.h"
#include "levelset/checkpoint.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

std::string recipe_hash(const Recipe& recipe) {
  Hash hash;
  hash.add(recipe.resolved);
  return hash.hex();
}

std::string joined(std::span<const double> numbers) {
  std::string text;
  for (const double number : numbers) {
    if (!text.empty()) text += ' ';
    text += format_number(number);
  }
  return text;
}

// For each void its first node, volume, heights, and when it was closed.
constexpr std::size_t numbers_per_void = 7;

std::vector<double> numbers_of(std::span<const VoidClosure> voids) {
  std::vector<double> numbers;
  for (const VoidClosure& each : voids) {
    const auto& [node, volume, lower, upper] = each.region;
    numbers.insert(numbers.end(), node.begin(), node.end());
    numbers.insert(numbers.end(), {volume, lower, upper, each.time});
  }
  return numbers;
}

std::vector<VoidClosure> voids_of(std::span<const double> numbers, const fs::path& file) {
  if (numbers.size() % numbers_per_void != 0) {
    throw InputError(
        fmt::format("{}: the entry voids is not whole; it is not of this version", file.string()));
  }
  std::vector<VoidClosure> voids;
  for (; !numbers.empty(); numbers = numbers.subspan(numbers_per_void)) {
    const auto node = [&](std::size_t axis) { return static_cast<int>(numbers[axis]); };
    voids.push_back({.region = {.first_node = {node(0), node(1), node(2)},
                                .volume = numbers[3],
                                .lower = numbers[4],
                                .upper = numbers[5]},
                     .time = numbers[6]});
  }
  return voids;
}

CheckpointNotes notes_of(const State& state, const Recipe& recipe,
                         std::span<const double> output_times) {
  return {{"time_s", format_number(state.time)},
          {"step", std::to_string(state.step)},
          {"step_start_s", format_number(state.step_start)},
          {"time_step", std::to_string(state.time_step)},
          {"seed", std::to_string(recipe.flux.seed)},
          {"output_times_s", joined(output_times)},
          {"voids", joined(numbers_of(state.voids))},
          {"islands_removed", std::to_string(state.islands.count)},
          {"island_volume_nm3", format_number(state.islands.volume)},
          {"recipe_hash", recipe_hash(recipe)}};
}

std::vector<double> numbers_of(const CheckpointNotes& notes, const std::string& key,
                               const fs::path& file) {
  const auto entry = notes.find(key);
  if (entry == notes.end()) {
    throw InputError(fmt::format("{}: the entry {} is missing; this is not a checkpoint of a run",
                                 file.string(), key));
  }
  std::vector<double> numbers;
  std::istringstream text(entry->second);
  for (std::string word; text >> word;) numbers.push_back(std::strtod(word.c_str(), nullptr));
  return numbers;
}

double number_of(const CheckpointNotes& notes, const std::string& key, const fs::path& file) {
  const std::vector<double> numbers = numbers_of(notes, key, file);
  if (numbers.size() == 1) return numbers.front();
  throw InputError(fmt::format(
      "{}: the entry {} is not a number; this is not a checkpoint of a run", file.string(), key));
}

Restart read_restart(const fs::path& file, const Recipe& recipe) {
  Checkpoint checkpoint = read_checkpoint(file);
  const auto value = [&](const char* key) { return number_of(checkpoint.notes, key, file); };
  if (const auto hash = checkpoint.notes.find("recipe_hash");
      hash == checkpoint.notes.end() || hash->second != recipe_hash(recipe)) {
    throw InputError(fmt::format("{}: belongs to another recipe", file.string()));
  }
  return {.state = {.layers = std::move(checkpoint.layers),
                    .time = value("time_s"),
                    .step = static_cast<std::size_t>(value("step")),
                    .step_start = value("step_start_s"),
                    .time_step = static_cast<std::uint32_t>(value("time_step")),
                    .voids = voids_of(numbers_of(checkpoint.notes, "voids", file), file),
                    .islands = {.count = static_cast<std::size_t>(value("islands_removed")),
                                .volume = value("island_volume_nm3")}},
          .file = file,
          .output_times = numbers_of(checkpoint.notes, "output_times_s", file)};
}

}  // namespace

void write_restart(const fs::path& file, const State& state, std::span<const double> output_times,
                   const Recipe& recipe) {
  write_checkpoint(file, state.layers, notes_of(state, recipe, output_times));
}

std::optional<Restart> newest_restart(std::span<const fs::path> checkpoints, std::size_t row_count,
                                      const Recipe& recipe, const Log& log) {
  // Outputs are numbered in the order of time; only the checkpoint of an interrupted run is not.
  std::vector<fs::path> newest_first(checkpoints.begin(), checkpoints.end());
  std::sort(newest_first.begin(), newest_first.end(), [](const fs::path& a, const fs::path& b) {
    const std::string left = a.filename().string();
    const std::string right = b.filename().string();
    return std::pair(left.size(), left) > std::pair(right.size(), right);
  });
  std::optional<Restart> newest;
  for (const fs::path& file : newest_first) {
    try {
      Restart restart = read_restart(file, recipe);
      if (restart.state.time_step >= row_count) {
        throw InputError(
            fmt::format("{}: metrics.csv has no rows for its time steps", file.string()));
      }
      if (!newest || restart.state.time_step > newest->state.time_step) {
        newest = std::move(restart);
      }
      if (file.filename() != interrupted_state) break;
    } catch (const InputError& error) {
      log.warn(fmt::format("{}; going on from an earlier checkpoint", error.what()));
    }
  }
  return newest;
}

std::string state_hash(const State& state, const Recipe& recipe) {
  Hash result;
  for (const Layer& layer : state.layers.stack) {
    result.add(recipe.materials[layer.material].name);
    result.add("\n");
  }
  result.add_value(hash(state.layers));
  result.add_value(state.time);
  return result.hex();
}

}  // namespace scarp

#include "apps/run_record.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/csv_table.h"
#include "apps/section.h"
#include "core/error.h"
#include "core/read_file.h"
#include "levelset/extract_surface.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

std::optional<RunCost> read_cost(const fs::path& metrics) {
  if (!fs::exists(metrics)) return std::nullopt;
  const CsvTable table(metrics);
  if (table.row_count() == 0) return std::nullopt;
  RunCost cost{.time_steps = static_cast<double>(table.row_count())};
  for (std::size_t n = 0; n < table.row_count(); ++n) {
    const auto number = [&](const std::string& name) { return table.number(n, name).value_or(0); };
    cost.facets += number("facets") / cost.time_steps;
    cost.facets_full += number("facets_full") / cost.time_steps;
    cost.rays += number("rays");
    cost.segments += number("segments");
    for (const char* stage : {"surface", "simplify", "flux", "map", "advect"})
      cost.stages.add(stage, number(fmt::format("t_{}_s", stage)));
  }
  return cost;
}

/// By the number of the output; nothing of a run that is not complete.
std::vector<double> output_times(const fs::path& folder) {
  const fs::path summary = folder / "summary.json";
  if (!fs::exists(summary)) return {};
  const auto json = nlohmann::json::parse(read_kept_file(summary), nullptr, false);
  try {
    return json.is_object() ? json.value("output_times_s", std::vector<double>{})
                            : std::vector<double>{};
  } catch (const nlohmann::json::exception&) {
    throw InputError(
        fmt::format("{}: is damaged: output_times_s is no list of numbers; remove it, "
                    "and scarp run --resume writes it anew",
                    summary.string()));
  }
}

RunOutput output_of(const fs::path& state, std::span<const double> times) {
  const std::string digits = state.stem().string().substr(std::string("state_").size());
  const bool is_numbered = digits.find_first_not_of("0123456789") == std::string::npos;
  const fs::path surface = state.parent_path() / ("surface_" + digits + ".vtp");
  const auto number = is_numbered ? std::stoul(digits) : times.size();
  return {.time = number < times.size() ? times[number] : read_wafer(state).time,
          .state = state,
          .surface = fs::exists(surface) ? surface : fs::path()};
}

}  // namespace

double RunCost::seconds() const {
  double sum = 0;
  for (const auto& [stage, seconds] : stages.stages()) sum += seconds;
  return sum;
}

RunRecord read_run(const fs::path& where) {
  RunRecord run{.where = where, .outputs = {}};
  if (!fs::is_directory(where)) {
    run.outputs.push_back({.time = read_wafer(where).time, .state = where, .surface = {}});
    return run;
  }
  const std::vector<double> times = output_times(where);
  for (const fs::path& state : states_of(where)) run.outputs.push_back(output_of(state, times));
  if (run.outputs.empty()) newest_state(where);  // says what is missing
  run.cost = read_cost(where / "metrics.csv");
  return run;
}

Snapshot SnapshotReader::read(std::size_t output, Materials& materials) {
  const fs::path& file = run_.outputs[output].state;
  SavedWafer wafer = read_wafer(file, materials);
  materials = wafer.materials;
  if (!start_) {
    const fs::path& first = run_.outputs.front().state;
    start_ = measure(read_wafer(first, materials).layers, wafer.metrology);
  }
  const MetrologyNames names{.materials = wafer.materials, .options = wafer.metrology};
  const SectionLine middle = parse_section("y = 0 nm", wafer.layers.frame);
  return {.frame = wafer.layers.frame,
          .values = metrology_values(measure(wafer.layers, wafer.metrology, &*start_), names),
          .surface = extract_surface(wafer.layers),
          .profile = exposed_lines(cut(wafer.layers, layer_surfaces(wafer.layers), middle))};
}

}  // namespace scarp

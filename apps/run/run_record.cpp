#include "apps/run/run_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/simulator/section.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/csv_table.h"
#include "core/system/hash.h"
#include "core/system/read_file.h"
#include "levelset/surface/extract_surface.h"

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

/// Those that are measured; what is left around pillars lies everywhere.
std::vector<OpeningPlace> places_of(const Metrology& metrology) {
  std::vector<OpeningPlace> places;
  std::set<int> numbers;
  for (const OpeningMetrology& each : metrology.openings) {
    places.push_back(place_of(each));
    numbers.insert(each.opening);
  }
  const auto all = std::ranges::count_if(metrology.names.known(), &NamedOpening::is_there);
  constexpr double everywhere = 1e300;
  if (static_cast<std::size_t>(all) > numbers.size())
    places.push_back({.number = -1, .width = {everywhere, everywhere}});
  return places;
}

bool has_condition(const nlohmann::ordered_json& summary) {
  const auto any = [&](const char* list, const auto& is_met) {
    const nlohmann::ordered_json entries = summary.value(list, nlohmann::ordered_json::array());
    return std::ranges::any_of(entries, is_met);
  };
  return any("steps",
             [](const auto& step) {
               return step.value("reached_s", nlohmann::ordered_json()).is_number();
             }) ||
         any("repeats",
             [](const auto& repeat) { return repeat.value("ended_by", "repeat") != "repeat"; });
}

RunOutput output_of(const fs::path& state, std::span<const double> times) {
  const auto number = output_number(state.filename().string(), "state", ".vdb");
  const fs::path surface =
      number ? state.parent_path() / numbered("surface", *number, ".vtp") : fs::path();
  const auto n = static_cast<std::size_t>(number.value_or(-1));
  return {.time = n < times.size() ? times[n] : read_wafer(state).time,
          .state = state,
          .surface = fs::exists(surface) ? surface : fs::path()};
}

}  // namespace

double RunCost::seconds() const {
  double sum = 0;
  for (const auto& [stage, seconds] : stages.stages()) sum += seconds;
  return sum;
}

std::string incomplete_warning(const RunRecord& run) {
  if (run.is_complete) return "";
  return fmt::format("{}: is not complete; scarp run --resume continues it", shown(run.where));
}

void refuse_summary(const fs::path& file) {
  throw InputError(
      fmt::format("{}: is damaged: an entry is not of the kind that scarp run writes; remove it, "
                  "and scarp run --resume writes it again",
                  shown(file)));
}

nlohmann::ordered_json read_summary(const fs::path& folder) {
  const fs::path file = folder / "summary.json";
  const auto none = nlohmann::ordered_json::object();
  if (!fs::exists(file)) return none;
  const auto json =
      nlohmann::ordered_json::parse(read_file(file), nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) return none;
  // One that was copied here from another run tells nothing of this one.
  const fs::path recipe = folder / "recipe.toml";
  const bool is_of_run =
      !fs::exists(recipe) || json.value("recipe_hash", none) == hash_of(read_file(recipe));
  return is_of_run ? json : none;
}

RunRecord read_run(const fs::path& where) {
  RunRecord run{.where = where, .outputs = {}};
  if (!fs::is_directory(where)) {
    run.is_state = true;
    run.outputs.push_back({.time = read_wafer(where).time, .state = where, .surface = {}});
    return run;
  }
  const nlohmann::ordered_json summary = read_summary(where);
  std::vector<double> times;  // by the number of the output
  try {
    times = summary.value("output_times_s", times);
    run.is_complete = summary.value("complete", false);
    run.has_condition = has_condition(summary);
  } catch (const nlohmann::ordered_json::exception&) {
    refuse_summary(where / "summary.json");
  }
  for (const fs::path& state : states_of(where)) run.outputs.push_back(output_of(state, times));
  if (run.outputs.empty()) newest_state(where);  // says what is missing
  run.cost = read_cost(where / "metrics.csv");
  return run;
}

Metrology SnapshotReader::measured(const SavedWafer& wafer, Materials& materials) {
  if (!start_) {
    const SavedWafer first = read_wafer(run_.outputs.front().state, materials);
    materials = first.materials;
    start_ = measure(first.layers, wafer.metrology, nullptr, first.openings);
    for (const MaterialVolume& each : start_->volumes) seen_.insert(each.material);
  }
  Metrology now = measure(wafer.layers, wafer.metrology, &*start_, wafer.openings);
  for (const MaterialVolume& each : now.volumes) seen_.insert(each.material);
  for (const MaterialId material : seen_)
    if (std::ranges::find(now.volumes, material, &MaterialVolume::material) == now.volumes.end())
      now.volumes.push_back({.material = material});
  if (common_ != nullptr) common_->rename(now.openings, numbers_, wafer.layers.frame);
  return now;
}

Snapshot SnapshotReader::read(std::size_t output, Materials& materials) {
  const SavedWafer wafer = read_wafer(run_.outputs[output].state, materials);
  materials = wafer.materials;
  const Metrology now = measured(wafer, materials);
  const MetrologyNames names{.materials = materials, .options = wafer.metrology};
  const SectionLine middle = parse_section("y = 0 nm", wafer.layers.frame);
  return {.frame = wafer.layers.frame,
          .values = metrology_values(now, names),
          .openings = places_of(now),
          .surface = extract_surface(wafer.layers),
          .profile = exposed_lines(cut(wafer.layers, layer_surfaces(wafer.layers), middle))};
}

}  // namespace scarp

#include "apps/run/metrology_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/recipe/csv.h"
#include "core/recipe/quantity.h"

namespace scarp {

namespace {

using Value = std::optional<double>;
using nlohmann::ordered_json;

constexpr double degrees = 180 / std::numbers::pi;

/// A quantity of an opening; the name ends with the unit.
struct OpeningQuantity {
  const char* name;
  Value OpeningMetrology::*member;
  double scale = 1;
  ValueKind kind = ValueKind::other;
  Value OpeningMetrology::*grid_error = nullptr;
};

constexpr ValueKind length = ValueKind::width_or_depth;

constexpr std::array opening_quantities{
    OpeningQuantity{"depth_nm", &OpeningMetrology::depth, 1, length,
                    &OpeningMetrology::depth_error},
    OpeningQuantity{"depth_error_nm", &OpeningMetrology::depth_error},
    OpeningQuantity{"aspect_ratio", &OpeningMetrology::aspect_ratio},
    OpeningQuantity{"top_cd_nm", &OpeningMetrology::top_cd, 1, length},
    OpeningQuantity{"middle_cd_nm", &OpeningMetrology::middle_cd, 1, length},
    OpeningQuantity{"bottom_cd_nm", &OpeningMetrology::bottom_cd, 1, length},
    OpeningQuantity{"neck_cd_nm", &OpeningMetrology::neck_cd, 1, length},
    OpeningQuantity{"neck_depth_nm", &OpeningMetrology::neck_depth},
    OpeningQuantity{"bow_nm", &OpeningMetrology::bow, 1, length},
    OpeningQuantity{"bow_depth_nm", &OpeningMetrology::bow_depth},
    OpeningQuantity{"sidewall_angle_deg", &OpeningMetrology::sidewall_angle, degrees},
    OpeningQuantity{"left_angle_deg", &OpeningMetrology::left_angle, degrees},
    OpeningQuantity{"right_angle_deg", &OpeningMetrology::right_angle, degrees},
    OpeningQuantity{"micro_trenching_nm", &OpeningMetrology::micro_trenching},
    OpeningQuantity{"micro_trenching_error_nm", &OpeningMetrology::micro_trenching_error},
    OpeningQuantity{"facet_width_nm", &OpeningMetrology::facet_width},
    OpeningQuantity{"scallop_pitch_nm", &OpeningMetrology::scallop_pitch},
    OpeningQuantity{"scallop_amplitude_nm", &OpeningMetrology::scallop_amplitude},
    OpeningQuantity{"wall_roughness_nm", &OpeningMetrology::wall_roughness},
    OpeningQuantity{"line_width_roughness_nm", &OpeningMetrology::line_width_roughness},
    OpeningQuantity{"undercut_nm", &OpeningMetrology::undercut, 1, length},
    OpeningQuantity{"mask_thickness_nm", &OpeningMetrology::mask_thickness, 1, ValueKind::film},
    OpeningQuantity{"etched_depth_nm", &OpeningMetrology::etched_depth, 1, length,
                    &OpeningMetrology::depth_error},
    OpeningQuantity{"mask_loss_nm", &OpeningMetrology::mask_loss},
    OpeningQuantity{"selectivity", &OpeningMetrology::selectivity},
    OpeningQuantity{"arde_lag", &OpeningMetrology::arde_lag}};

struct FilmQuantity {
  const char* name;
  Value FilmMetrology::*member;
  ValueKind kind;
};

constexpr std::array film_quantities{
    FilmQuantity{"top_nm", &FilmMetrology::top, ValueKind::film},
    FilmQuantity{"wall_nm", &FilmMetrology::wall, ValueKind::film},
    FilmQuantity{"bottom_nm", &FilmMetrology::bottom, ValueKind::film},
    FilmQuantity{"step_coverage", &FilmMetrology::step_coverage, ValueKind::coverage},
    FilmQuantity{"wall_coverage", &FilmMetrology::wall_coverage, ValueKind::coverage},
    FilmQuantity{"conformality", &FilmMetrology::conformality, ValueKind::other}};

Value value_of(const OpeningMetrology& opening, const OpeningQuantity& quantity) {
  const Value value = opening.*(quantity.member);
  return value ? Value(*value * quantity.scale) : std::nullopt;
}

std::string kind_of(const OpeningMetrology& opening) {
  return opening.is_trench ? "trench" : "hole";
}

/// The plane of the sections; those of a trench lie anywhere along it.
std::string plane_of(const OpeningMetrology& opening) {
  const char* const axis = opening.axis == 0 ? "x" : "y";
  return opening.is_trench ? fmt::format("across {}", axis)
                           : fmt::format("{} = {:.6g} nm", axis, opening.centre[opening.axis]);
}

ordered_json json_of(Value value) { return value ? ordered_json(*value) : ordered_json(); }

constexpr std::array<const char*, 2> wall_sides{"left", "right"};

Value in_degrees(Value angle) { return angle ? Value(*angle * degrees) : std::nullopt; }

std::string angle_name(std::size_t side, double height) {
  return fmt::format("{}_angle_at_{}_deg", wall_sides[side], format_number(height));
}

ordered_json film_json(const FilmMetrology& film, const Materials& materials) {
  ordered_json json{{"material", materials[film.material].name}};
  for (const FilmQuantity& each : film_quantities) json[each.name] = json_of(film.*(each.member));
  return json;
}

ordered_json opening_json(const OpeningMetrology& opening, const MetrologyNames& names) {
  ordered_json json{{"opening", opening.opening + 1},
                    {"kind", kind_of(opening)},
                    {"place",
                     {{"x_nm", opening.centre[0]},
                      {"y_nm", opening.centre[1]},
                      {"plane", plane_of(opening)},
                      {"sections", opening.section_count}}}};
  for (const OpeningQuantity& each : opening_quantities)
    json[each.name] = json_of(value_of(opening, each));
  json["cd_at"] = ordered_json::array();
  for (std::size_t n = 0; n < opening.cd_at.size(); ++n) {
    json["cd_at"].push_back(
        {{"height_nm", names.options.cd_heights[n]}, {"cd_nm", json_of(opening.cd_at[n])}});
  }
  json["angle_at"] = ordered_json::array();
  for (std::size_t n = 0; n < opening.angle_at.size(); ++n) {
    json["angle_at"].push_back({{"height_nm", names.options.angle_heights[n]},
                                {"left_angle_deg", json_of(in_degrees(opening.angle_at[n][0]))},
                                {"right_angle_deg", json_of(in_degrees(opening.angle_at[n][1]))}});
  }
  json["films"] = ordered_json::array();
  for (const FilmMetrology& film : opening.films)
    json["films"].push_back(film_json(film, names.materials));
  return json;
}

ordered_json void_json(const VoidMetrology& closed) {
  return {{"x_nm", closed.centre.x},    {"y_nm", closed.centre.y},      {"lowest_nm", closed.lower},
          {"highest_nm", closed.upper}, {"height_nm", closed.height()}, {"area_nm2", closed.area},
          {"volume_nm3", closed.volume}};
}

double void_volume(const Metrology& metrology) {
  double sum = 0;
  for (const VoidMetrology& each : metrology.voids) sum += each.volume;
  return sum;
}

/// A row of the table with a cell for each opening.
std::string table_row(const std::string& name, std::span<const std::string> cells) {
  std::string row = fmt::format("{:26}", name);
  for (const std::string& cell : cells) row += fmt::format(" {:>14}", cell);
  return row + '\n';
}

class TableWriter {
 public:
  TableWriter(const Metrology& metrology, const MetrologyNames& names)
      : openings_(metrology.openings), names_(names) {}

  std::string run() {
    texts("opening",
          [](const auto& each) { return fmt::format("{} {}", kind_of(each), each.opening + 1); });
    texts("plane", plane_of);
    for (const OpeningQuantity& quantity : opening_quantities)
      values(quantity.name, [&](const auto& each) { return value_of(each, quantity); });
    for (std::size_t n = 0; n < names_.options.cd_heights.size(); ++n) {
      values(fmt::format("cd_at_{:g}_nm", names_.options.cd_heights[n]),
             [&](const auto& each) { return each.cd_at[n]; });
    }
    for (std::size_t n = 0; n < names_.options.angle_heights.size(); ++n)
      for (std::size_t side = 0; side < 2; ++side)
        values(angle_name(side, names_.options.angle_heights[n]),
               [&](const auto& each) { return in_degrees(each.angle_at[n][side]); });
    for (const FilmMetrology& film : openings_.front().films) {
      for (const FilmQuantity& quantity : film_quantities) {
        values(names_.materials[film.material].name + '_' + quantity.name, [&](const auto& each) {
          const auto same = std::ranges::find(each.films, film.material, &FilmMetrology::material);
          return same == each.films.end() ? Value() : (*same).*(quantity.member);
        });
      }
    }
    return text_;
  }

 private:
  template <class Text>
  void texts(const std::string& name, const Text& text) {
    std::vector<std::string> cells;
    for (const OpeningMetrology& each : openings_) cells.push_back(text(each));
    text_ += table_row(name, cells);
  }

  template <class Get>
  void values(const std::string& name, const Get& value) {
    const auto is_there = [&](const auto& each) { return value(each).has_value(); };
    if (!std::ranges::any_of(openings_, is_there)) return;
    texts(name, [&](const auto& each) {
      const Value found = value(each);
      return found ? fmt::format("{:.6g}", *found) : std::string("-");
    });
  }

  std::span<const OpeningMetrology> openings_;
  const MetrologyNames& names_;
  std::string text_;
};

std::string csv_cell(Value value) { return value ? fmt::format("{:.7g}", *value) : ""; }

/// The columns of an opening, or as many empty ones.
std::string opening_cells(const OpeningMetrology* opening, const MetrologyColumns& columns) {
  const std::size_t heights = columns.cd_heights.size() + 2 * columns.angle_heights.size();
  const std::vector<MaterialId>& films = columns.films;
  if (opening == nullptr) {
    return std::string(
        6 + opening_quantities.size() + heights + films.size() * film_quantities.size(), ',');
  }
  std::string cells = fmt::format(",{},{},{:.7g},{:.7g},{},{}", opening->opening + 1,
                                  kind_of(*opening), opening->centre[0], opening->centre[1],
                                  plane_of(*opening), opening->section_count);
  for (const OpeningQuantity& each : opening_quantities)
    cells += ',' + csv_cell(value_of(*opening, each));
  for (const Value& cd : opening->cd_at) cells += ',' + csv_cell(cd);
  for (const auto& sides : opening->angle_at)
    for (const Value& angle : sides) cells += ',' + csv_cell(in_degrees(angle));
  for (const MaterialId material : films) {
    const auto film = std::ranges::find(opening->films, material, &FilmMetrology::material);
    for (const FilmQuantity& each : film_quantities)
      cells += ',' + (film == opening->films.end() ? "" : csv_cell((*film).*(each.member)));
  }
  return cells;
}

/// The columns of the whole wafer.
std::string wafer_cells(const Metrology& metrology, std::span<const MaterialId> materials) {
  std::string cells =
      fmt::format(",{:.7g},{:.7g},{},{},{},{:.7g}", metrology.highest, metrology.lowest,
                  csv_cell(metrology.lowest_error), csv_cell(metrology.surface_roughness),
                  metrology.voids.size(), void_volume(metrology));
  for (const MaterialId material : materials) {
    const auto found = std::ranges::find(metrology.volumes, material, &MaterialVolume::material);
    cells += fmt::format(",{:.7g}", found == metrology.volumes.end() ? 0 : found->volume);
  }
  return cells;
}

/// Gathers values under the name of what they belong to.
class ValueList {
 public:
  void add(const std::string& name, Value value, ValueKind kind = ValueKind::other,
           double per_nm = 1, Value grid_error = {}) {
    if (value)
      values_.push_back({owner_ + name, kind, *value, per_nm, grid_error.value_or(0), opening_});
  }

  void add(const OpeningMetrology& opening, const MetrologyNames& names) {
    // Their places differ from run to run.
    owner_ = fmt::format("{} {}{} ", kind_of(opening), opening.opening + 1,
                         opening.is_trench   ? ""
                         : opening.axis == 0 ? " across x"
                                             : " across y");
    opening_ = opening.opening;
    for (const OpeningQuantity& each : opening_quantities)
      add(each.name, value_of(opening, each), each.kind, 1,
          each.grid_error == nullptr ? Value() : opening.*(each.grid_error));
    for (std::size_t n = 0; n < opening.cd_at.size(); ++n)
      add(fmt::format("cd_at_{}_nm", format_number(names.options.cd_heights[n])), opening.cd_at[n],
          length);
    for (std::size_t n = 0; n < opening.angle_at.size(); ++n)
      for (std::size_t side = 0; side < 2; ++side)
        add(angle_name(side, names.options.angle_heights[n]), in_degrees(opening.angle_at[n][side]),
            ValueKind::other);
    for (const FilmMetrology& film : opening.films) {
      for (const FilmQuantity& each : film_quantities)
        add(names.materials[film.material].name + '_' + each.name, film.*(each.member), each.kind,
            each.kind == ValueKind::coverage && film.top ? 1 / *film.top : 1);
    }
    owner_.clear();
    opening_.reset();
  }

  std::vector<MetrologyValue> take() { return std::move(values_); }

 private:
  std::string owner_;
  std::optional<int> opening_;
  std::vector<MetrologyValue> values_;
};

}  // namespace

std::vector<MetrologyValue> metrology_values(const Metrology& metrology,
                                             const MetrologyNames& names) {
  ValueList list;
  for (const OpeningMetrology& each : metrology.openings) list.add(each, names);
  list.add("highest_nm", metrology.highest, ValueKind::height);
  list.add("lowest_nm", metrology.lowest, ValueKind::height, 1, metrology.lowest_error);
  list.add("lowest_error_nm", metrology.lowest_error);
  list.add("surface_roughness_nm", metrology.surface_roughness);
  list.add("voids", static_cast<double>(metrology.voids.size()));
  list.add("void_volume_nm3", void_volume(metrology));
  for (const MaterialVolume& each : metrology.volumes)
    list.add(names.materials[each.material].name + "_volume_nm3", each.volume, ValueKind::volume,
             each.area);
  return list.take();
}

ordered_json metrology_json(const Metrology& metrology, const MetrologyNames& names) {
  ordered_json json{{"highest_nm", metrology.highest},
                    {"lowest_nm", metrology.lowest},
                    {"lowest_error_nm", json_of(metrology.lowest_error)},
                    {"surface_roughness_nm", json_of(metrology.surface_roughness)}};
  json["openings"] = ordered_json::array();
  for (const OpeningMetrology& each : metrology.openings)
    json["openings"].push_back(opening_json(each, names));
  json["voids"] = ordered_json::array();
  for (const VoidMetrology& each : metrology.voids) json["voids"].push_back(void_json(each));
  for (const MaterialVolume& each : metrology.volumes)
    json["volumes_nm3"][names.materials[each.material].name] = each.volume;
  return json;
}

std::string metrology_table(const Metrology& metrology, const MetrologyNames& names) {
  std::string text;
  if (!metrology.openings.empty()) text = TableWriter(metrology, names).run() + '\n';
  const auto line = [&](const std::string& name, double value) {
    text += table_row(name, std::vector{fmt::format("{:.6g}", value)});
  };
  line("highest_nm", metrology.highest);
  line("lowest_nm", metrology.lowest);
  if (metrology.lowest_error) line("lowest_error_nm", *metrology.lowest_error);
  if (metrology.surface_roughness) line("surface_roughness_nm", *metrology.surface_roughness);
  for (const MaterialVolume& each : metrology.volumes)
    line(names.materials[each.material].name + "_volume_nm3", each.volume);
  for (const VoidMetrology& each : metrology.voids) {
    text += fmt::format(
        "void at x = {:.5g} nm, y = {:.5g} nm: from {:.5g} to {:.5g} nm, area {:.5g} nm^2, volume "
        "{:.5g} nm^3\n",
        each.centre.x, each.centre.y, each.lower, each.upper, each.area, each.volume);
  }
  return text;
}

std::vector<MaterialId> film_materials(std::span<const ProcessStep> steps,
                                       std::span<const MaterialId> occurring) {
  std::vector<MaterialId> films;
  for (const MaterialId material : occurring) {
    const auto deposits = [&](const ProcessStep& step) { return step.deposits == material; };
    if (material != occurring.front() || std::ranges::any_of(steps, deposits))
      films.push_back(material);
  }
  return films;
}

std::string metrology_head(const MetrologyColumns& columns) {
  std::string head = "output,time_s,opening,kind,x_nm,y_nm,plane,sections";
  for (const OpeningQuantity& each : opening_quantities) head += fmt::format(",{}", each.name);
  for (const double height : columns.cd_heights)
    head += fmt::format(",cd_at_{}_nm", format_number(height));
  for (const double height : columns.angle_heights)
    for (std::size_t side = 0; side < 2; ++side) head += ',' + angle_name(side, height);
  for (const MaterialId material : columns.films) {
    for (const FilmQuantity& each : film_quantities)
      head += ',' + csv_field(fmt::format("{}_{}", columns.materials[material].name, each.name));
  }
  head += ",highest_nm,lowest_nm,lowest_error_nm,surface_roughness_nm,voids,void_volume_nm3";
  for (const MaterialId material : columns.occurring)
    head += ',' + csv_field(columns.materials[material].name + "_volume_nm3");
  return head + '\n';
}

std::string metrology_rows(std::size_t output, double time, const Metrology& metrology,
                           const MetrologyColumns& columns) {
  const auto row = [&](const OpeningMetrology* opening) {
    return fmt::format("{},{}{}{}\n", output, format_number(time), opening_cells(opening, columns),
                       wafer_cells(metrology, columns.occurring));
  };
  if (metrology.openings.empty()) return row(nullptr);
  std::string rows;
  for (const OpeningMetrology& opening : metrology.openings) rows += row(&opening);
  return rows;
}

}  // namespace scarp

#include "apps/report/comparison_case.h"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>

#include "apps/report/comparison_files.h"
#include "apps/report/measured_contour.h"
#include "apps/report/scene.h"
#include "core/system/read_file.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

RunGroup group_of(const std::string& name, const std::vector<fs::path>& runs) {
  RunGroup group{.name = name, .runs = {}};
  for (const fs::path& run : runs) group.runs.push_back(read_run(run));
  return group;
}

struct TolerancePlace {
  const char* name;
  double Tolerances::*member;
};

constexpr std::array tolerance_places{TolerancePlace{"length_cells", &Tolerances::length_cells},
                                      TolerancePlace{"length_part", &Tolerances::length_part},
                                      TolerancePlace{"film_cells", &Tolerances::film_cells},
                                      TolerancePlace{"film_part", &Tolerances::film_part},
                                      TolerancePlace{"volume_cells", &Tolerances::volume_cells},
                                      TolerancePlace{"volume_part", &Tolerances::volume_part},
                                      TolerancePlace{"mean_distance", &Tolerances::mean_distance},
                                      TolerancePlace{"p99_distance", &Tolerances::p99_distance}};

ordered_json paths_json(const std::vector<fs::path>& paths, const fs::path& folder) {
  ordered_json list = ordered_json::array();
  for (const fs::path& path : paths) list.push_back(fs::proximate(path, folder).string());
  return list;
}

std::vector<fs::path> paths_of(const ordered_json& list, const fs::path& folder) {
  std::vector<fs::path> paths;
  for (const auto& path : list) paths.push_back(folder / path.get<std::string>());
  return paths;
}

std::vector<Vec3d> middles_of(const TriMesh& mesh) {
  std::vector<Vec3d> middles;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto [a, b, c] = corners(mesh, f);
    middles.push_back((a + b + c) / 3.0);
  }
  return middles;
}

FacetArray distance_array(const TriMesh& from, const TriMesh& to, double spacing) {
  FacetArray array{.name = "distance_spacings", .values = {}};
  for (const double distance : distances(middles_of(from), TriangleTree(to)))
    array.values.push_back(static_cast<float>(distance / spacing));
  return array;
}

SceneOutput packed(double time, const FieldMesh& surface, const FieldMesh& other, double spacing) {
  std::vector<FacetArray> fields{distance_array(surface.mesh, other.mesh, spacing)};
  fields.insert(fields.end(), surface.fields.begin(), surface.fields.end());
  return {.time = time, .moment = "", .surface = pack(surface.mesh, fields)};
}

/// Both surfaces that are compared last, as pictures.
std::string pictures_of(const std::array<RunRecord, 2>& runs,
                        const std::array<std::vector<std::size_t>, 2>& outputs) {
  std::string html = "<div class=\"plots\">\n";
  for (std::size_t n = 0; n < 2; ++n)
    html += wafer_picture(read_wafer(runs[n].outputs[outputs[n].back()].state));
  return html + "</div>\n";
}

/// The surfaces of the first runs side by side at the outputs that are compared; empty where one
/// has no depth or there is no second surface.
std::string scene_of(const ComparisonCase& wanted, const std::string& id, std::size_t most_bytes) {
  if (!wanted.contour.empty()) return "";
  const std::array runs{read_run(wanted.first_runs.front()), read_run(wanted.second_runs.front())};
  Frame frame;
  std::array<std::vector<std::string>, 2> names;
  for (const std::size_t n : {1, 0}) {
    const SavedWafer wafer = read_wafer(runs[n].outputs.back().state);
    frame = wafer.layers.frame;
    if (frame.is_section()) return "";
    names[n] = material_names_of(runs[n], wafer);
  }
  Scene scene{.material_names = names[0],
              .panes = {{.name = wanted.first}, {.name = wanted.second}}};
  const std::array records{&runs[0], &runs[1]};
  std::array<std::vector<std::size_t>, 2> outputs;
  for (const std::vector<std::size_t>& places : common_outputs(records)) {
    std::array<FieldMesh, 2> surfaces;
    for (std::size_t n = 0; n < 2; ++n) {
      surfaces[n] = read_field_mesh(runs[n].outputs[places[n]], frame.sides());
      renumber_materials(surfaces[n], names[n], scene);
    }
    for (std::size_t n = 0; n < 2; ++n) {
      const double time = runs[n].outputs[places[n]].time;
      outputs[n].push_back(places[n]);
      scene.panes[n].outputs.push_back(packed(time, surfaces[n], surfaces[1 - n], frame.spacing));
    }
  }
  for (ScenePane& pane : scene.panes) pane.output_count = pane.outputs.size();
  add_volumes(scene, records, outputs);
  thin_out(scene, most_bytes);
  return scene_html(scene, id, pictures_of(runs, outputs));
}

/// That of a run; empty of a state.
std::string recipe_of(const fs::path& run) {
  const fs::path file = run / "recipe.toml";
  return fs::is_directory(run) && fs::exists(file) ? read_file(file) : "";
}

}  // namespace

Comparison compare(const ComparisonCase& wanted) {
  const fs::path& run = wanted.first_runs.front();
  if (!wanted.contour.empty())
    return compare_with_contour(run, wanted.contour, wanted.line, wanted.tolerances);
  return compare(group_of(wanted.first, wanted.first_runs),
                 group_of(wanted.second, wanted.second_runs), wanted.tolerances);
}

ordered_json case_json(const ComparisonCase& wanted, const fs::path& folder) {
  ordered_json json{{"first", wanted.first},
                    {"second", wanted.second},
                    {"first_runs", paths_json(wanted.first_runs, folder)},
                    {"second_runs", paths_json(wanted.second_runs, folder)}};
  if (!wanted.contour.empty()) {
    json["contour"] = fs::proximate(wanted.contour, folder).string();
    json["line"] = wanted.line;
  }
  for (const auto& [name, member] : tolerance_places)
    json["tolerances"][name] = wanted.tolerances.*member;
  return json;
}

ComparisonCase read_case(const ordered_json& json, const fs::path& folder) {
  ComparisonCase found{.first = json.at("first"),
                       .second = json.at("second"),
                       .first_runs = paths_of(json.at("first_runs"), folder),
                       .second_runs = paths_of(json.at("second_runs"), folder)};
  if (json.contains("contour")) {
    found.contour = folder / json.at("contour").get<std::string>();
    found.line = json.at("line");
  }
  for (const auto& [name, member] : tolerance_places)
    found.tolerances.*member = json.at("tolerances").value(name, found.tolerances.*member);
  return found;
}

std::string comparison_page(std::span<const ComparisonCase> cases,
                            std::span<const Comparison> comparisons, const std::string& title) {
  std::vector<PageEntry> entries;
  for (std::size_t n = 0; n < cases.size(); ++n)
    entries.push_back({.comparison = comparisons[n],
                       .scene = scene_of(cases[n], fmt::format("comparison-{}", n + 1),
                                         most_scene_bytes / cases.size())});
  return comparison_page(entries,
                         {.title = title, .recipe = recipe_of(cases.front().first_runs.front())});
}

}  // namespace scarp

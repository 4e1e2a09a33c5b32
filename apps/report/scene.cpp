#include "apps/report/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/report/render.h"
#include "apps/run/markup.h"
#include "apps/run/picture.h"
#include "apps/run/png_file.h"
#include "core/plain_number.h"
#include "core/system/base64.h"
#include "levelset/surface/extract_surface.h"
#include "mesh/simplify/curvature.h"

namespace scarp {

namespace {

using nlohmann::ordered_json;

constexpr const char* curvature_field =
    "curvature_per_um";  // edges have a hundred times that of walls

FacetArray material_array(const TriMesh& mesh) {
  FacetArray array{.name = material_field, .values = {}};
  for (const MaterialId id : mesh.materials) array.values.push_back(static_cast<float>(id));
  return array;
}

FacetArray curvature_array(const TriMesh& mesh, const Sides& sides) {
  constexpr double per_um = 1000;
  const std::vector<double> at_vertices = mean_curvature(CollapseMesh(mesh, sides));
  FacetArray array{.name = curvature_field, .values = {}};
  for (const auto& [a, b, c] : mesh.triangles)
    array.values.push_back(
        static_cast<float>(per_um * (at_vertices[a] + at_vertices[b] + at_vertices[c]) / 3));
  return array;
}

FacetArray size_array(const TriMesh& mesh) {
  FacetArray array{.name = "facet_size_nm", .values = {}};
  for (const double area : facet_areas(mesh))
    array.values.push_back(static_cast<float>(std::sqrt(area)));
  return array;
}

// --- what lies within ---------------------------------------------------------------------------

/// The block that is shown: all surfaces, and some of the solid below.
Box block_of(const Scene& scene) {
  constexpr double depth_below = 0.08;  // of its width; apps/viewer/src/view.js has the same
  Box block;
  for (const ScenePane& pane : scene.panes) {
    for (const SceneOutput& output : pane.outputs) {
      const auto corner = [](const std::array<float, 3>& r) {
        return Vec3d(Vec3f{r[0], r[1], r[2]});
      };
      block.add(corner(output.surface.lower));
      block.add(corner(output.surface.upper));
    }
  }
  const Vec3d size = block.upper - block.lower;
  block.lower.z -= depth_below * std::max(size.x, size.y);
  return block;
}

/// The number of a material in a scene, which knows it from then on: recipes number those of their
/// own each in its way.
MaterialId number_in(Scene& scene, const std::string& name) {
  std::vector<std::string>& names = scene.material_names;
  const auto place = std::ranges::find(names, name);
  const auto number = static_cast<MaterialId>(place - names.begin());
  if (place == names.end()) names.push_back(name);
  return number;
}

// --- what is left out ----------------------------------------------------------------------------

/// Of base64, with the element around it.
std::size_t page_bytes(const SceneOutput& output) {
  return (output.surface.bytes.size() + output.volume.bytes.size()) * 4 / 3 + 400;
}

/// The places of `count` of a series, evenly spread from its first to its last.
std::vector<std::size_t> evenly(std::size_t size, std::size_t count) {
  if (count < 2) return {size - 1};
  std::vector<std::size_t> places;
  for (std::size_t n = 0; n < count; ++n)
    places.push_back((n * (size - 1) + (count - 1) / 2) / (count - 1));
  return places;
}

std::size_t most_outputs(const Scene& scene) {
  std::size_t most = 0;
  for (const ScenePane& pane : scene.panes) most = std::max(most, pane.outputs.size());
  return most;
}

std::size_t bytes_with(const Scene& scene, std::size_t count) {
  std::size_t sum = 0;
  for (const ScenePane& pane : scene.panes)
    for (const std::size_t n : evenly(pane.outputs.size(), std::min(count, pane.outputs.size())))
      sum += page_bytes(pane.outputs[n]);
  return sum;
}

// --- HTML ----------------------------------------------------------------------------------------

/// "speed_nm_s" is the speed in nm/s.
std::array<std::string, 2> label_and_unit(std::string name) {
  constexpr std::array<std::array<const char*, 2>, 4> units{
      {{"_nm_s", "nm/s"}, {"_per_um", "1/um"}, {"_nm", "nm"}, {"_spacings", "spacings"}}};
  std::string unit;
  for (const auto& [ending, meaning] : units) {
    if (!name.ends_with(ending)) continue;
    name.resize(name.size() - std::string_view(ending).size());
    unit = meaning;
    break;
  }
  std::ranges::replace(name, '_', ' ');
  return {name, unit};
}

/// The fields of all outputs, in the order in which they first occur, with what colours stand for.
ordered_json fields_json(const Scene& scene) {
  std::vector<PackedField> ranges;
  for (const ScenePane& pane : scene.panes) {
    for (const SceneOutput& output : pane.outputs) {
      for (const PackedField& field : output.surface.fields) {
        const auto known = std::ranges::find(ranges, field.name, &PackedField::name);
        if (known == ranges.end()) {
          ranges.push_back(field);
          continue;
        }
        known->low = std::min(known->low, field.low);
        known->high = std::max(known->high, field.high);
      }
    }
  }
  ordered_json fields = ordered_json::array();
  for (const PackedField& range : ranges) {
    const auto [label, unit] = label_and_unit(range.name);
    fields.push_back({{"name", range.name},
                      {"label", label},
                      {"unit", unit},
                      {"has_root_scale", range.name == curvature_field},
                      {"low", range.low},
                      {"high", range.high}});
  }
  return fields;
}

/// By their numbers, of those that some facet has.
ordered_json materials_json(const Scene& scene) {
  ordered_json materials = ordered_json::object();
  for (std::size_t n = 0; n < scene.material_names.size(); ++n) {
    const auto [red, green, blue] = material_colour(static_cast<MaterialId>(n));
    materials[std::to_string(n)] = {{"name", scene.material_names[n]},
                                    {"colour", {red, green, blue}}};
  }
  return materials;
}

std::string data_id(const std::string& id, std::size_t pane, std::size_t output) {
  return fmt::format("{}-{}-{}", id, pane, output);
}

std::string volume_id(const std::string& surface_id) { return surface_id + "-volume"; }

ordered_json list_of(const Vec3d& r) { return {r.x, r.y, r.z}; }

ordered_json volume_json(const PackedVolume& volume, const std::string& id) {
  return {{"data", volume_id(id)},
          {"nodes", volume.nodes},
          {"lower", list_of(volume.box.lower)},
          {"upper", list_of(volume.box.upper)},
          {"materials", volume.materials}};
}

ordered_json output_json(const SceneOutput& output, const std::string& id) {
  const PackedSurface& surface = output.surface;
  ordered_json json{{"time_s", output.time},
                    {"moment", output.moment},
                    {"data", id},
                    {"lower", surface.lower},
                    {"upper", surface.upper},
                    {"vertices", surface.vertex_count},
                    {"facets", surface.facet_count},
                    {"fields", ordered_json::array()}};
  if (!output.volume.materials.empty()) json["volume"] = volume_json(output.volume, id);
  for (const PackedField& field : surface.fields)
    json["fields"].push_back({{"name", field.name}, {"low", field.low}, {"high", field.high}});
  return json;
}

/// Text that nothing in it can end early.
std::string script_json(const ordered_json& json) {
  std::string text;
  for (const char c : json.dump(-1, ' ', false, ordered_json::error_handler_t::replace)) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

std::string data_element(const std::string& id, const std::string& bytes) {
  return fmt::format("<script type=\"text/plain\" id=\"{}\">{}</script>\n", id, base64(bytes));
}

std::string data_elements(const Scene& scene, const std::string& id) {
  std::string html;
  for (std::size_t p = 0; p < scene.panes.size(); ++p) {
    for (std::size_t n = 0; n < scene.panes[p].outputs.size(); ++n) {
      const SceneOutput& output = scene.panes[p].outputs[n];
      html += data_element(data_id(id, p, n), output.surface.bytes);
      if (!output.volume.materials.empty())
        html += data_element(volume_id(data_id(id, p, n)), output.volume.bytes);
    }
  }
  return html;
}

/// What a reader has to know of the numbers.
std::string notes_of(const Scene& scene) {
  std::string notes = fmt::format(
      "Places are within {:.2g} nm of those in the files; colours span 99 % of the facets.",
      scene.place_error());
  for (const ScenePane& pane : scene.panes) {
    if (pane.outputs.size() == pane.output_count) continue;
    notes += fmt::format(" Of {} outputs {} are here, evenly chosen, to keep the page small.",
                         pane.output_count, pane.outputs.size());
    break;
  }
  return "<p class=\"note\">" + notes + "</p>\n";
}

}  // namespace

double Scene::place_error() const {
  double error = 0;
  for (const ScenePane& pane : panes)
    for (const SceneOutput& output : pane.outputs) error = std::max(error, output.surface.error());
  return error;
}

FieldMesh read_field_mesh(const RunOutput& output, const Sides& sides) {
  FieldMesh result;
  if (output.surface.empty()) {
    result.mesh = extract_surface(read_wafer(output.state).layers);
    result.fields.push_back(material_array(result.mesh));
  } else {
    result.mesh = read_mesh(output.surface);
    result.fields = read_facet_arrays(output.surface);
  }
  result.fields.push_back(curvature_array(result.mesh, sides));
  result.fields.push_back(size_array(result.mesh));
  return result;
}

std::vector<std::string> material_names_of(const RunRecord& run, const SavedWafer& wafer) {
  const std::filesystem::path& surface = run.outputs.back().surface;
  return surface.empty() ? wafer.materials.names() : read_material_names(surface);
}

void renumber_materials(FieldMesh& surface, std::span<const std::string> names, Scene& scene) {
  std::vector<float> numbers;
  for (const std::string& name : names)
    numbers.push_back(static_cast<float>(number_in(scene, name)));
  for (FacetArray& field : surface.fields) {
    if (field.name != material_field) continue;
    for (float& value : field.values)
      if (value >= 0 && value < static_cast<float>(numbers.size()))
        value = numbers[static_cast<std::size_t>(value)];
  }
}

void add_volumes(Scene& scene, std::span<const RunRecord* const> runs,
                 std::span<const std::vector<std::size_t>> outputs) {
  const Box block = block_of(scene);
  for (std::size_t p = 0; p < scene.panes.size(); ++p) {
    for (std::size_t n = 0; n < outputs[p].size(); ++n) {
      const SavedWafer wafer = read_wafer(runs[p]->outputs[outputs[p][n]].state);
      PackedVolume volume = pack_volume(wafer.layers, block);
      for (MaterialId& material : volume.materials)
        material = number_in(scene, wafer.materials[material].name);
      scene.panes[p].outputs[n].volume = std::move(volume);
    }
  }
}

void thin_out(Scene& scene, std::size_t most_bytes) {
  std::size_t count = most_outputs(scene);
  while (count > 1 && bytes_with(scene, count) > most_bytes) --count;
  for (ScenePane& pane : scene.panes) {
    std::vector<SceneOutput> kept;
    for (const std::size_t n : evenly(pane.outputs.size(), std::min(count, pane.outputs.size())))
      kept.push_back(std::move(pane.outputs[n]));
    pane.outputs = std::move(kept);
  }
}

std::string wafer_picture(const SavedWafer& wafer) {
  const Image image = render(
      wafer.layers, {.cut = RenderCut{.axis = 1, .position = 0}, .width = 400, .sky_rays = 1});
  return embedded_picture(
      "image/png", png_bytes(image),
      fmt::format("The wafer at t = {} s, cut open at y = 0", plain_number(wafer.time, 4)));
}

std::string scene_html(const Scene& scene, const std::string& id, const std::string& pictures) {
  const std::string still = "<div class=\"still\">\n" + pictures + "</div>\n";
  ordered_json json{{"place_error_nm", scene.place_error()},
                    {"materials", materials_json(scene)},
                    {"fields", fields_json(scene)},
                    {"panes", ordered_json::array()}};
  for (std::size_t p = 0; p < scene.panes.size(); ++p) {
    ordered_json pane{{"name", scene.panes[p].name}, {"outputs", ordered_json::array()}};
    for (std::size_t n = 0; n < scene.panes[p].outputs.size(); ++n)
      pane["outputs"].push_back(output_json(scene.panes[p].outputs[n], data_id(id, p, n)));
    json["panes"].push_back(std::move(pane));
  }
  return fmt::format(
      "<div class=\"scene\" id=\"{0}\">\n<script type=\"application/json\">{1}</script>\n"
      "{2}{3}</div>\n{4}",
      id, script_json(json), data_elements(scene, id), still, notes_of(scene));
}

}  // namespace scarp

#include "tests/bench/slope_walls.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "apps/simulator/recipe.h"
#include "core/system/temporary_folder.h"
#include "levelset/surface/extract_surface.h"
#include "tests/apps/final_state.h"

namespace scarp::bench {
namespace {

using Json = nlohmann::ordered_json;

constexpr double depth = 120;  // of the etch, nm
constexpr double cover = 60;   // least film above the wafer, nm
constexpr double reach = 160;  // of the domain to both sides of the edge, nm

/// How the film's top below a mask lies whose edge runs along y.
struct Kind {
  std::string name;
  double azimuth;  ///< of the way up the slope, to that away from the mask, degrees
  bool is_section;
};

const std::vector<Kind> kinds{
    {"along", 90, false}, {"aslant", 45, false}, {"up", 0, true}, {"down", 180, true}};

struct Case {
  const Kind& kind;
  double spacing;
  double place;
  double slope;
  double foot = 0;  ///< height of the mask's foot above nodes, in spacings

  Vec3d way() const {
    const double angle = kind.azimuth * std::numbers::pi / 180;
    return {std::cos(angle), std::sin(angle), 0};
  }
  double rise() const { return std::tan(slope * std::numbers::pi / 180); }
  double width() const { return kind.is_section ? 8 * spacing : 24 * spacing; }
  double edge() const { return place * spacing; }
  /// Of the film's top before the etch.
  double top(Vec3d r) const { return lowest() + rise() * dot(r, way()); }
  double lowest() const {
    return cover + depth + foot * spacing + rise() * (reach + 0.5 * width());
  }
};

void write_slope(const Case& of, const std::filesystem::path& file) {
  std::ofstream out(file);
  constexpr double far = 2000;
  for (const double x : {-far, far})
    for (const double y : {-far, far}) {
      out << fmt::format("v {} {} {}\n", x, y, of.top({x, y, 0}));
    }
  out << "f 1 3 4\nf 1 4 2\n";
}

/// The largest distance of the wall from the plane below the mask's edge.
Json wall_of(const Case& of) {
  const TemporaryFolder folder;
  write_slope(of, folder / "slope.obj");
  const std::string text =
      fmt::format(R"(
[domain]
spacing = "{0} nm"
extent = [{1}]
boundary = [{7}]
mode = "{2}"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mesh"
file = "slope.obj"
material = "SiO2"
{3}
[[geometry]]
shape = "mask"
material = "resist"
thickness = "50 nm"
opening = {{ shape = "trench", width = "{4} nm", center = "{5} nm" }}
[flux]
target_error = 0.01
[[step]]
model = "directional"
duration = "{6} s"
directional_etch_rate = {{ SiO2 = "1 nm/s", default = "0 nm/s" }}
)",
                  of.spacing,
                  of.kind.is_section ? fmt::format("\"{} nm\"", 2 * reach)
                                     : fmt::format("\"{} nm\", \"{} nm\"", 2 * reach, of.width()),
                  of.kind.is_section ? "2d" : "3d",
                  of.kind.is_section ? "section = \"y = 0 nm\"" : "", 2 * (150 - of.edge()), 150,
                  depth, of.kind.is_section ? "\"reflective\"" : "\"reflective\", \"reflective\"");
  std::ofstream(folder / "slope.toml") << text;
  const Recipe recipe = read_recipe(recipe_in(folder / "slope.toml"));
  const State state = final_state(recipe);
  double most = 0;
  double least = 0;
  for (const Vec3f& vertex : extract_surface(state.layers.top()).vertices) {
    const Vec3d r(vertex);
    const double away = (r.x - of.edge()) / of.spacing;
    // What lies within two spacings of the floor or of the sides does not count.
    const double above_floor = r.z - (of.top(r) - depth);
    if (r.z > of.top({of.edge(), r.y, 0}) + 0.01 * of.spacing || std::abs(away) > 3) continue;
    if (above_floor < 2.5 * of.spacing * (1 + of.rise())) continue;
    if (!of.kind.is_section && std::abs(r.y) > 0.5 * of.width() - 3 * of.spacing) continue;
    most = std::max(most, away);
    least = std::min(least, away);
  }
  return {{"out", most}, {"in", least}};
}

/// In sections that of the mask's foot at several heights between nodes.
Json roughest(const Kind& kind, double spacing, double place, double slope) {
  constexpr int heights = 8;
  Json all{{"in", 0.0}, {"out", 0.0}};
  for (int n = 0; n < (kind.is_section ? heights : 1); ++n) {
    const Json wall = wall_of({kind, spacing, place, slope, static_cast<double>(n) / heights});
    all["in"] = std::min(all["in"].get<double>(), wall["in"].get<double>());
    all["out"] = std::max(all["out"].get<double>(), wall["out"].get<double>());
  }
  return all;
}

}  // namespace

std::vector<std::string> slope_wall_kinds() {
  std::vector<std::string> names;
  names.reserve(kinds.size());
  for (const Kind& each : kinds) names.push_back(each.name);
  return names;
}

Json slope_walls(const SlopeWallSettings& settings) {
  Json rows = Json::array();
  for (const Kind& kind : kinds) {
    if (!settings.kinds.empty() &&
        std::ranges::find(settings.kinds, kind.name) == settings.kinds.end())
      continue;
    for (const double spacing : settings.spacings) {
      for (const double slope : settings.slopes) {
        Json row{{"kind", kind.name}, {"spacing", spacing}, {"slope", slope}};
        for (const double place : settings.places)
          row["walls"].push_back(roughest(kind, spacing, place, slope));
        rows.push_back(row);
      }
    }
  }
  return {{"places", settings.places}, {"rows", rows}};
}

void print_slope_walls(const Json& found) {
  std::string head = "| film's top | spacing | slope |";
  std::string rule = "| --- | --- | --- |";
  for (const Json& place : found["places"]) {
    head += fmt::format(" {:g} |", place.get<double>());
    rule += " --- |";
  }
  fmt::print("{}\n{}\n", head, rule);
  for (const Json& row : found["rows"]) {
    fmt::print("| {} | {:g} nm | {:g} deg |", row["kind"].get<std::string>(),
               row["spacing"].get<double>(), row["slope"].get<double>());
    for (const Json& wall : row["walls"])
      fmt::print(" {:+.2f} {:+.2f} |", wall["in"].get<double>(), wall["out"].get<double>());
    fmt::print("\n");
  }
  fmt::print("\n");
}

}  // namespace scarp::bench

// Whether stated errors of gathered fluxes are true: how far fluxes of other seeds are from their
// mean, in stated errors.
//
//   ./dev bench errors [CASE...] [--seeds 200] [--target 0.02] [--rays N] [--json]
//
// Of every place of a case (its floor, thirds of its walls, the top) the standard deviation of
// (value - mean) / stated error is taken over all facets, and all patches, and all seeds; of the
// balance of particles over all seeds. Right is 1. The error of a ratio is from how runs differ,
// since places of one run are off together.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/simulator/recipe.h"
#include "apps/simulator/simulator.h"
#include "apps/simulator/survey.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/running_statistics.h"
#include "flux/rays/patches.h"
#include "flux/revolution.h"
#include "flux/solve.h"
#include "mesh/files/mesh_file.h"
#include "tests/bench/bench_main.h"
#include "tests/flux/shapes.h"

namespace scarp::bench {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::ordered_json;

struct Settings {
  std::vector<std::string> cases{};
  std::uint64_t seeds = 200;
  double target = 0.02;
  std::uint64_t rays = 0;  ///< in place of the target, if > 0
  bool json = false;
};

/// What arrives on a surface with some seed.
struct Sample {
  TriMesh mesh;
  FluxOptions options;
  std::vector<std::string> names;  ///< of gathered species
  std::vector<FluxField> fields;
};

using Sampler = std::function<Sample(std::uint64_t seed)>;

struct Case {
  std::string name;
  std::function<Sampler(const Settings&)> begin;
};

FluxOptions options_of(const TriMesh& mesh) {
  const Box box = bounding_box(mesh);
  FluxOptions options{
      .engine = FluxOptions::Engine::gather,
      .sides = {.lower = {box.lower.x, box.lower.y}, .upper = {box.upper.x, box.upper.y}}};
  return options;
}

Sampler samples_of(const TriMesh& mesh, const FluxOptions& options, float sticking,
                   const Settings& settings) {
  return [=](std::uint64_t seed) {
    FluxOptions of_seed = options;
    of_seed.seed = seed;
    of_seed.target_error = settings.target;
    of_seed.rays = settings.rays;
    const Species gas{.name = "gas", .sticking = {sticking}};
    return Sample{mesh, of_seed, {"gas"}, solve_flux(mesh, {&gas, 1}, of_seed)};
  };
}

// As `scarp flux` solves it.
Case of_file(const std::string& file, float sticking) {
  return {file, [=](const Settings& settings) {
            TriMesh mesh =
                read_mesh(fs::path(SCARP_SOURCE_DIR) / "tests/reference/errors" / (file + ".obj"));
            mesh.materials.clear();
            return samples_of(mesh, options_of(mesh), sticking, settings);
          }};
}

Case of_shape(const std::string& name, const exact::Shape& shape, float sticking,
              const std::function<void(FluxOptions&)>& change = {}) {
  return {name, [=](const Settings& settings) {
            FluxOptions options = options_of(shape.mesh);
            options.sides = shape.sides;
            options.spacing = 1;
            if (change) change(options);
            return samples_of(shape.mesh, options, sticking, settings);
          }};
}

// A surface of a recipe: that at its start, or after some time with a seed of its own.
Case of_recipe(const std::string& name, const std::string& file, double time,
               std::vector<std::string> overrides = {}) {
  return {name, [=](const Settings& settings) {
            const auto read = [=](std::uint64_t seed) {
              std::vector<std::string> of_seed = overrides;
              of_seed.push_back(fmt::format("flux.seed={}", seed));
              of_seed.push_back(settings.rays > 0
                                    ? fmt::format("flux.rays={}", settings.rays)
                                    : fmt::format("flux.target_error={}", settings.target));
              return read_recipe(recipe_in(fs::path(SCARP_SOURCE_DIR) / file, of_seed));
            };
            const Recipe first = read(1'000'000);
            auto state = std::make_shared<State>(start_state(first.domain.frame, first.start));
            while (state->time < time) {
              begin_step(*state, first.steps);
              const Survey now = survey(*state, first);
              note_voids(*state, now.gas);
              advance(*state, first, now, time);
            }
            begin_step(*state, first.steps);
            return Sampler([=](std::uint64_t seed) {
              const Recipe recipe = read(seed);
              Survey now = survey(*state, recipe);
              Sample sample;
              sample.options = recipe.flux.options;
              const std::vector<Species> species =
                  current_step(*state, recipe.steps).model->species();
              for (std::size_t k = 0; k < species.size(); ++k) {
                if (now.flux[k].engine != FluxEngine::gather) continue;
                sample.names.push_back(species[k].name);
                sample.fields.push_back(std::move(now.flux[k]));
              }
              sample.mesh = std::move(now.facets);
              return sample;
            });
          }};
}

// A slab of a trench twice as deep as wide, in cells of one spacing.
exact::Shape thin_slab(double depth) {
  const Vec3d y{0, 2.4, 0};
  const int rows = static_cast<int>(depth);
  exact::Builder builder;
  builder.grid({-12, 0, 0}, {6, 0, 0}, 4, y, 2);
  builder.grid({-6, 0, 0}, {0, 0, -depth}, rows, y, 2);
  builder.grid({-6, 0, -depth}, {12, 0, 0}, 12, y, 2);
  builder.grid({6, 0, -depth}, {0, 0, depth}, rows, y, 2);
  builder.grid({6, 0, 0}, {6, 0, 0}, 4, y, 2);
  return {builder.mesh, {.lower = {-12, 0}, .upper = {12, y.y}}};
}

// The section of a hole of revolution about the lower end of x.
exact::Shape half_section(double radius, double depth) {
  const Vec3d y{0, 1, 0};
  exact::Builder builder;
  builder.grid({0, 0, -depth}, {radius, 0, 0}, static_cast<int>(radius), y, 1);
  builder.grid({radius, 0, -depth}, {0, 0, depth}, static_cast<int>(depth), y, 1);
  builder.grid({radius, 0, 0}, {radius, 0, 0}, static_cast<int>(radius), y, 1);
  return {builder.mesh, {.lower = {0, 0}, .upper = {2 * radius, 1}}};
}

std::vector<Case> cases() {
  const auto section = [](FluxOptions& options) { options.two_dimensional = true; };
  const auto rings = [](FluxOptions& options) { options.axisymmetric = true; };
  return {of_file("hole_6", 0.3F),
          of_file("trench_2", 0.3F),
          of_shape("slab", thin_slab(24), 0.3F),
          of_shape("slab_deep", thin_slab(60), 0.1F),
          of_shape("section", thin_slab(24), 0.3F, section),
          of_shape("section_deep", thin_slab(60), 0.1F, section),
          of_shape("rings", half_section(6, 36), 0.3F, rings),
          of_shape("trench", exact::trench(4), 0.1F),
          of_shape("hole", exact::hole(4, 11, 10, 64), 0.1F),
          of_shape("hole_small", exact::hole(2, 14, 5, 24), 0.1F),
          of_recipe("sf6_start", "configs/sf6_o2_hole.toml", 0),
          of_recipe("sf6_later", "configs/sf6_o2_hole.toml", 30)};
}

/// Values and stated errors at some places.
struct Stated {
  std::vector<double> value;
  std::vector<double> error;
};

/// How (value - mean) / error scatters.
struct Ratio {
  double deviation = 0;
  double error = 0;     ///< of it
  double of_roots = 0;  ///< root mean square of the deviations over that of the errors
  double mean = 0;      ///< of value over stated error, where the right value is zero
  double stated = 0;    ///< error, root mean square
  std::size_t places = 0;
};

Ratio ratio_of(const std::vector<Stated>& runs, const std::vector<std::size_t>& places,
               bool mean_is_zero) {
  const auto n = static_cast<double>(runs.size());
  std::vector<double> mean(runs.front().value.size());
  if (!mean_is_zero)
    for (const Stated& run : runs)
      for (const std::size_t k : places) mean[k] += run.value[k] / n;
  const double shrunk = mean_is_zero ? 1 : 1 - 1 / n;
  RunningStatistics squares;
  RunningStatistics ratios;
  double deviations = 0;
  double errors = 0;
  for (const Stated& run : runs) {
    RunningStatistics square;
    for (const std::size_t k : places) {
      if (run.error[k] == 0) continue;
      const double apart = run.value[k] - mean[k];
      deviations += apart * apart / shrunk;
      errors += run.error[k] * run.error[k];
      ratios.add(apart / run.error[k]);
      square.add(apart * apart / (run.error[k] * run.error[k] * shrunk));
    }
    if (square.count() > 0) squares.add(square.mean());
  }
  if (squares.count() == 0) return {.places = places.size()};
  const double deviation = std::sqrt(squares.mean());
  return {deviation,
          squares.std_error() / (2 * deviation),
          std::sqrt(deviations / errors),
          ratios.mean(),
          std::sqrt(errors / (n * static_cast<double>(places.size()))),
          places.size()};
}

/// By the name of a place the numbers of facets or patches there.
using Places = std::map<std::string, std::vector<std::size_t>>;

struct Facets {
  std::vector<double> height;
  std::vector<double> area;
  std::vector<double> up;  // of the normal
};

Facets facets_of(const TriMesh& mesh) {
  Facets facets;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto [a, b, c] = corners(mesh, f);
    const Vec3d area = area_vector(mesh, f);
    facets.height.push_back((a.z + b.z + c.z) / 3);
    facets.area.push_back(length(area));
    facets.up.push_back(area.z / length(area));
  }
  return facets;
}

std::string place_at(double height, double up, double lowest, double highest) {
  const double at = (height - lowest) / (highest - lowest);
  if (up > 0.7) return at < 0.2 ? "4 floor" : at > 0.8 ? "0 top" : "5 between";
  return at > 2.0 / 3 ? "1 upper third" : at > 1.0 / 3 ? "2 middle third" : "3 lower third";
}

Places places_of_facets(const TriMesh& mesh) {
  const Facets facets = facets_of(mesh);
  const auto [lowest, highest] = std::ranges::minmax(facets.height);
  Places places;
  for (std::size_t f = 0; f < facets.height.size(); ++f)
    places[place_at(facets.height[f], facets.up[f], lowest, highest)].push_back(f);
  return places;
}

Places places_of_patches(const Sample& sample) {
  TriMesh mesh = sample.mesh;
  Sides sides = sample.options.sides;
  std::vector<std::uint32_t> rings;
  if (sample.options.axisymmetric) {
    const Revolution revolution(sample.mesh, sample.options.sides);
    mesh = revolution.mesh();
    sides = revolution.sides();
    rings = revolution.rings();
  }
  const RayScene scene(mesh, sides,
                       sample.options.spacing > 0 ? sample.options.spacing : guessed_spacing(mesh));
  const Patches patches(mesh, scene, rings);
  const Facets facets = facets_of(mesh);
  const auto [lowest, highest] = std::ranges::minmax(facets.height);
  Places places;
  for (std::size_t p = 0; p < patches.list().size(); ++p) {
    double area = 0;
    double height = 0;
    double up = 0;
    for (const std::uint32_t f : patches.list()[p].facets) {
      area += facets.area[f];
      height += facets.area[f] * facets.height[f];
      up += facets.area[f] * facets.up[f];
    }
    places[place_at(height / area, up / area, lowest, highest)].push_back(p);
  }
  return places;
}

Json json_of(const Ratio& ratio) {
  return {{"places", ratio.places},     {"ratio", ratio.deviation}, {"std_error", ratio.error},
          {"of_roots", ratio.of_roots}, {"mean", ratio.mean},       {"stated", ratio.stated}};
}

Json measure(const Case& of, const Settings& settings) {
  const Sampler sampler = of.begin(settings);
  Json result;
  std::map<std::string, std::array<std::vector<Stated>, 2>> runs;  // facets and patches
  std::map<std::string, std::vector<Stated>> balances;
  RunningStatistics rays;
  std::array<Places, 2> places;
  for (std::uint64_t seed = 1; seed <= settings.seeds; ++seed) {
    const Sample sample = sampler(seed);
    if (seed == 1) places = {places_of_facets(sample.mesh), places_of_patches(sample)};
    for (std::size_t k = 0; k < sample.fields.size(); ++k) {
      const Tally& tally = sample.fields[k].arrivals();
      const auto& name = sample.names[k];
      rays.add(static_cast<double>(sample.fields[k].rays));
      runs[name][0].push_back({{tally.mean.begin(), tally.mean.end()},
                               {tally.std_error.begin(), tally.std_error.end()}});
      runs[name][1].push_back({{tally.patch_mean.begin(), tally.patch_mean.end()},
                               {tally.patch_std_error.begin(), tally.patch_std_error.end()}});
      const FluxAudit& audit = sample.fields[k].audit;
      balances[name].push_back({{audit.balance_error()}, {audit.balance_std_error}});
    }
  }
  for (const auto& [species, of_species] : runs) {
    for (const std::size_t kind : {0, 1})
      for (const auto& [place, numbers] : places[kind])
        result[species][kind == 0 ? "facets" : "patches"][place.substr(2)] =
            json_of(ratio_of(of_species[kind], numbers, false));
    result[species]["balance"]["all"] = json_of(ratio_of(balances[species], {0}, true));
    result[species]["rays"] = {{"mean", rays.mean()}, {"deviation", std::sqrt(rays.variance())}};
  }
  return result;
}

constexpr std::array places_told{"upper third", "middle third", "lower third", "floor"};

void print_head() {
  fmt::print("| case | species | of");
  for (const char* const place : places_told) fmt::print(" | {}", place);
  fmt::print(" | balance |\n| --- | --- | --- | --- | --- | --- | --- | --- |\n");
}

std::string text(const Json& ratio) {
  return fmt::format("{:.2f} ± {:.2f}", ratio["ratio"].get<double>(),
                     ratio["std_error"].get<double>());
}

void print(const std::string& name, const Json& result) {
  for (const auto& [species, kinds] : result.items()) {
    for (const std::string kind : {"facets", "patches"}) {
      fmt::print("| {} | {} | {}", name, species, kind);
      for (const char* const place : places_told)
        fmt::print(" | {}", kinds[kind].contains(place) ? text(kinds[kind][place]) : "");
      fmt::print(" | {} |\n", kind == "patches" ? text(kinds["balance"]["all"]) : "");
    }
  }
  std::cout.flush();
}

void run_cases(const Settings& settings) {
  const ThreadLimit one_thread(1);
  Json results;
  if (!settings.json) print_head();
  for (const Case& each : cases()) {
    const bool is_wanted = settings.cases.empty() ||
                           std::ranges::find(settings.cases, each.name) != settings.cases.end();
    if (!is_wanted) continue;
    results[each.name] = measure(each, settings);
    if (!settings.json) print(each.name, results[each.name]);
  }
  if (settings.json) std::cout << results.dump(2) << '\n';
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  const auto declare = [&](CLI::App& app) {
    scarp::bench::add_cases(app, scarp::bench::cases(), settings.cases);
    app.add_option("--seeds", settings.seeds, "Of each case");
    app.add_option("--target", settings.target, "Error to which rays are added");
    app.add_option("--rays", settings.rays, "As many in place of the target");
    app.add_flag("--json", settings.json, "One object on standard output");
  };
  return scarp::bench::bench_main(argc, argv, "whether stated errors of fluxes are true", declare,
                                  [&] { scarp::bench::run_cases(settings); });
}
